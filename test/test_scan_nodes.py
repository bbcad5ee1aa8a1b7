# SPDX-License-Identifier: Apache-2.0
"""Potential scan over DDS: fake robot, lidar and navigator; and a bag of it."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from test_commands import OK, gradnav

from tbot_gradnav import bags, shipped
from tbot_gradnav.fake_lidar import LIDARS, FakeLidar
from tbot_gradnav.navigation import Navigation
from tbot_gradnav.plant import Plant
from tbot_gradnav.recording import recording

SCAN = """
potential: scan
goal: [1.2, 0.0]
obstacles:
  names: [post]
  post: {x: 0.6, y: 0.05, radius: 0.1}
boundary: {shape: polygon, points: [-1.5, -1.5, 2.5, -1.5, 2.5, 1.5, -1.5, 1.5]}
range_noise: 0.01
range_dropout: 0.05
driver_quirks: true
"""


def test_a_robot_finds_its_way_by_its_lidar(graph, parameter_file):
    from geometry_msgs.msg import PoseStamped

    file = parameter_file(SCAN)
    truth = graph.listen(PoseStamped, "ground_truth")
    robot = graph.start("fake_robot", "--ros-args", "--params-file", file)
    navigator = graph.start("navigator", "--ros-args", "--params-file", file)
    graph.until(lambda: "arrived" in navigator.words, "arrival", 40.0)
    position = truth[-1].pose.position
    assert math.hypot(position.x - 1.2, position.y) < 0.1
    nearest = min(math.hypot(m.pose.position.x - 0.6, m.pose.position.y - 0.05) for m in truth)
    assert nearest > 0.1 + 0.105
    assert "Traceback" not in navigator.words + robot.words


def test_the_scan_is_published_as_lidars_do(graph, parameter_file):
    from rclpy.qos import ReliabilityPolicy, qos_profile_sensor_data
    from sensor_msgs.msg import LaserScan

    scans = []
    graph.node.create_subscription(LaserScan, "scan", scans.append, qos_profile_sensor_data)
    graph.start("fake_robot", "--ros-args", "--params-file", parameter_file(SCAN))
    graph.until(lambda: len(scans) >= 6, "six scans")
    (publisher,) = graph.node.get_publishers_info_by_topic("scan")
    assert publisher.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    assert len({len(scan.ranges) for scan in scans}) > 1  # as of the LDS-02
    stamps = [scan.header.stamp.sec + scan.header.stamp.nanosec * 1e-9 for scan in scans]
    assert all(b - a == pytest.approx(0.2, abs=0.11) for a, b in pairwise(stamps))
    assert scans[0].header.frame_id == "base_scan"
    hits = [r for r in scans[0].ranges if math.isfinite(r)]
    assert 0.4 < min(hits) < 0.6  # the post, from 32 mm behind the centre


def test_without_a_lidar_the_robot_stands_until_there_is_one(graph, parameter_file):

    from rclpy.qos import qos_profile_sensor_data
    from robot import Robot
    from sensor_msgs.msg import LaserScan

    robot = Robot(graph, 0.0, 0.0, 0.0)
    navigator = graph.start("navigator", "--ros-args", "--params-file", parameter_file(SCAN))
    graph.until(lambda: "no lidar scan" in navigator.words, "complaint")
    graph.until(lambda: robot.stopped, "stop")
    publisher = graph.node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)

    def publish(increment):
        scan = LaserScan(angle_increment=increment, range_min=0.12, range_max=3.5)
        scan.header.stamp = graph.node.get_clock().now().to_msg()
        scan.ranges = [0.0] * 180 + [3.0] * 180
        publisher.publish(scan)

    bad = graph.node.create_timer(0.1, lambda: publish(0.0))
    graph.until(lambda: "cannot be placed" in navigator.words, "word about a bad scan")
    assert not robot.moving
    bad.cancel()
    good = graph.node.create_timer(0.1, lambda: publish(math.pi / 180))
    graph.until(lambda: robot.moving, "command")
    good.cancel()
    graph.until(lambda: robot.stopped, "stop without scans")


def test_a_demo_records_what_the_lidar_saw(graph, parameter_file, tmp_path):
    file, domain = parameter_file(SCAN), {"ROS_DOMAIN_ID": str(graph.domain)}
    result = gradnav("demo", file, "--out", tmp_path, env=domain)
    assert result.returncode == OK, result.stdout + result.stderr
    with bags.opened(tmp_path / "bag") as bag:
        assert bag.count("/scan") > 3 * bag.duration  # five a second, best effort


def test_a_replay_sees_what_the_robot_saw(parameter_file, tmp_path):
    """Odometry, scans and commands as a robot gave and took them, exactly repeated."""
    file = parameter_file(SCAN)
    configuration = shipped.configuration(file)
    settings, commands = configuration.settings, []
    navigation, plant = Navigation(settings), Plant(configuration.fake_robot, settings.start)
    lidar = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_01"], 0.01, 0.05, 0)
    with recording(tmp_path / "bag") as recorder:
        for tick in range(160):
            now, at = 0.05 * tick, round(0.05 * tick * 1e9)
            plant.advance(now)
            if tick % 4 == 0:
                sweep = lidar.sweep(now, plant.pose)
                navigation.see(sweep._replace(ranges=np.float32(sweep.ranges).astype(float)))
                write_scan(recorder, at, sweep)
            reading = plant.read()._replace(stamp=now)
            _, twist, _ = navigation.update(reading)
            recorder.write_odometry(at, reading)
            recorder.write_command(at, twist)
            plant.receive(now, twist)
            commands.append(twist)
    assert max(abs(float(twist.omega)) for twist in commands) > 0.1  # it has turned for the post
    out = tmp_path / "verdict.json"
    result = gradnav("replay", tmp_path / "bag", file, "--json", out)
    assert result.returncode == OK, result.stdout
    verdict = json.loads(out.read_text())
    assert verdict["max_v_difference"] < 1e-6
    assert verdict["max_omega_difference"] < 1e-6


def write_scan(recorder, stamp, sweep):
    """Append a LaserScan to a bag."""
    from rosbags.typesys import Stores, get_typestore

    store, kind = get_typestore(Stores.ROS2_JAZZY), "sensor_msgs/msg/LaserScan"
    seconds, nanoseconds = divmod(stamp, 10**9)
    time = store.types["builtin_interfaces/msg/Time"](seconds, nanoseconds)
    message = store.types[kind](
        store.types["std_msgs/msg/Header"](time, "base_scan"),
        sweep.angle_min,
        sweep.angle_min + sweep.ranges.size * sweep.angle_increment,
        sweep.angle_increment,
        0.0,
        0.2,
        sweep.range_min,
        sweep.range_max,
        np.float32(sweep.ranges),
        np.empty(0, dtype=np.float32),
    )
    recorder.write("/scan", kind, stamp, bytes(store.serialize_cdr(message, kind)))

# SPDX-License-Identifier: Apache-2.0
"""The navigator with the potential map, as its robot and its user see it."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")
pytest.importorskip("skfmm", reason="needs scikit-fmm: pip install tbot_gradnav[map]")

import plans
from conftest import CONFIG
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
from remote import Remote
from robot import Robot

from tbot_gradnav.ros import LATCHED

OFFICE = f"potential: map\nmap: {{file: {CONFIG}/maps/office.yaml}}\n"
NEAR = "goal: [3.0, 4.2]\ninitial_pose: [2.4, 4.2, 0.0]"


def navigator(graph, file):
    return graph.start("navigator", "--ros-args", "--params-file", file)


def children(process):
    """Return the processes that a process has started."""
    tasks = Path(f"/proc/{process.process.pid}/task").glob("*/children")
    return [int(pid) for task in tasks for pid in task.read_text().split()]


def alive(pid):
    return (
        Path(f"/proc/{pid}/stat").exists() and ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    )


def goal_publisher(graph, drive):
    """Return a function that sets a goal in the world frame."""
    publisher = graph.node.create_publisher(PoseStamped, "goal_pose", 10)
    graph.until(lambda: publisher.get_subscription_count(), "navigator on goal_pose")

    def publish(x, y):
        goal = PoseStamped()
        goal.header.frame_id = "map"
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 0.0
        publisher.publish(goal)

    return publish


def as_message(occupancy):
    """Return a map as map_server would publish it."""
    message = OccupancyGrid()
    message.header.frame_id = "map"
    message.info.resolution = occupancy.resolution
    message.info.height, message.info.width = occupancy.cells.shape
    message.info.origin.position.x, message.info.origin.position.y = occupancy.x, occupancy.y
    message.info.origin.orientation.w = 1.0
    message.data = occupancy.cells.ravel().tolist()
    return message


def test_drives_in_a_map_from_a_file_to_one_goal_and_then_another(graph, parameter_file):
    robot = Robot(graph, 2.4, 4.2, 0.0)
    drive = navigator(graph, parameter_file(OFFICE + NEAR))
    graph.until(lambda: drive.words.count("arrived") == 1, "arrival")
    assert robot.distance(3.0, 4.2) <= 0.05
    set_goal = goal_publisher(graph, drive)
    set_goal(3.0, 3.25)  # in a wall
    graph.until(lambda: "goal refused" in drive.words, "refusal")
    assert "inside a wall" in drive.words
    set_goal(2.7, 4.4)
    graph.until(lambda: drive.words.count("arrived") == 2, "arrival")
    assert robot.distance(2.7, 4.4) <= 0.05


def test_a_goal_without_a_way_from_where_the_robot_is_is_refused_and_the_old_one_kept(
    graph, parameter_file, tmp_path
):
    walls = np.zeros((60, 120), dtype=bool)
    walls[:, 60:63] = True
    (tmp_path / "rooms.pgm").write_bytes(
        b"P5 120 60 255\n" + np.where(walls, 0, 254).astype(np.uint8).tobytes()
    )
    (tmp_path / "rooms.yaml").write_text("image: rooms.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    robot = Robot(graph, 1.0, 1.0, 0.0)
    start = "potential: map\nmap: {file: rooms.yaml}\ngoal: [2.0, 1.0]\ninitial_pose: [1, 1, 0]"
    drive = navigator(graph, parameter_file(start))  # beside which the map lies
    graph.until(lambda: robot.moving, "command")
    goal_publisher(graph, drive)(5.0, 1.0)
    graph.until(lambda: "goal refused" in drive.words, "refusal")
    assert "no way to it from" in drive.words
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert robot.distance(2.0, 1.0) <= 0.05


def test_stands_until_a_map_comes_by_the_topic_and_heeds_the_next_one(graph, parameter_file):
    robot = Robot(graph, 2.0, 2.0, 0.0)
    start = "potential: map\ngoal: [3.0, 2.0]\ninitial_pose: [2, 2, 0]"
    drive = navigator(graph, parameter_file(start))
    graph.until(lambda: "waiting for a map on /map" in drive.words, "word about the map")
    graph.until(lambda: robot.stopped, "command")
    assert all(v == omega == 0.0 for _, v, omega in robot.commands)
    publisher = graph.node.create_publisher(OccupancyGrid, "map", LATCHED)
    publisher.publish(as_message(plans.trap()))
    graph.until(lambda: robot.moving, "motion")
    walls = ~plans.trap().free
    walls[:, 50:53] = True  # the way to the goal is barred
    publisher.publish(as_message(plans.grid(walls)))
    graph.until(lambda: "goal given up in a new map" in drive.words, "word about the goal")
    graph.until(lambda: robot.stopped, "stop")
    assert "no way to it" in drive.words
    set_goal = goal_publisher(graph, drive)
    publisher.publish(as_message(plans.trap()))
    graph.until(lambda: drive.words.count("cells of 0.05 m came") == 2, "word about the map")
    set_goal(3.0, 2.0)
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert "Traceback" not in drive.words


def test_the_same_map_again_does_not_stop_the_robot(graph, parameter_file):
    robot = Robot(graph, 2.0, 2.0, 0.0)
    start = "potential: map\ngoal: [3.0, 2.0]\ninitial_pose: [2, 2, 0]"
    drive = navigator(graph, parameter_file(start))
    publisher = graph.node.create_publisher(OccupancyGrid, "map", LATCHED)
    message = as_message(plans.trap())
    publisher.publish(message)
    graph.until(lambda: robot.moving, "motion")
    graph.node.create_timer(0.2, lambda: publisher.publish(message))
    before = len(robot.commands)
    graph.until(lambda: "arrived" in drive.words, "arrival", patience=30.0)
    moving = [abs(v) + abs(omega) > 0.0 for _, v, omega in robot.commands[before:]]
    assert all(moving[: len(moving) - 1 - moving[::-1].index(True)])
    assert drive.words.count("cells of 0.05 m came") == 1


def test_cancel_stops_the_robot_even_if_its_map_can_no_longer_be_read(
    graph, parameter_file, tmp_path
):
    hall = np.full((100, 100), 254, dtype=np.uint8)
    (tmp_path / "hall.pgm").write_bytes(b"P5 100 100 255\n" + hall.tobytes())
    (tmp_path / "hall.yaml").write_text("image: hall.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    robot, remote = Robot(graph, 1.0, 2.0, 0.0), Remote(graph)
    start = "potential: map\nmap: {file: hall.yaml}\ngoal: [4.0, 2.0]\ninitial_pose: [1, 2, 0]"
    drive = navigator(graph, parameter_file(start))
    graph.until(lambda: robot.moving, "motion")
    (tmp_path / "hall.yaml").write_text("")
    success, reason = remote.trigger("cancel")
    assert not success
    assert reason.startswith("the robot stands, but its goal stays set: map.file: ")
    graph.until(lambda: robot.stopped, "stop")
    commands = len(robot.commands)
    graph.spin(0.5)
    assert len(robot.commands) == commands
    assert remote.states[-1] == "idle"
    assert "Traceback" not in drive.words


def test_a_map_in_another_frame_is_refused(graph, parameter_file):
    start = "potential: map\ngoal: [3.0, 2.0]\ninitial_pose: [2, 2, 0]"
    drive = navigator(graph, parameter_file(start))
    publisher = graph.node.create_publisher(OccupancyGrid, "map", LATCHED)
    message = as_message(plans.trap())
    message.header.frame_id = "attic"
    publisher.publish(message)
    graph.until(lambda: "map refused: it is in frame attic" in drive.words, "refusal")


def test_odometry_is_answered_while_a_field_is_made(graph, parameter_file, tmp_path):
    hall = np.full((1000, 1000), 254, dtype=np.uint8)  # 50 m a side, most of a second to march
    hall[20::40, 20::40] = 0  # columns, every 2 m
    (tmp_path / "hall.pgm").write_bytes(b"P5 1000 1000 255\n" + hall.tobytes())
    (tmp_path / "hall.yaml").write_text("image: hall.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    robot = Robot(graph, 2.0, 2.0, 0.0)
    start = "potential: map\nmap: {file: hall.yaml}\ngoal: [2.3, 2.0]\ninitial_pose: [2, 2, 0]"
    drive = navigator(graph, parameter_file(start))
    graph.until(lambda: "arrived" in drive.words, "arrival", patience=40.0)
    set_goal = goal_publisher(graph, drive)
    graph.until(lambda: robot.stopped, "stop")
    before = len(robot.commands)
    set_goal(20.0, 20.0)
    graph.until(lambda: robot.moving, "motion")
    times = np.array([at for at, _, _ in robot.commands[before:]])
    standing = [v == omega == 0.0 for _, v, omega in robot.commands[before:]]
    assert sum(standing) >= 4  # it stood for a while, or this test shows nothing
    assert np.diff(times).max() < 0.3  # the robot's period is 0.05


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_process_is_left_behind(graph, parameter_file, number):
    robot = Robot(graph, 2.4, 4.2, 0.0)
    drive = navigator(graph, parameter_file(OFFICE + NEAR))
    graph.until(lambda: robot.moving, "command")
    goal_publisher(graph, drive)(2.7, 4.4)
    graph.until(lambda: children(drive), "process that marches")
    helpers = children(drive)
    os.killpg(drive.process.pid, number)  # as a terminal does
    drive.wait()
    end = time.monotonic() + 10.0
    while any(map(alive, helpers)):
        assert time.monotonic() < end, "a process is left behind"
        graph.spin(0.05)
    assert "Traceback" not in drive.words

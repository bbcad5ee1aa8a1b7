# SPDX-License-Identifier: Apache-2.0
"""Several robots on one graph, and several nodes in one process."""

import math
import time

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from remote import Remote
from robot import Robot

from tbot_gradnav.fake_robot import FakeRobot
from tbot_gradnav.navigator import Navigator

FLEET = 8
DISTANCE = 0.6  # [m] of each robot's goal


def test_eight_robots_in_namespaces_arrive_each_by_its_own_file(graph, parameter_file):
    """Each has another place and goal, as far away; the goals of the others would be far off."""
    robots, remotes, goals, drives = [], [], [], []
    for i in range(FLEET):
        turn = 2.0 * math.pi * i / FLEET
        x, y, towards = 10.0 * i, -5.0 * i, (math.cos(turn), math.sin(turn))
        goals.append((x + DISTANCE * towards[0], y + DISTANCE * towards[1]))
        text = f"initial_pose: [{x}, {y}, {turn}]\ngoal: [{goals[i][0]}, {goals[i][1]}]"
        file = parameter_file(text, f"robot{i}.yaml")
        rules = ["-r", f"__ns:=/robot{i}"]
        drives.append(graph.start("navigator", "--ros-args", "--params-file", file, *rules))
        remotes.append(Remote(graph, f"/robot{i}/"))
        robots.append(Robot(graph, x, y, turn, namespace=f"/robot{i}/"))
        robots[i].silent = True
    graph.until(lambda: all(r.state == "no odometry" for r in remotes), "eight navigators", 60.0)
    began, arrived = time.monotonic(), {}

    def note():
        for i, remote in enumerate(remotes):
            if remote.state == "arrived":
                arrived.setdefault(i, time.monotonic() - began)
        return len(arrived) == FLEET

    for robot in robots:
        robot.silent = False
    graph.until(note, "arrival of all", patience=30.0)
    for robot, goal in zip(robots, goals, strict=True):
        assert robot.distance(*goal) <= 0.05
    assert max(arrived.values()) <= 1.5 * min(arrived.values()) + 0.5
    assert all("Traceback" not in drive.words for drive in drives)


def test_navigator_and_fake_robot_share_a_process_and_an_executor(graph):
    """They are ordinary nodes whose arguments are rclpy's; so others may join them."""
    given = {
        "initial_pose": [1.0, 0.0, 3.0],
        "goal": [0.4, 0.1],
        "obstacles.names": ["a"],
        "obstacles.a.x": 0.7,
        "obstacles.a.y": 0.5,
        "obstacles.a.radius": 0.2,
    }
    overrides = [Parameter(name, value=value) for name, value in given.items()]
    context = rclpy.Context()
    rclpy.init(context=context, args=[], domain_id=graph.domain)
    nodes = [
        kind(context=context, namespace="composed", parameter_overrides=overrides)
        for kind in (Navigator, FakeRobot)
    ]
    executor = EventsExecutor(context=context)
    for node in nodes:
        executor.add_node(node)
    remote = Remote(graph, "/composed/")
    truth = graph.listen(PoseStamped, "composed/ground_truth")
    end = time.monotonic() + 30.0
    while remote.state != "arrived" and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)
        graph.executor.spin_once(timeout_sec=0.0)
    assert remote.state == "arrived"
    place = truth[-1].pose.position
    assert math.dist((place.x, place.y), (0.4, 0.1)) <= 0.05
    nodes[0].close()
    for node in nodes:
        node.destroy_node()
    executor.shutdown()
    context.try_shutdown()

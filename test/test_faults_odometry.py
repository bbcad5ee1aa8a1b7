# SPDX-License-Identifier: Apache-2.0
"""Odometry as broken drivers, clocks and networks make it, in one drive after the other."""

import math
import time

import pytest
from arenas import assert_sound

pytest.importorskip("rclpy", reason="needs ROS 2")

from builtin_interfaces.msg import Time
from robot import Robot


def position(value):
    def spoil(message):
        message.pose.pose.position.y = value
        return message

    return spoil


def quaternion(x, y, z, w):
    def spoil(message):
        q = message.pose.pose.orientation
        q.x, q.y, q.z, q.w = x, y, z, w
        return message

    return spoil


def scaled(factor):
    def spoil(message):
        q = message.pose.pose.orientation
        q.z, q.w = factor * q.z, factor * q.w
        return message

    return spoil


def rolled(message):
    """Turn the robot about its own x axis by 180 degrees: q (1, 0, 0, 0)."""
    q = message.pose.pose.orientation
    q.x, q.y, q.z, q.w = q.w, q.z, 0.0, 0.0
    return message


def nearly_rolled(message):
    q = message.pose.pose.orientation
    half = math.radians(179.0) / 2.0
    c, s = math.cos(half), math.sin(half)
    q.x, q.y, q.z, q.w = s * q.w, s * q.z, c * q.z, c * q.w
    return message


def shifted(seconds):
    def spoil(message):
        message.header.stamp.sec += seconds
        return message

    return spoil


def frozen_stamp(message):
    message.header.stamp = Time(sec=1)
    return message


def spinning(message):
    message.twist.twist.angular.z = 125.0 * (-1.0) ** message.header.stamp.nanosec
    return message


def held(message, kept=[]):  # noqa: B006 (its memory)
    """Repeat the first message for ever, as a driver that hangs."""
    kept.append(message)
    return kept[0]


def swapped(message, kept=[]):  # noqa: B006 (its memory)
    """Let every message but the first be overtaken by the next."""
    kept.append(message)
    return kept[-1] if len(kept) < 3 or len(kept) % 2 else kept[-2]


def alternating(seconds):
    turns = iter(range(1_000_000))

    def spoil(message):
        message.header.stamp.sec += seconds * (next(turns) % 2)
        return message

    return spoil


STOPPING = {
    "nan": position(math.nan),
    "inf": position(math.inf),
    "zero quaternion": quaternion(0.0, 0.0, 0.0, 0.0),
    "nan quaternion": quaternion(0.0, 0.0, math.nan, 1.0),
    "rolled by 180 degrees": rolled,  # which has no yaw
    "a driver that hangs": held,
}
HARMLESS = {
    "quaternion of size 1000": scaled(1e3),
    "quaternion of size 0.001": scaled(1e-3),
    "rolled by 179 degrees": nearly_rolled,
    "stamps from the past": shifted(-1000),
    "stamps from the future": shifted(1_000_000),
    "stamps that jump to and fro": alternating(1000),
    "frozen stamps": frozen_stamp,
    "out of order": swapped,
    "spurious twists": spinning,
}


@pytest.fixture
def driven(graph, parameter_file):
    """Give a robot on its way to a goal that is far away, and its navigator."""
    robot = Robot(graph, 0.0, 0.0, 0.5)
    file = parameter_file("goal: [9, 0.5]\ninitial_pose: [0, 0, 0.5]")
    drive = graph.start("navigator", "--ros-args", "--params-file", file)
    graph.until(lambda: robot.moving, "command")
    yield robot, drive
    for _, v, omega in robot.commands:
        assert_sound(v, omega)
    assert "Traceback" not in drive.words


def moves_on(graph, robot, what):
    """Wait until the robot, by commands that follow from now on, is really getting on."""
    x = float(robot.plant.pose.x)
    graph.until(lambda: robot.moving and robot.plant.pose.x > x + 0.02, f"motion after {what}")


def test_what_has_no_pose_stops_the_robot_until_it_is_over(graph, driven):
    robot, drive = driven
    for name, spoil in STOPPING.items():
        robot.spoil = spoil
        begin = time.monotonic()
        graph.until(lambda: robot.stopped, f"stop at {name}")
        assert robot.commands[-1][0] - begin <= 0.5 + 0.35, name
        graph.spin(0.15)
        assert robot.stopped, name
        robot.spoil = lambda message: message
        moves_on(graph, robot, name)
    assert "hang?" in drive.words


def test_what_has_a_pose_does_not(graph, driven):
    robot, drive = driven
    for name, spoil in HARMLESS.items():
        robot.spoil = spoil
        moves_on(graph, robot, name)
        robot.spoil = lambda message: message
        moves_on(graph, robot, name)
    assert "stopped" not in drive.words


def test_holes_stop_the_robot_and_bursts_and_teleports_do_not(graph, driven):
    robot, drive = driven
    robot.silent = True
    graph.spin(2.0)
    assert robot.stopped
    robot.silent = False
    moves_on(graph, robot, "a hole of 2 s")
    begin, before = time.monotonic(), len(robot.commands)
    for i in range(1000):  # 1 kHz, in which nobody else takes part
        message = robot.message()
        message.header.stamp.nanosec = i * 1_000_000
        robot.publisher.publish(message)
        graph.spin(max(0.0, begin + 0.001 * i - time.monotonic()))
    graph.until(lambda: len(robot.commands) > before + 500, "answers to a burst")
    moves_on(graph, robot, "a burst")
    for shift in (5.0, -80.0, 0.0):
        robot.spoil = lambda message, shift=shift: moved(message, shift)
        moves_on(graph, robot, f"a teleport by {shift} m")
    assert drive.words.count("stopped: ") == 1
    assert "jumped" in drive.words


def moved(message, shift):
    message.pose.pose.position.x += shift
    return message

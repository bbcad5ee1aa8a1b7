# SPDX-License-Identifier: Apache-2.0
"""Processes that die, hang, multiply or come back: what the robot does then."""

import math
import signal
import time

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from geometry_msgs.msg import PoseStamped, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from robot import Robot
from rosgraph_msgs.msg import Clock

FAR_GOAL = "goal: [3, 0.5]\ninitial_pose: [0, 0, 0.5]"
TIMEOUT = 0.5  # [s] of the watchdog and of odometry
SLACK = 0.35  # [s] for a check's period and a busy machine


def navigator(graph, file, *more):
    return graph.start("navigator", "--ros-args", "--params-file", file, *more)


def watchdog(graph, *more):
    """Start a watchdog beside one who listens already; wait until it is heard and hears."""
    node = graph.start("cmd_vel_watchdog", *more)
    graph.until(lambda: graph.node.count_publishers("cmd_vel") == 1, "watchdog")
    graph.until(lambda: graph.node.count_subscribers("cmd_vel") == 2, "watchdog")
    return node


def truth_of(graph, *options):
    """Start the fake robot; return where it truly is."""
    truth = graph.listen(PoseStamped, "ground_truth")
    graph.start("fake_robot", "--ros-args", *options)
    graph.until(lambda: truth, "fake robot")
    return truth


def stands(truth, periods=4):
    """Return whether the last few true positions are one."""
    last = [(m.pose.position.x, m.pose.position.y) for m in truth[-periods:]]
    return len(last) == periods and len(set(last)) == 1


# The navigator killed


def test_a_robot_with_a_timeout_of_its_own_stops_when_the_navigator_is_killed(
    graph, parameter_file
):
    truth = truth_of(graph, "-p", "command_timeout:=0.3")
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: truth[-1].pose.position.x > 0.1, "motion")
    drive.send(signal.SIGKILL)
    drive.wait()
    del truth[:]
    graph.until(lambda: stands(truth), "stand", patience=0.3 + 4 * 0.05 + SLACK)


def test_the_watchdog_stops_the_robot_when_the_navigator_is_killed(graph, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    guard = watchdog(graph)
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: robot.moving, "command")
    graph.until(lambda: "commands are heard" in guard.words, "watchdog")
    graph.spin(1.0)
    assert robot.moving
    assert "no command for" not in guard.words
    drive.send(signal.SIGKILL)
    last = robot.commands[-1][0]
    graph.until(lambda: robot.stopped, "stop")
    assert robot.commands[-1][0] - last <= TIMEOUT + SLACK
    graph.spin(TIMEOUT)
    assert robot.stopped
    assert guard.words.count("no command for 0.5 s") == 1
    assert "somebody else" not in drive.words


def test_the_watchdog_follows_the_robot_to_another_type(graph, parameter_file):
    """Its own subscription must not make the navigator speak the type of before."""
    before = graph.start("fake_robot", "--ros-args", "-p", "cmd_vel_type:=twist")
    guard = watchdog(graph)
    before.send(signal.SIGINT)
    assert before.wait() == 0
    graph.start("fake_robot", "--ros-args", "-p", "cmd_vel_type:=twist_stamped")
    heard = graph.listen(TwistStamped, "cmd_vel")
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: heard and heard[-1].twist.linear.x > 0.1, "command")
    graph.until(lambda: types_of_watchdog(graph) == {"geometry_msgs/msg/TwistStamped"}, "watchdog")
    graph.until(lambda: "commands are heard" in guard.words, "watchdog")
    drive.send(signal.SIGKILL)
    graph.until(lambda: heard[-1].twist == TwistMessage(), "stop")
    graph.until(lambda: "no command for" in guard.words, "word about it")
    assert "hears nothing" not in drive.words


def types_of_watchdog(graph):
    infos = graph.node.get_publishers_info_by_topic("/cmd_vel")
    return {info.topic_type for info in infos if info.node_name == "cmd_vel_watchdog"}


def commander(graph):
    publisher = graph.node.create_publisher(TwistMessage, "cmd_vel", 10)
    graph.until(lambda: publisher.get_subscription_count() == 2, "robot and watchdog")
    return publisher


def command(publisher, v):
    message = TwistMessage()
    message.linear.x = v
    publisher.publish(message)


def test_the_watchdog_stops_whoever_breaks_off_and_at_its_own_end(graph):
    robot = Robot(graph, 0.0, 0.0, 0.0)
    guard = watchdog(graph, "--ros-args", "-p", "watchdog_timeout:=0.3")
    publisher = commander(graph)
    for count, v in enumerate((0.1, -0.1, math.nan), start=1):
        command(publisher, v)
        graph.until(lambda: robot.moving, "command")
        graph.until(lambda n=count: robot.stopped and guard.words.count("no command") == n, "stop")
    command(publisher, 0.1)
    graph.until(lambda: robot.moving, "command")
    guard.send(signal.SIGINT)
    graph.until(lambda: robot.stopped, "stop")
    assert guard.wait() == 0
    assert guard.words.count("zero velocity published") == 1


def test_the_watchdog_is_silent_while_commands_come_or_the_robot_is_to_stand(graph):
    robot = Robot(graph, 0.0, 0.0, 0.0)
    watchdog(graph, "--ros-args", "-p", "watchdog_timeout:=0.3")
    publisher = commander(graph)
    for v in (0.1, 0.1, 0.1, 0.0):
        command(publisher, v)
        graph.spin(0.15)
    graph.spin(0.5)
    assert [v for _, v, _ in robot.commands] == [0.1, 0.1, 0.1, 0.0]


def test_the_watchdog_refuses_what_is_not_allowed(graph):
    guard = graph.start("cmd_vel_watchdog", "--ros-args", "-p", "watchdog_timeout:=0.0")
    assert guard.wait() == 2
    assert "watchdog_timeout: 0.0" in guard.words
    assert len(guard.words.splitlines()) == 1


# The robot killed, and others about


def test_a_fake_robot_that_is_killed_and_started_again_is_driven_on(graph, parameter_file):
    file = parameter_file("goal: [0.4, 0.1]")
    first = graph.start("fake_robot", "--ros-args", "--params-file", file)
    heard = graph.listen(TwistMessage, "cmd_vel")
    drive = navigator(graph, file)
    graph.until(lambda: len(heard) > 10, "commands")
    first.send(signal.SIGKILL)
    graph.until(lambda: "no odometry for" in drive.words, "complaint")
    assert heard[-1] == TwistMessage()
    graph.start("fake_robot", "--ros-args", "--params-file", file)
    graph.until(lambda: "arrived" in drive.words, "arrival")


def test_somebody_else_who_commands_is_noticed_once(graph, parameter_file):
    """Be it a program of another name or a second navigator."""
    Robot(graph, 0.0, 0.0, 0.5)
    file = parameter_file(FAR_GOAL)
    graph.node.create_publisher(TwistMessage, "cmd_vel", 10)
    drive = navigator(graph, file)
    graph.until(lambda: "(test)" in drive.words, "warning")
    navigator(graph, file)
    graph.until(lambda: "(navigator, test)" in drive.words, "warning")
    graph.spin(2.2)
    assert drive.words.count("somebody else") == 2


def test_a_subscriber_that_hangs_delays_nobody(graph, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    slow = graph.start("fake_robot", "--ros-args", "-r", "odom:=unheard")
    graph.until(lambda: graph.node.count_subscribers("cmd_vel") == 2, "fake robot")
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: robot.moving, "command")
    slow.send(signal.SIGSTOP)
    graph.spin(0.7)  # for more commands than its queue of ten holds
    before = len(robot.commands)
    graph.spin(1.0)
    assert len(robot.commands) - before >= 0.8 * 1.0 / 0.05
    drive.send(signal.SIGINT)
    sent = time.monotonic()
    graph.until(lambda: robot.stopped, "stop")
    assert robot.commands[-1][0] - sent <= 0.5
    assert drive.wait() == 0
    slow.send(signal.SIGCONT)


# Time that jumps


def test_a_clock_that_jumps_or_stands_changes_nothing(graph, parameter_file):
    """Neither the drive nor the stop without odometry hangs on a clock that others set."""
    robot = Robot(graph, 0.0, 0.0, 0.5)
    clock = graph.node.create_publisher(Clock, "/clock", 10)
    drive = navigator(graph, parameter_file(FAR_GOAL + "\nuse_sim_time: true"))
    graph.until(lambda: clock.get_subscription_count() >= 1 and robot.moving, "command")
    for seconds in (100, 101, 1_000_000, 3, 3, 0, 2_000_000_000, 50):
        message = Clock()
        message.clock.sec = seconds
        clock.publish(message)
        before = len(robot.commands)
        graph.spin(0.2)
        assert robot.moving
        assert len(robot.commands) > before
    robot.silent, cut = True, time.monotonic()
    graph.until(lambda: robot.stopped, "stop")
    assert robot.commands[-1][0] - cut <= TIMEOUT + SLACK
    robot.silent = False
    graph.until(lambda: robot.moving, "command")
    assert "Traceback" not in drive.words

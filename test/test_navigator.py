# SPDX-License-Identifier: Apache-2.0
"""The navigator as its robot and its user see it: a real process over real DDS."""

import math
import signal
import time

import pytest
from conftest import CONFIG

pytest.importorskip("rclpy", reason="needs ROS 2")

from geometry_msgs.msg import PoseStamped, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from robot import Robot
from std_srvs.srv import Trigger

FAR_GOAL = "goal: [3, 0.5]\ninitial_pose: [0, 0, 0.5]"
NEAR_GOAL = "goal: [0.5, 0.2]\ninitial_pose: [0, 0, 0.5]"


def navigator(graph, file, *more):
    return graph.start("navigator", "--ros-args", "--params-file", file, *more)


@pytest.mark.parametrize("arena", ["six", "nine"])
@pytest.mark.parametrize("potential", ["navigation_function", "attractive_repulsive"])
def test_arrives_with_a_noisy_late_and_quirky_robot(graph, arena, potential):
    file = CONFIG / f"{arena}_{potential}.yaml"
    options = {
        "driver_quirks": "true", "position_noise": 0.01, "heading_noise": 0.03,
        "command_latency": 0.1, "real_time_factor": 8.0, "use_sim_time": "true",
    }  # fmt: skip
    more = [word for name, value in options.items() for word in ("-p", f"{name}:={value}")]
    truth = graph.listen(PoseStamped, "ground_truth")
    graph.start("fake_robot", "--ros-args", "--params-file", file, *more)
    graph.until(lambda: truth, "fake robot")
    drive = navigator(graph, file, *more)
    graph.until(lambda: "arrived" in drive.words, "arrival", patience=40.0)
    graph.spin(0.5)  # for the last of the truth to come through
    begin, end = truth[0].pose.position, truth[-1].pose.position
    # xi(0) is taken at the first message, so its noise turns the whole world about the start
    sigma = math.hypot(0.01, 0.01, 0.03 * math.hypot(begin.x, begin.y))
    assert math.hypot(end.x, end.y) <= 0.05 + 3 * sigma
    assert "stopped" not in drive.words
    assert "jumped" not in drive.words


@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP]
)
def test_ends_a_drive_with_zero_velocity(graph, parameter_file, number):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: robot.moving, "command")
    drive.send(number)
    drive.send(number)  # as under ros2 launch, which may send it twice
    graph.until(lambda: robot.stopped, "stop")
    assert drive.wait() == 0
    graph.spin(0.2)
    assert robot.stopped
    assert drive.words.count("zero velocity") == 1
    assert "Traceback" not in drive.words


def test_stops_without_odometry_and_goes_on_with_it(graph, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    drive = navigator(graph, parameter_file(NEAR_GOAL))
    graph.until(lambda: robot.moving, "command")
    cut = time.monotonic()
    robot.silent = True
    graph.until(lambda: robot.stopped, "stop")
    assert robot.commands[-1][0] - cut <= 0.6
    graph.spin(2.0 - (time.monotonic() - cut))
    assert robot.stopped
    robot.silent = False
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert robot.distance(0.5, 0.2) <= 0.05
    assert drive.words.count("no odometry for 0.5 s") == 1
    assert drive.words.count("going on") == 1


def spoilt(message, value):
    message.pose.pose.position.x = value
    return message


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300])
def test_stops_at_impossible_odometry_and_goes_on_after_it(graph, parameter_file, value):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    drive = navigator(graph, parameter_file(NEAR_GOAL))
    graph.until(lambda: robot.moving, "command")
    robot.spoil = lambda message: spoilt(message, value)
    graph.until(lambda: robot.stopped, "stop")
    graph.spin(0.3)
    assert robot.stopped
    robot.spoil = lambda message: message
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert drive.words.count("stopped: odometry is") == 1


def test_a_reset_of_the_odometry_is_noticed_and_the_goal_still_reached(graph, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.5)
    drive = navigator(graph, parameter_file(NEAR_GOAL))
    graph.until(lambda: robot.distance(0.0, 0.0) > 0.2, "motion")
    robot.plant.reset_odometry()
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert robot.distance(0.5, 0.2) <= 0.05 + 0.02  # what the robot moved at the reset is lost
    assert drive.words.count("odometry jumped") == 1


@pytest.mark.parametrize("kind", [TwistMessage, TwistStamped])
def test_speaks_the_type_that_the_robot_listens_to(graph, parameter_file, kind):
    heard = graph.listen(kind, "cmd_vel")
    kind_name = "twist" if kind is TwistMessage else "twist_stamped"
    graph.start("fake_robot", "--ros-args", "-p", f"cmd_vel_type:={kind_name}")
    navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: heard, f"command as {kind.__name__}")


def test_warns_while_nobody_of_its_type_listens(graph, parameter_file):
    graph.listen(TwistStamped, "cmd_vel")
    drive = navigator(graph, parameter_file(FAR_GOAL + "\ncmd_vel_type: twist"))
    graph.until(lambda: "somebody listens for twist_stamped" in drive.words, "warning")


def test_warns_while_nobody_listens_at_all(graph, parameter_file):
    drive = navigator(graph, parameter_file(FAR_GOAL))
    graph.until(lambda: "nobody listens on /cmd_vel" in drive.words, "warning")


def send_goal(graph, x, y, frame):
    publisher = graph.node.create_publisher(PoseStamped, "goal_pose", 10)
    graph.until(lambda: publisher.get_subscription_count() == 1, "navigator")
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = float(x), float(y)
    message.pose.orientation.w = 0.0  # no orientation
    publisher.publish(message)
    return publisher


def test_waits_for_a_goal_and_takes_it_from_goal_pose(graph, parameter_file):
    robot = Robot(graph, 1.0, 1.0, 1.5)
    drive = navigator(graph, parameter_file("initial_pose: [1, 1, 1.5]"))
    graph.until(lambda: "waiting for goal_pose" in drive.words, "greeting")
    graph.spin(1.0)
    assert robot.commands == []
    send_goal(graph, 1.0, 1.3, "map")
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert robot.distance(1.0, 1.3) <= 0.05


def test_a_goal_in_the_odometry_frame_is_seen_from_the_start(graph, parameter_file):
    robot = Robot(graph, 1.0, 1.0, math.pi / 2)
    drive = navigator(graph, parameter_file("initial_pose: [1, 1, 1.5707963]\ngoal: [1, 1]"))
    graph.until(lambda: "arrived" in drive.words, "arrival at the start")
    send_goal(graph, 0.3, 0.0, "odom")
    graph.until(lambda: drive.words.count("arrived") == 2, "arrival")
    assert robot.distance(1.0, 1.3) <= 0.05


@pytest.mark.parametrize(
    ("x", "frame", "complaint"),
    [(1.0, "map", "obstacles.box"), (math.nan, "map", "finite"), (1.0, "moon", "frame moon")],
)
def test_refuses_an_impossible_goal_and_drives_on(graph, parameter_file, x, frame, complaint):
    robot = Robot(graph, 0.0, 0.0, 0.0)
    box = "\nobstacles: {names: [box], box: {x: 1, y: 0, radius: 0.2}}"
    drive = navigator(graph, parameter_file("goal: [0.0, 0.6]" + box))
    graph.until(lambda: robot.moving, "command")
    send_goal(graph, x, 0.0, frame)
    graph.until(lambda: "goal refused" in drive.words, "refusal")
    assert complaint in drive.words
    graph.until(lambda: "arrived" in drive.words, "arrival")
    assert robot.distance(0.0, 0.6) <= 0.05


@pytest.mark.parametrize("name", ["navigator", "fake_robot"])
@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("k_v: 0", "k_v: 0"),
        ("k_omgea: 1.0", "did you mean k_omega?"),
        ("goal: [1, nan_]", "goal:"),
        ("rate: -1", "rate: -1"),
    ],
)
def test_a_bad_parameter_ends_a_node_in_one_line(graph, parameter_file, name, text, complaint):
    node = graph.start(name, "--ros-args", "--params-file", parameter_file(text))
    assert node.wait() == 2
    assert complaint in node.words
    assert len(node.words.splitlines()) == 1


def test_a_missing_file_and_a_stray_word_end_it_with_one_line(graph, tmp_path):
    for arguments in (["--ros-args", "--params-file", tmp_path / "none.yaml"], ["stray.yaml"]):
        node = graph.start("navigator", *arguments)
        assert node.wait() == 2
        assert len(node.words.splitlines()) == 1


def test_a_list_on_the_command_line_may_mix_integers_and_floats(graph):
    robot = Robot(graph, 0.0, 0.0, 0.0)
    graph.start("navigator", "--ros-args", "-p", "goal:=[1, 0.5]")
    graph.until(lambda: robot.moving, "command")


def test_fake_robot_resets_its_odometry(graph):
    from nav_msgs.msg import Odometry

    heard = graph.listen(Odometry, "odom")
    graph.start("fake_robot")
    publisher = graph.node.create_publisher(TwistMessage, "cmd_vel", 10)
    command = TwistMessage()
    command.linear.x = 0.2
    graph.until(lambda: publisher.get_subscription_count() == 1, "fake robot")
    publisher.publish(command)
    graph.until(lambda: heard and heard[-1].pose.pose.position.x > 0.1, "motion")
    publisher.publish(TwistMessage())
    client = graph.node.create_client(Trigger, "reset_odometry")
    graph.until(client.service_is_ready, "service")
    future = client.call_async(Trigger.Request())
    graph.until(future.done, "answer")
    assert future.result().success
    graph.until(lambda: heard[-1].pose.pose.position.x < 0.05, "reset")


TRAP = """
goal: [0, 0]
initial_pose: [2.3, 0.1, 3]
robot_radius: 0.1
obstacles:
  names: [a, b, c, d, e]
  a: {x: 1.3, y: 0.0, radius: 0.2}
  b: {x: 1.4, y: 0.45, radius: 0.2}
  c: {x: 1.4, y: -0.45, radius: 0.2}
  d: {x: 1.8, y: 0.7, radius: 0.2}
  e: {x: 1.8, y: -0.7, radius: 0.2}
real_time_factor: 8.0
use_sim_time: true
"""


def test_says_that_it_is_stuck_and_stands(graph, parameter_file):
    file = parameter_file(TRAP)
    commands = graph.listen(TwistMessage, "cmd_vel")
    graph.start("fake_robot", "--ros-args", "--params-file", file)
    drive = navigator(graph, file)
    graph.until(lambda: "stuck at" in drive.words, "complaint", patience=30.0)
    for word in ("phi =", "|grad phi| =", "gradnav check", "influence_distance"):
        assert word in drive.words
    graph.spin(0.5)
    del commands[:]
    graph.until(lambda: len(commands) > 20, "commands")
    assert all(c.linear.x == 0.0 and c.angular.z == 0.0 for c in commands)
    send_goal(graph, 2.3, 0.3, "map")
    graph.until(lambda: "arrived" in drive.words, "arrival at another goal")
    assert drive.words.count("stuck at") == 1


def test_a_goal_with_an_orientation_is_reached_with_it(graph, parameter_file):
    robot = Robot(graph, 0.0, 0.0, 0.0)
    drive = navigator(graph, parameter_file("goal: [0.4, 0.1, 1.5]\nxy_goal_tolerance: 0.02"))
    graph.until(lambda: "arrived" in drive.words, "arrival", patience=30.0)
    assert robot.distance(0.4, 0.1) <= 0.03
    assert abs(float(robot.plant.pose.theta) - 1.5) <= 0.06

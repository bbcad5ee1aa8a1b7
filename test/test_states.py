# SPDX-License-Identifier: Apache-2.0
"""States, services, waypoints and health of the navigator: a real process over real DDS."""

import math

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from remote import Remote
from robot import Robot
from std_msgs.msg import String

FAR_GOAL = "goal: [3, 0.5]\ninitial_pose: [0, 0, 0.5]"


def navigator(graph, file, *more):
    return graph.start("navigator", "--ros-args", "--params-file", file, *more)


def stamped(x, y, frame, yaw=None):
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = float(x), float(y)
    message.pose.orientation.w = 0.0 if yaw is None else math.cos(yaw / 2.0)
    message.pose.orientation.z = 0.0 if yaw is None else math.sin(yaw / 2.0)
    return message


def path(points, frame):
    message = Path(poses=[stamped(x, y, frame) for x, y in points])
    message.header.frame_id = frame
    return message


def publisher(graph, kind, topic):
    found = graph.node.create_publisher(kind, topic, 10)
    graph.until(lambda: found.get_subscription_count() == 1, "navigator")
    return found


def test_a_drive_to_a_goal_with_an_orientation_announces_each_state(graph, parameter_file):
    """An obstacle leaves no room for the pose law, so the robot turns at the goal."""
    remote = Remote(graph)
    text = "goal: [0.3, 0, 1.5]\nobstacles: {names: [a], a: {x: 0.3, y: 0.5, radius: 0.2}}"
    navigator(graph, parameter_file(text))
    remote.until("no odometry")
    robot = Robot(graph, 0.0, 0.0, 0.0)
    remote.until("arrived")
    robot.silent = True
    graph.until(lambda: remote.state == "no odometry", "loss")
    robot.silent = False
    graph.until(lambda: remote.state == "arrived", "recovery")
    drive = ["no odometry", "driving", "turning", "arrived"]
    assert remote.states == [*drive, "no odometry", "arrived"]


def test_pause_resume_and_cancel(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    navigator(graph, parameter_file("initial_pose: [0, 0, 0]"))
    remote.until("idle")
    for name in ("resume", "cancel"):
        success, reason = remote.trigger(name)
        assert not success
        assert reason

    goals = publisher(graph, PoseStamped, "goal_pose")
    assert remote.trigger("pause") == (True, "paused")
    goals.publish(stamped(1.0, 0.0, "map"))
    graph.until(lambda: len(robot.commands) > 10, "commands")
    assert not any(v or omega for _, v, omega in robot.commands)
    assert remote.trigger("resume") == (True, "driving")
    graph.until(lambda: robot.moving, "motion")
    assert remote.trigger("pause") == (True, "paused")
    graph.until(lambda: robot.stopped, "stop")
    assert remote.trigger("pause") == (False, "paused already")
    goals.publish(stamped(0.0, 1.0, "map"))  # which is for after the pause
    graph.until(lambda: remote.get("goal") == [0.0, 1.0], "new goal")
    commands = len(robot.commands)
    graph.until(lambda: len(robot.commands) > commands + 10, "commands")
    assert all(v == omega == 0.0 for _, v, omega in robot.commands[commands:])

    assert remote.trigger("resume") == (True, "driving")
    graph.until(lambda: robot.moving, "motion")
    assert remote.trigger("cancel") == (True, "idle")
    graph.until(lambda: robot.stopped, "stop")
    commands = len(robot.commands)
    graph.spin(0.5)
    assert len(robot.commands) == commands
    assert remote.states[-6:] == ["idle", *["paused", "driving"] * 2, "idle"]
    assert list(remote.get("goal")) == []


class Trail:
    """Where a robot has been."""

    def __init__(self, graph, robot):
        self._robot, self._points = robot, []
        graph.node.create_timer(0.02, self._note)

    def _note(self):
        self._points.append((float(self._robot.plant.pose.x), float(self._robot.plant.pose.y)))

    def first_near(self, point, tolerance):
        """Return when it was first near a point, as a count; None for never."""
        near = (i for i, p in enumerate(self._points) if math.dist(p, point) <= tolerance)
        return next(near, None)


def test_waypoints_of_the_parameters_are_passed_in_order_without_a_stop(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    trail = Trail(graph, robot)
    text = "goal: [0.6, 0.6]\nwaypoints: [0.5, 0, 0.9, 0.3]\nwaypoint_tolerance: 0.1"
    drive = navigator(graph, parameter_file(text))
    remote.until("arrived", patience=30.0)
    passed = [trail.first_near(p, 0.12) for p in [(0.5, 0.0), (0.9, 0.3), (0.6, 0.6)]]
    assert None not in passed
    assert passed == sorted(passed)
    words = drive.words
    assert words.index("passed waypoint 1 of 2") < words.index("passed waypoint 2 of 2")
    moving = [abs(v) + abs(omega) > 0.0 for _, v, omega in robot.commands]
    assert all(moving[moving.index(True) : -3])
    assert robot.distance(0.6, 0.6) <= 0.05


def test_a_path_replaces_goal_and_waypoints_or_is_refused_as_a_whole(graph, parameter_file):
    """The robot starts at (1, 1) facing +y, so the point (0.3, 0) of odom is (1, 1.3) of map."""
    robot, remote = Robot(graph, 1.0, 1.0, math.pi / 2), Remote(graph)
    text = "initial_pose: [1, 1, 1.5707963]\nobstacles: {names: [a], a: {x: 1, y: 3, radius: 0.3}}"
    drive = navigator(graph, parameter_file(text))
    remote.until("idle")
    paths = publisher(graph, Path, "waypoints")
    mixed = path([(0.0, 0.0), (1.0, 1.0)], "map")
    mixed.poses[1].header.frame_id = "odom"
    refused = {
        "obstacles.a": path([(1.0, 3.1), (1.0, 1.3)], "map"),
        "without poses": path([], "map"),
        "frame of the path": mixed,
        "at most 100": path([(1.0, 1.0)] * 102, "map"),
        "frame moon": path([(1.0, 1.3)], "moon"),
    }
    status = graph.listen(String, "status")
    for complaint, message in refused.items():
        paths.publish(message)
        graph.until(lambda complaint=complaint: complaint in drive.words, complaint)
    assert "driving" not in remote.states
    graph.until(lambda: status and "; goal refused: frame moon" in status[-1].data, "status")
    paths.publish(path([(0.3, 0.0), (0.3, 0.3)], "odom"))
    remote.until("arrived")
    graph.until(lambda: "refused" not in status[-1].data, "status without it")
    assert list(remote.get("waypoints")) == pytest.approx([1.0, 1.3])
    assert list(remote.get("goal")) == pytest.approx([0.7, 1.3])
    assert robot.distance(0.7, 1.3) <= 0.05


def test_status_and_diagnostics_tell_what_is_true(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.5), Remote(graph)
    status = graph.listen(String, "status")
    diagnostics = graph.listen(DiagnosticArray, "/diagnostics")
    text = FAR_GOAL + "\nobstacles: {names: [a], a: {x: 2, y: -1, radius: 0.2}}"
    navigator(graph, parameter_file(text))
    remote.until("driving")
    del status[:], diagnostics[:]
    graph.until(lambda: len(diagnostics) >= 2 and len(status) >= 2, "report")
    (found,) = diagnostics[-1].status
    values = {pair.key: pair.value for pair in found.values}
    assert found.level == DiagnosticStatus.OK
    assert (found.name, found.message, values["state"]) == ("navigator: drive", *["driving"] * 2)
    assert float(values["odometry rate [Hz]"]) == pytest.approx(20.0, abs=4.0)
    assert 0.0 < float(values["latency [ms]"]) < 50.0
    assert float(values["odometry age [s]"]) < 0.3
    pose = robot.plant.pose
    to_go, clear = math.dist((3, 0.5), pose[:2]), math.dist((2, -1), pose[:2]) - 0.305
    assert float(values["distance to goal [m]"]) == pytest.approx(to_go, abs=0.1)
    assert float(values["clearance [m]"]) == pytest.approx(clear, abs=0.1)
    assert status[-1].data.startswith("driving at (")
    assert "m to the goal" in status[-1].data
    assert "m clear" in status[-1].data

    robot.silent = True
    remote.until("no odometry")
    del diagnostics[:]
    graph.until(lambda: diagnostics, "report")
    (found,) = diagnostics[-1].status
    assert found.level == DiagnosticStatus.STALE
    assert float({p.key: p.value for p in found.values}["odometry age [s]"]) > 0.4


def test_a_robot_without_its_lidar_is_said_to_wait(graph, parameter_file):
    Robot(graph, 0.0, 0.0, 0.5)
    remote = Remote(graph)
    navigator(graph, parameter_file(FAR_GOAL + "\npotential: scan"))
    remote.until("waiting")
    assert remote.set_one("potential", "quadratic") == ""
    remote.until("driving")

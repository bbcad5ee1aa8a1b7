# SPDX-License-Identifier: Apache-2.0
"""Goals in frames of others, and the world's frame for others."""

import math

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from geometry_msgs.msg import PoseStamped, Transform
from rclpy.qos import DurabilityPolicy, QoSProfile
from remote import Remote
from robot import Robot

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.odometry import GoalPose
from tbot_gradnav.transforms import moved
from tbot_gradnav.unicycle import Pose, heading

# tf2_ros is not to be had from PyPI. This knows one transform, and that after a few looks only.
STAND_IN = """
from geometry_msgs.msg import TransformStamped

class TransformException(Exception):
    pass

class Buffer:
    looks = 0

    def lookup_transform(self, target, source, time):
        self.looks += 1
        if (target, source) != ("odom", "dock") or self.looks < 5:
            raise TransformException(f"{source} does not exist")
        found = TransformStamped()
        found.transform.translation.x = 0.5
        found.transform.rotation.z = found.transform.rotation.w = 0.5 ** 0.5
        return found

class TransformListener:
    def __init__(self, buffer, node):
        pass

    def unregister(self):
        pass
"""


def goal_in(frame, x, y):
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.w = 0.0  # no orientation
    return message


@pytest.fixture
def idle_with_tf(graph, parameter_file, tmp_path, monkeypatch):
    """Give a robot, its user, an idle navigator that has a tf2_ros, and a publisher of goals."""
    (tmp_path / "tf2_ros.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    file = parameter_file("initial_pose: [0, 0, 0]")
    drive = graph.start("navigator", "--ros-args", "--params-file", file)
    remote.until("idle")
    goals = graph.node.create_publisher(PoseStamped, "goal_pose", 10)
    graph.until(lambda: goals.get_subscription_count() == 1, "navigator")
    return robot, remote, drive, goals


def test_a_goal_in_a_frame_of_tf_waits_for_it_and_is_driven_to(graph, idle_with_tf):
    robot, remote, drive, goals = idle_with_tf
    goals.publish(goal_in("moon", 1.0, 0.0))
    graph.until(lambda: "goal refused: moon does not exist" in drive.words, "refusal")
    goals.publish(goal_in("moon", 1.0, 0.0))
    goals.publish(goal_in("dock", 0.2, 0.1))  # which takes the place of the one that waits
    remote.until("arrived")
    assert list(remote.get("goal")) == pytest.approx([0.4, 0.2])
    assert robot.distance(0.4, 0.2) <= 0.05
    assert drive.words.count("goal refused") == 1


def test_a_goal_that_waits_for_its_frame_can_be_cancelled(graph, idle_with_tf):
    robot, remote, drive, goals = idle_with_tf
    goals.publish(goal_in("moon", 1.0, 0.0))
    # Goal and service have no common order: a cancel too early says that there is nothing to.
    graph.until(lambda: remote.trigger("cancel")[0], "cancelled")
    graph.spin(3.5)  # longer than it would have waited
    assert "goal refused" not in drive.words
    assert robot.commands == []


def test_a_goal_in_a_frame_that_is_upside_down_is_refused():
    over = Transform()
    over.rotation.x, over.rotation.w = 1.0, 0.0
    with pytest.raises(GradnavError, match="frame ceiling is upside down"):
        moved(GoalPose("ceiling", 1.0, 0.5, 0.0, 0.0), over, "odom")


@pytest.mark.parametrize("yaw", [None, 0.0, 2.5, -1.0])
def test_a_goal_moves_with_its_frame(yaw):
    turn, frame = 0.7, Transform()
    frame.translation.x, frame.translation.y = 3.0, -2.0
    frame.rotation.z, frame.rotation.w = math.sin(turn / 2.0), math.cos(turn / 2.0)
    q_z, q_w = (0.0, 0.0) if yaw is None else (math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    found = moved(GoalPose("dock", 1.0, 0.5, q_z, q_w), frame, "odom")
    truth = Pose.at(3.0, -2.0, turn).compose(Pose.at(1.0, 0.5, yaw or 0.0))
    assert (found.frame, found.x, found.y) == ("odom", *map(pytest.approx, truth[:2]))
    if yaw is None:
        assert (found.q_z, found.q_w) == (0.0, 0.0)
    else:
        assert heading(found.q_z, found.q_w) == pytest.approx(truth[2:])


def test_the_world_frame_is_published_where_tf2_msgs_is_installed(graph, parameter_file):
    tf2_msgs = pytest.importorskip("tf2_msgs.msg", reason="needs tf2_msgs")
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    Robot(graph, 1.0, 2.0, 0.5)
    heard = graph.listen(tf2_msgs.TFMessage, "/tf_static", latched)
    file = parameter_file("initial_pose: [1, 2, 0.5]\npublish_tf: true")
    graph.start("navigator", "--ros-args", "--params-file", file)
    graph.until(lambda: heard, "transform")
    (found,) = heard[0].transforms
    assert (found.header.frame_id, found.child_frame_id) == ("map", "odom")
    place, q = found.transform.translation, found.transform.rotation
    assert (place.x, place.y) == pytest.approx((1.0, 2.0))
    assert heading(q.z, q.w) == pytest.approx((math.cos(0.5), math.sin(0.5)))


def test_without_tf2_msgs_it_says_that_there_is_no_tf(graph, parameter_file):
    try:
        import tf2_msgs  # noqa: F401
    except ImportError:
        file = parameter_file("publish_tf: true")
        drive = graph.start("navigator", "--ros-args", "--params-file", file)
        graph.until(lambda: "tf2_msgs is not installed" in drive.words, "word")
    else:
        pytest.skip("tf2_msgs is installed")

# SPDX-License-Identifier: Apache-2.0
"""The node that watches a demo: it records what passes and knows where the robot truly is."""

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped, Quaternion, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.odometry import Odometry, Reading
from tbot_gradnav.options import Configuration
from tbot_gradnav.recording import Recorder
from tbot_gradnav.unicycle import STOP, Pose, Twist, heading, quaternion

KINDS = {
    OdometryMessage: "nav_msgs/msg/Odometry",
    PoseStamped: "geometry_msgs/msg/PoseStamped",
    TwistMessage: "geometry_msgs/msg/Twist",
    TwistStamped: "geometry_msgs/msg/TwistStamped",
    LaserScan: "sensor_msgs/msg/LaserScan",
}


STANDING = 20.0  # [s] of its own time


class _Heard(NamedTuple):
    """A message: when it was said by the speaker's clock, and its own stamp, 0 for none [ns]."""

    said: int
    topic: str
    kind: Any
    stamp: int
    cdr: bytes


class Observer(Node):
    """Follows a robot by odom, cmd_vel and ground_truth, and keeps what was said."""

    def __init__(self, configuration: Configuration) -> None:
        super().__init__("gradnav_demo", use_global_arguments=False)
        self._settings = configuration.settings
        self._heard: list[_Heard] = []
        self._odometry = Odometry(self._settings.start, self._settings.limits)
        self._stamp = 0  # [ns] of the last message that had one
        self._began: int | None = None  # [ns] the first stamp
        self._moved: int | None = None  # [ns] the first stamp with another pose
        self._driven = 0.0  # [s] when it was last told to drive
        self.twist: Twist | None = None
        self.believed: Pose | None = None  # by odometry, in the world
        self.path: list[Pose] = []  # where it truly was
        self.times: list[float] = []  # [s] and when, since the first odometry
        stamped = configuration.navigator.cmd_vel_type == "twist_stamped"
        self._listen("odom", OdometryMessage, self._on_odometry)
        self._listen("ground_truth", PoseStamped, self._on_truth)
        if self._settings.chosen_potential.looks:
            self._listen(
                "scan", LaserScan, lambda scan: _ns(scan.header.stamp), qos_profile_sensor_data
            )
        self._listen("cmd_vel", TwistStamped if stamped else TwistMessage, self._on_command)

    @property
    def seconds(self) -> float:
        """Time [s] since the robot first moved; before that, since the first odometry."""
        since = self._began if self._moved is None else self._moved
        return 0.0 if since is None else (self._stamp - since) * 1e-9

    @property
    def clearance(self) -> float:
        """Clearance [m] of the robot now; inf in an empty world."""
        pose = self.path[-1]
        return float(self._settings.world.clearance(pose.x, pose.y))

    @property
    def distance(self) -> float:
        """Distance [m] to the goal now, truly."""
        pose, goal = self.path[-1], self._settings.goal
        return float(np.hypot(pose.x - goal[0], pose.y - goal[1]))

    @property
    def collided(self) -> bool:
        """Whether the robot touches something now."""
        return bool(self.path) and self.clearance < 0.0

    @property
    def arrived(self) -> bool:
        """Whether the robot stands, and by its odometry at the goal."""
        if self.believed is None or self.twist != STOP:
            return False
        goal, tolerance = self._settings.goal, self._settings.xy_goal_tolerance
        distance = np.hypot(self.believed.x - goal[0], self.believed.y - goal[1])
        return bool(distance <= tolerance)

    @property
    def done(self) -> bool:
        """Whether the robot has arrived, collided or come to a stand."""
        return self.arrived or self.collided or self.stands

    @property
    def stands(self) -> bool:
        """Whether the robot has been told to stand for a while."""
        return self.seconds - self._driven > STANDING

    def refuse_company(self) -> None:
        """Raise GradnavError if another robot or another driver is on this ROS domain."""
        for topic in ("odom", "cmd_vel"):
            if self.count_publishers(topic) > 1:
                domain = os.environ.get("ROS_DOMAIN_ID", "0")
                raise GradnavError(
                    f"somebody else publishes /{topic} on ROS_DOMAIN_ID {domain}; set another"
                )

    def record(self, recorder: Recorder, parameters: str) -> None:
        """Write the goal, the parameter file's text and all that was heard.

        In the order in which it was said, not heard, and at the robot's time, not ours.
        """
        now = self._began or 0
        goal = PoseStamped()
        goal.pose.position.x, goal.pose.position.y = self._settings.goal[:2]
        goal.pose.orientation = _orientation(self._settings.goal)
        recorder.write_text("/parameters", now, parameters)
        recorder.write("/goal_pose", KINDS[PoseStamped], now, serialize_message(goal))
        for heard in sorted(self._heard, key=lambda heard: heard.said):
            now = max(now, heard.stamp)
            recorder.write(heard.topic, KINDS[heard.kind], now, heard.cdr)

    def _listen(self, topic: str, kind: Any, callback: Any, qos: QoSProfile | int = 100) -> None:
        """Subscribe; every message is kept as it came, then handed to `callback`."""

        def on_message(cdr: bytes, info: dict[str, int]) -> None:
            stamp = callback(deserialize_message(cdr, kind))
            self._heard.append(_Heard(info["source_timestamp"], f"/{topic}", kind, stamp, cdr))

        self.create_subscription(kind, topic, on_message, qos, raw=True)

    def _on_odometry(self, message: OdometryMessage) -> int:
        stamp = self._see(message.header.stamp)
        self.believed, _ = self._odometry.update(Reading.of(message))
        return stamp

    def _on_truth(self, message: PoseStamped) -> int:
        stamp = self._see(message.header.stamp)
        self.times.append((stamp - (self._began or stamp)) * 1e-9)
        position, q = message.pose.position, message.pose.orientation
        self.path.append(Pose(position.x, position.y, *heading(q.z, q.w)))
        if self._moved is None and self.path[-1] != self.path[0]:
            self._moved = stamp
        return stamp

    def _on_command(self, message: Any) -> int:
        twist = message.twist if isinstance(message, TwistStamped) else message
        self.twist = Twist(twist.linear.x, twist.angular.z)
        if self.twist != STOP:
            self._driven = self.seconds
        return 0  # a Twist has no stamp

    def _see(self, stamp: Any) -> int:
        self._stamp = _ns(stamp)
        if self._began is None:
            self._began = self._stamp
        return self._stamp


def _stamp_of(message: Any) -> int:
    return _ns(message.header.stamp)


def _ns(stamp: Any) -> int:
    return int(stamp.sec * 10**9 + stamp.nanosec)


def _orientation(goal: Sequence[float]) -> Quaternion:
    """Return the orientation of a goal; zeros where it asks for none."""
    q_z, q_w = quaternion(goal[2]) if len(goal) == 3 else (0.0, 0.0)
    return Quaternion(z=q_z, w=q_w)

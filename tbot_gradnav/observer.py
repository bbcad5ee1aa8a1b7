# SPDX-License-Identifier: Apache-2.0
"""The node that watches a demo: it records what passes and knows where the robot truly is."""

from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from tbot_gradnav.navigator import reading
from tbot_gradnav.odometry import Odometry
from tbot_gradnav.options import Configuration
from tbot_gradnav.recording import Recorder
from tbot_gradnav.unicycle import STOP, Pose, Twist, heading

KINDS = {
    OdometryMessage: "nav_msgs/msg/Odometry",
    PoseStamped: "geometry_msgs/msg/PoseStamped",
    TwistMessage: "geometry_msgs/msg/Twist",
    TwistStamped: "geometry_msgs/msg/TwistStamped",
}


class Observer(Node):
    """Follows a robot by odom, cmd_vel and ground_truth and records all three."""

    def __init__(self, configuration: Configuration, recorder: Recorder) -> None:
        super().__init__("gradnav_demo", use_global_arguments=False)
        self._settings = configuration.settings
        self._recorder = recorder
        self._odometry = Odometry(self._settings.start, self._settings.limits)
        self._stamp = 0  # [ns] of the last message that had one
        self._began: int | None = None
        self.twist: Twist | None = None
        self.believed: Pose | None = None  # by odometry, in the world
        self.path: list[Pose] = []  # where it truly was
        stamped = configuration.navigator.cmd_vel_type == "twist_stamped"
        self._listen("odom", OdometryMessage, self._on_odometry)
        self._listen("ground_truth", PoseStamped, self._on_truth)
        self._listen("cmd_vel", TwistStamped if stamped else TwistMessage, self._on_command)

    @property
    def seconds(self) -> float:
        """Time [s] since the first odometry, by its stamps."""
        return 0.0 if self._began is None else (self._stamp - self._began) * 1e-9

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

    def _listen(self, topic: str, kind: Any, callback: Any) -> None:
        """Subscribe; every message is recorded as it came, then handed to `callback`."""

        def on_message(data: bytes) -> None:
            callback(deserialize_message(data, kind))
            self._recorder.write(f"/{topic}", KINDS[kind], self._stamp, data)

        self.create_subscription(kind, topic, on_message, 100, raw=True)

    def _on_odometry(self, message: OdometryMessage) -> None:
        self._see(message.header.stamp)
        self.believed, _ = self._odometry.update(reading(message))

    def _on_truth(self, message: PoseStamped) -> None:
        self._see(message.header.stamp)
        position, q = message.pose.position, message.pose.orientation
        self.path.append(Pose(position.x, position.y, *heading(q.z, q.w)))

    def _on_command(self, message: Any) -> None:
        twist = message.twist if isinstance(message, TwistStamped) else message
        self.twist = Twist(twist.linear.x, twist.angular.z)

    def _see(self, stamp: Any) -> None:
        self._stamp = stamp.sec * 10**9 + stamp.nanosec
        if self._began is None:
            self._began = self._stamp

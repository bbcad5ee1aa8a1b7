# SPDX-License-Identifier: Apache-2.0
"""The node that watches a demo: it starts the drive, records it and knows where the robot is."""

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped, Quaternion, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry as OdometryMessage
from nav_msgs.msg import Path
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from std_srvs.srv import Trigger

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.navigation import State
from tbot_gradnav.options import Configuration
from tbot_gradnav.recording import Recorder
from tbot_gradnav.ros import LATCHED
from tbot_gradnav.unicycle import STOP, Pose, Twist, heading, quaternion

KINDS = {
    OdometryMessage: "nav_msgs/msg/Odometry",
    PoseStamped: "geometry_msgs/msg/PoseStamped",
    TwistMessage: "geometry_msgs/msg/Twist",
    TwistStamped: "geometry_msgs/msg/TwistStamped",
    LaserScan: "sensor_msgs/msg/LaserScan",
    Path: "nav_msgs/msg/Path",
    String: "std_msgs/msg/String",
}


class _Heard(NamedTuple):
    """A message: when it was said by the speaker's clock, and its own stamp, 0 for none [ns]."""

    said: int
    topic: str
    kind: Any
    stamp: int
    cdr: bytes


class Observer(Node):
    """Follows a robot by odom, cmd_vel and ground_truth, and keeps what was said.

    `hold` the navigator before odometry comes and let it go once `hears_all`, and nothing of the
    drive is missed, however long discovery takes.
    """

    def __init__(self, configuration: Configuration) -> None:
        super().__init__("gradnav_demo", use_global_arguments=False)
        self._settings = configuration.settings
        self._heard: list[_Heard] = []
        self._stamp = 0  # [ns] of the last ground truth
        self._began: int | None = None  # [ns] when it was let go
        self._state = ""  # of the navigator
        self._odometry = False  # whether any has come
        self.twist: Twist | None = None  # in answer to odometry
        self.path: list[Pose] = []  # where it truly was
        self.times: list[float] = []  # [s] and when, since it was let go
        self._world_frame = configuration.navigator.world_frame
        stamped = configuration.navigator.cmd_vel_type == "twist_stamped"
        self._listen("odom", OdometryMessage, self._on_odometry)
        self._listen("ground_truth", PoseStamped, self._on_truth)
        if self._settings.chosen_potential.looks:
            self._listen(
                "scan", LaserScan, lambda scan: _ns(scan.header.stamp), qos_profile_sensor_data
            )
        self._listen("cmd_vel", TwistStamped if stamped else TwistMessage, self._on_command)
        self._listen("state", String, self._on_state, LATCHED)
        self._switches: dict[str, Client] = {
            name: self.create_client(Trigger, name) for name in ("pause", "resume")
        }
        self._answers: dict[str, Future] = {}

    def hold(self) -> bool:
        """Pause the navigator as soon as it can be asked; return whether it has agreed.

        Raises GradnavError where it refuses.
        """
        return self._agreed("pause")

    @property
    def hears_all(self) -> bool:
        """Whether odometry, the truth, and the navigator's state and commands arrive here."""
        return self._odometry and self.twist is not None and bool(self._state and self.path)

    def let_go(self) -> bool:
        """Resume, and count time and path from then on; return whether the navigator has agreed.

        Raises GradnavError where it refuses.
        """
        if not self._agreed("resume"):
            return False
        self._began, self.path, self.times = self._stamp, self.path[-1:], [0.0]
        return True

    @property
    def under_way(self) -> bool:
        """Whether the robot has been let go."""
        return self._began is not None

    @property
    def seconds(self) -> float:
        """Time [s] of the robot's clock since it was let go."""
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
        """Whether the robot has stopped at the goal."""
        return self._state == State.ARRIVED.value and self.twist == STOP

    @property
    def done(self) -> bool:
        """Whether the robot has arrived or collided, or will not arrive."""
        given_up = self._state in (State.STUCK.value, State.IDLE.value)
        return self.arrived or self.collided or given_up

    def refuse_company(self) -> None:
        """Raise GradnavError if another robot or another driver is on this ROS domain."""
        for topic in ("odom", "cmd_vel"):
            if self.count_publishers(topic) > 1:
                domain = os.environ.get("ROS_DOMAIN_ID", "0")
                raise GradnavError(
                    f"somebody else publishes /{topic} on ROS_DOMAIN_ID {domain}; set another"
                )

    def record(self, recorder: Recorder, parameters: str) -> None:
        """Write the parameter file's text, where it leads to, and all that was heard.

        In the order in which it was said, not heard, and at the robot's time, not ours.
        """
        now = min(heard.stamp for heard in self._heard if heard.stamp)
        recorder.write_text("/parameters", now, parameters)
        route = self._route()
        topic = "/goal_pose" if isinstance(route, PoseStamped) else "/waypoints"
        recorder.write(topic, KINDS[type(route)], now, serialize_message(route))
        for heard in sorted(self._heard, key=lambda heard: heard.said):
            now = max(now, heard.stamp)
            recorder.write(heard.topic, KINDS[heard.kind], now, heard.cdr)

    def _route(self) -> PoseStamped | Path:
        """Return the goal, or the waypoints with the goal as the last."""
        poses = [PoseStamped() for _ in self._settings.legs]
        for pose, leg in zip(poses, self._settings.legs, strict=True):
            pose.header.frame_id = self._world_frame
            pose.pose.position.x, pose.pose.position.y = leg.goal[:2]
            pose.pose.orientation = _orientation(leg.goal)
        path = Path(poses=poses)
        path.header.frame_id = self._world_frame
        return path if len(poses) > 1 else poses[0]

    def _agreed(self, service: str) -> bool:
        """Ask a service once, when it is there; return whether it has answered."""
        client = self._switches[service]
        if service not in self._answers and client.service_is_ready():
            self._answers[service] = client.call_async(Trigger.Request())
        answer = self._answers.get(service)
        if answer is None or not answer.done():
            return False
        if not answer.result().success:
            raise GradnavError(f"the navigator refuses to {service}: {answer.result().message}")
        return True

    def _listen(self, topic: str, kind: Any, callback: Any, qos: QoSProfile | int = 100) -> None:
        """Subscribe; every message is kept as it came, then handed to `callback`."""

        def on_message(cdr: bytes, info: dict[str, int]) -> None:
            stamp = callback(deserialize_message(cdr, kind))
            self._heard.append(_Heard(info["source_timestamp"], f"/{topic}", kind, stamp, cdr))

        self.create_subscription(kind, topic, on_message, qos, raw=True)

    def _on_odometry(self, message: OdometryMessage) -> int:
        if not self._odometry:
            self.twist = None  # which was the stop of a pause
        self._odometry = True
        return _ns(message.header.stamp)

    def _on_truth(self, message: PoseStamped) -> int:
        self._stamp = _ns(message.header.stamp)
        self.times.append(self.seconds)
        position, q = message.pose.position, message.pose.orientation
        self.path.append(Pose(position.x, position.y, *heading(q.z, q.w)))
        return self._stamp

    def _on_state(self, message: String) -> int:
        self._state = message.data
        return 0

    def _on_command(self, message: Any) -> int:
        twist = message.twist if isinstance(message, TwistStamped) else message
        self.twist = Twist(twist.linear.x, twist.angular.z)
        return 0  # a Twist has no stamp


def _ns(stamp: Any) -> int:
    return int(stamp.sec * 10**9 + stamp.nanosec)


def _orientation(goal: Sequence[float]) -> Quaternion:
    """Return the orientation of a goal; zeros where it asks for none."""
    q_z, q_w = quaternion(goal[2]) if len(goal) == 3 else (0.0, 0.0)
    return Quaternion(z=q_z, w=q_w)

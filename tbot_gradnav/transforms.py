# SPDX-License-Identifier: Apache-2.0
"""Frames of others: goals given in them, and the world's own for others to see."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.time import Time

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.odometry import GoalPose, Odometry
from tbot_gradnav.ros import LATCHED
from tbot_gradnav.unicycle import Pose, has_heading, heading, quaternion

try:
    from tf2_ros import Buffer, TransformException, TransformListener
except ImportError:  # not to be had from PyPI; without it other frames are refused
    Buffer = None
try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # likewise
    TFMessage = None

CAN_LOOK_UP = Buffer is not None
LOOK_PERIOD = 0.1  # [s]
PATIENCE = 3.0  # [s] for a transform to come


class Lookup:
    """Waits for the transform of a frame into a target frame, then calls `found` or `missed`.

    It listens to tf only as long as it waits: to take in every transform of a robot would cost
    more than to control it. Needs tf2_ros.
    """

    def __init__(
        self,
        node: Node,
        target: str,
        source: str,
        found: Callable[[Any], None],
        missed: Callable[[str], None],
    ) -> None:
        self._node, self._target, self._source = node, target, source
        self._found, self._missed = found, missed
        self._looks = round(PATIENCE / LOOK_PERIOD)
        self._buffer = Buffer()
        self._listener = TransformListener(self._buffer, node)
        self._timer = node.create_timer(
            LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def end(self) -> None:
        """Wait no longer."""
        self._timer.cancel()
        self._node.destroy_timer(self._timer)
        self._listener.unregister()

    def _look(self) -> None:
        self._looks -= 1
        try:
            newest = self._buffer.lookup_transform(self._target, self._source, Time())
        except TransformException as error:
            if self._looks <= 0:
                self.end()
                self._missed(str(error))
            return
        self.end()
        self._found(newest.transform)


def moved(goal: GoalPose, transform: Any, target: str) -> GoalPose:
    """Return a goal as seen from the target frame of a geometry_msgs/Transform.

    Raises GradnavError for a frame that is upside down, which has no yaw.
    """
    q, shift = transform.rotation, transform.translation
    if not has_heading(q.z, q.w):
        raise GradnavError(f"frame {goal.frame} is upside down in {target}")
    place = Pose(shift.x, shift.y, *heading(q.z, q.w)).compose(Pose(goal.x, goal.y, 1.0, 0.0))
    return GoalPose(
        target,
        float(place.x),
        float(place.y),
        q.z * goal.q_w + q.w * goal.q_z,
        q.w * goal.q_w - q.z * goal.q_z,
    )


class WorldTransform:
    """Publishes where the odometry frame is in the world frame, on /tf_static.

    It moves only when the odometry is reset, and listeners take the newest. Needs tf2_msgs.
    """

    def __init__(self, node: Node, odometry: Odometry) -> None:
        self._node, self._odometry = node, odometry
        self._published: Pose | None = None
        self._publisher = TFMessage and node.create_publisher(TFMessage, "/tf_static", LATCHED)
        if not self._publisher:
            node.get_logger().warning("publish_tf: tf2_msgs is not installed, so there is no tf")

    def update(self) -> None:
        """Publish it if it is new."""
        frame = self._odometry.frame
        if frame is None or frame is self._published or not self._publisher:
            return
        self._published = frame
        message = TransformStamped()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id, message.child_frame_id = self._odometry.frame_names
        message.transform.translation.x = float(frame.x)
        message.transform.translation.y = float(frame.y)
        q = message.transform.rotation
        q.z, q.w = quaternion(float(frame.theta))
        self._publisher.publish(TFMessage(transforms=[message]))

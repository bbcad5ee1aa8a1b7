# SPDX-License-Identifier: Apache-2.0
"""cmd_vel in the type that the robot listens to."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from tbot_gradnav.unicycle import Twist

TOPIC = "cmd_vel"
TYPES: dict[str, Any] = {"twist_stamped": TwistStamped, "twist": TwistMessage}
NAMES = {
    "geometry_msgs/msg/TwistStamped": "twist_stamped",
    "geometry_msgs/msg/Twist": "twist",
}
WATCHDOG = "cmd_vel_watchdog"  # name of the node that listens only to know when to stop the robot
LOOK_PERIOD = 0.25  # [s] between looks at who listens
PATIENCE = 12  # looks before a warning that we are not heard; discovery may take 2.5 s
REMINDER = 120  # looks between warnings
ACKNOWLEDGED = 0.2  # [s] to wait for the last command to be received


class CommandPublisher:
    """Publishes commands as Twist or TwistStamped.

    With `auto` the type follows the subscribers: a mismatch is silent in ROS 2, and the robot
    just does not move. TurtleBot3's driver takes either, as its parameter enable_stamped_cmd_vel
    says; the Gazebo bridge takes TwistStamped. `on_kind` is called with each type before it is
    published.
    """

    def __init__(
        self, node: Node, kind: str, on_kind: Callable[[str], None] = lambda kind: None
    ) -> None:
        self._node = node
        self._auto = kind == "auto"
        self._on_kind = on_kind
        self._looks_unheard = 0
        self._publish_as("twist" if self._auto else kind)
        node.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def kind(self) -> str:
        """The type published: twist or twist_stamped."""
        return self._kind

    def publish(self, twist: Twist) -> None:
        """Publish a command."""
        message = TYPES[self._kind]()
        command = message.twist if self._kind == "twist_stamped" else message
        # float(): rosidl would publish any other number type as garbage
        command.linear.x, command.angular.z = float(twist.v), float(twist.omega)
        if self._kind == "twist_stamped":
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.header.frame_id = "base_link"
        self._publisher.publish(message)

    def flush(self) -> None:
        """Wait a moment for the last command to be received."""
        self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))

    def _publish_as(self, kind: str) -> None:
        self._kind = kind
        self._on_kind(kind)
        # An executor holds on to whatever has callbacks for events, and Fast DDS does not let a
        # publisher of the other type begin before the last has gone.
        silent = PublisherEventCallbacks(use_default_callbacks=False)
        self._publisher = self._node.create_publisher(
            TYPES[kind], TOPIC, 10, event_callbacks=silent
        )

    def _look(self) -> None:
        """See who listens; follow them, or say what is wrong."""
        topic = self._publisher.topic_name
        wanted = {
            NAMES.get(info.topic_type, info.topic_type)
            for info in self._node.get_subscriptions_info_by_topic(topic)
            if info.node_name != WATCHDOG
        }
        if self._auto and self._kind not in wanted and wanted & TYPES.keys():
            self._node.destroy_publisher(self._publisher)
            self._publish_as(next(kind for kind in TYPES if kind in wanted))
        self._looks_unheard = 0 if wanted == {self._kind} else self._looks_unheard + 1
        if self._looks_unheard % REMINDER == PATIENCE:
            deaf = ", ".join(sorted(wanted - {self._kind}))
            self._node.get_logger().warning(
                f"nobody listens on {topic}: is the robot up?"
                if not wanted
                else f"commands go out on {topic} as {self._kind}, but somebody listens for {deaf} "
                "and hears nothing: see cmd_vel_type"
            )

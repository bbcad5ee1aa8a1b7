# SPDX-License-Identifier: Apache-2.0
"""cmd_vel in the type that the robot listens to."""

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
PATIENCE = 20  # looks before a warning that we are not heard; discovery may take 2.5 s
REMINDER = 120  # looks between warnings
ACKNOWLEDGED = 0.2  # [s] to wait for the last command to be received


class CommandPublisher:
    """Publishes commands as Twist or TwistStamped.

    With `auto` the type follows the subscribers: a mismatch is silent in ROS 2, and the robot
    just does not move. TurtleBot3's driver takes either, as its parameter enable_stamped_cmd_vel
    says; the Gazebo bridge takes TwistStamped.
    """

    def __init__(self, node: Node, kind: str) -> None:
        self._node = node
        self._auto = kind == "auto"
        self._looks_unheard = 0
        self._publish_as("twist" if self._auto else kind)
        node.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def kind(self) -> str:
        """The type published: twist or twist_stamped."""
        return self._kind

    def publish(self, twist: Twist) -> None:
        """Publish a command."""
        self._publisher.publish(message_of(self._kind, twist, self._node))

    def flush(self) -> None:
        """Wait a moment for the last command to be received."""
        self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))

    def _publish_as(self, kind: str) -> None:
        self._kind = kind
        # An executor holds on to whatever has callbacks for events, and Fast DDS does not let a
        # publisher of the other type begin before the last has gone.
        silent = PublisherEventCallbacks(use_default_callbacks=False)
        self._publisher = self._node.create_publisher(
            TYPES[kind], TOPIC, 10, event_callbacks=silent
        )

    def _look(self) -> None:
        """See who listens; follow them, or say what is wrong."""
        topic = self._publisher.topic_name
        wanted = listened_for(self._node)
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


def message_of(kind: str, twist: Twist, node: Node) -> Any:
    """Return a command as a message of one of TYPES, stamped by the node's clock if it has one."""
    message = TYPES[kind]()
    command = message.twist if kind == "twist_stamped" else message
    # float(): rosidl would publish any other number type as garbage
    command.linear.x, command.angular.z = float(twist.v), float(twist.omega)
    if kind == "twist_stamped":
        message.header.stamp = node.get_clock().now().to_msg()
        message.header.frame_id = "base_link"
    return message


def listened_for(node: Node) -> set[str]:
    """Return the types that robots listen for on cmd_vel, by our names where we have one."""
    infos = node.get_subscriptions_info_by_topic(node.resolve_topic_name(TOPIC))
    return {
        NAMES.get(info.topic_type, info.topic_type) for info in infos if info.node_name != WATCHDOG
    }

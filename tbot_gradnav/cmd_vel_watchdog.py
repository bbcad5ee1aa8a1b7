# SPDX-License-Identifier: Apache-2.0
"""The node that stops a robot whose commands break off; the TurtleBot3's driver drives on."""

import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.time import Time

from tbot_gradnav import ros
from tbot_gradnav.command_publisher import (
    ACKNOWLEDGED,
    LOOK_PERIOD,
    TOPIC,
    TYPES,
    WATCHDOG,
    listened_for,
    message_of,
)
from tbot_gradnav.options import WatchdogOptions
from tbot_gradnav.parameters import parameters_of
from tbot_gradnav.unicycle import STOP

CHECK_PERIOD = 0.05  # [s] between looks at the age of the last command
PARAMETERS = {*parameters_of(WatchdogOptions), "cmd_vel_type"}


class CmdVelWatchdog(Node):
    """Publishes zero velocity when the last command on cmd_vel was another and is too old.

    It listens beside the driver and does not stand between: should it fail, nothing is lost but
    the watch. It belongs on the robot, so that a lost network stops the robot too. Raises
    GradnavError for parameters that are not allowed.
    """

    def __init__(self, **node_arguments: Any) -> None:
        super().__init__(
            WATCHDOG, automatically_declare_parameters_from_overrides=True, **node_arguments
        )
        configuration = ros.declare(self, PARAMETERS)
        self._timeout = configuration.watchdog.watchdog_timeout
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._heard: Time | None = None  # when the last command came
        self._driving = False  # whether the last command was to move
        self._said = False
        self._kind: str | None = None  # None: not on the topic
        kind = configuration.navigator.cmd_vel_type
        if kind == "auto":
            self.create_timer(LOOK_PERIOD, self._look, clock=self._steady)
        else:
            self._join(kind)
        self.create_timer(CHECK_PERIOD, self._check, clock=self._steady)
        self.get_logger().info(
            f"{self.resolve_topic_name(TOPIC)} is watched: zero velocity after {self._timeout:g} s "
            "without a command"
        )

    def close(self) -> None:
        """Stop the robot: nobody watches any more."""
        if self._kind is not None:
            self._stop()
            self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
            self.get_logger().info("stopped: zero velocity published")

    def _look(self) -> None:
        """Follow the robot to the type it listens for.

        A node cannot have a topic with two types, and what it destroys is gone a moment later:
        it leaves the topic at one look and joins again at the next.
        """
        wanted = listened_for(self) & TYPES.keys()
        if self._kind is None and wanted:
            self._join(next(kind for kind in TYPES if kind in wanted))
        elif self._kind is not None and wanted and self._kind not in wanted:
            self.destroy_publisher(self._publisher)
            self.destroy_subscription(self._subscription)
            self._kind = None

    def _join(self, kind: str) -> None:
        self._kind = kind
        silent = PublisherEventCallbacks(use_default_callbacks=False)  # see CommandPublisher
        self._publisher = self.create_publisher(TYPES[kind], TOPIC, 10, event_callbacks=silent)
        self._subscription = self.create_subscription(TYPES[kind], TOPIC, self._on_command, 10)

    def _stop(self) -> None:
        if self._kind is not None:
            self._publisher.publish(message_of(self._kind, STOP, self))

    def _on_command(self, message: TwistMessage | TwistStamped) -> None:
        twist = message.twist if isinstance(message, TwistStamped) else message
        if self._heard is None:
            self.get_logger().info("commands are heard")
        self._heard = self._steady.now()
        self._driving = twist != TwistMessage()
        self._said = self._said and self._driving

    def _check(self) -> None:
        """Stop the robot for as long as our own zero velocity has not been heard either."""
        if self._heard is None:
            return
        silent = (self._steady.now() - self._heard).nanoseconds * 1e-9
        if self._driving and silent > self._timeout:
            self._stop()
            if not self._said:
                self.get_logger().error(f"stopped: no command for {self._timeout:g} s")
            self._said = True


def main(arguments: Sequence[str] = sys.argv) -> int:
    """Run the watchdog until a signal; return the exit status."""
    return ros.run(CmdVelWatchdog, CmdVelWatchdog.close, arguments)


if __name__ == "__main__":
    sys.exit(main())

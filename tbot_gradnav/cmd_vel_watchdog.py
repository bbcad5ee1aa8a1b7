# SPDX-License-Identifier: Apache-2.0
"""The node that stops a robot whose commands break off; the TurtleBot3's driver drives on."""

import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tbot_gradnav import ros
from tbot_gradnav.command_publisher import TOPIC, TYPES, WATCHDOG, CommandPublisher
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
        self._heard = self._steady.now()
        self._driving = False  # whether the last command was to move
        self._said = False
        self._subscription: Any = None
        self._commands = CommandPublisher(self, configuration.navigator.cmd_vel_type, self._listen)
        self.create_timer(CHECK_PERIOD, self._check, clock=self._steady)
        self.get_logger().info(
            f"{self.resolve_topic_name(TOPIC)} is watched: zero velocity after {self._timeout:g} s "
            "without a command"
        )

    def close(self) -> None:
        """Stop the robot: nobody watches any more."""
        self._commands.publish(STOP)
        self._commands.flush()
        self.get_logger().info("stopped: zero velocity published")

    def _listen(self, kind: str) -> None:
        """Listen for commands of one type; a node cannot have a topic with two types."""
        if self._subscription is not None:
            self.destroy_subscription(self._subscription)
        self._subscription = self.create_subscription(TYPES[kind], TOPIC, self._on_command, 10)

    def _on_command(self, message: TwistMessage | TwistStamped) -> None:
        twist = message.twist if isinstance(message, TwistStamped) else message
        self._heard = self._steady.now()
        self._driving = twist != TwistMessage()
        self._said = self._said and self._driving

    def _check(self) -> None:
        """Stop the robot for as long as our own zero velocity has not been heard either."""
        silent = (self._steady.now() - self._heard).nanoseconds * 1e-9
        if self._driving and silent > self._timeout:
            self._commands.publish(STOP)
            if not self._said:
                self.get_logger().error(f"stopped: no command for {self._timeout:g} s")
            self._said = True


def main(arguments: Sequence[str] = sys.argv) -> int:
    """Run the watchdog until a signal; return the exit status."""
    return ros.run(CmdVelWatchdog, CmdVelWatchdog.close, arguments)


if __name__ == "__main__":
    sys.exit(main())

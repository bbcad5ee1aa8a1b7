# SPDX-License-Identifier: Apache-2.0
"""The floor: a bare rclpy node, odometry in and a command out, on the navigator's executor."""

import signal
import sys
from types import FrameType

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.experimental import EventsExecutor as Executor
from rclpy.node import Node

from tbot_gradnav.ros import POLL


class Relay(Node):
    """Answers each odometry message with a command that says where the robot is."""

    def __init__(self) -> None:
        super().__init__("relay")
        self._commands = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(Odometry, "odom", self._on_odometry, 10)

    def _on_odometry(self, message: Odometry) -> None:
        command = Twist()
        command.linear.x = message.pose.pose.position.x
        command.angular.z = message.pose.pose.position.y
        self._commands.publish(command)


def main() -> None:
    """Run until SIGTERM."""

    def end(number: int, frame: FrameType | None) -> None:
        raise SystemExit

    signal.signal(signal.SIGTERM, end)
    rclpy.init(args=sys.argv, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    executor = Executor()
    executor.add_node(Relay())
    while True:
        executor.spin_once(timeout_sec=POLL)


if __name__ == "__main__":
    main()

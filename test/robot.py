# SPDX-License-Identifier: Apache-2.0
"""A robot inside a test, whose odometry the test can cut, spoil or shift."""

import time

from geometry_msgs.msg import Twist as TwistMessage
from nav_msgs.msg import Odometry

from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant
from tbot_gradnav.unicycle import Pose, Twist


class Robot:
    """The plant of the fake robot on the test's node, in real time at 20 Hz."""

    def __init__(
        self, graph, x, y, theta, namespace="/", odom="odom", cmd_vel="cmd_vel", **options
    ):
        self.plant = Plant(FakeRobotOptions(**options), Pose.at(x, y, theta))
        self.silent = False
        self.spoil = lambda message: message
        self.commands = []  # (time of arrival, v, omega)
        self._start = time.monotonic()
        self._node = graph.node
        self.publisher = graph.node.create_publisher(Odometry, namespace + odom, 10)
        graph.node.create_subscription(TwistMessage, namespace + cmd_vel, self._obey, 100)
        graph.node.create_timer(0.05, self._tick)

    @property
    def speed(self):
        """The last command's |v| + |omega|; None before the first."""
        return abs(self.commands[-1][1]) + abs(self.commands[-1][2]) if self.commands else None

    @property
    def moving(self):
        """Whether the last command moves the robot."""
        return bool(self.speed)

    @property
    def stopped(self):
        """Whether the last command is zero velocity."""
        return self.speed == 0.0

    def distance(self, x, y):
        """Return the true distance [m] from a point."""
        return ((self.plant.pose.x - x) ** 2 + (self.plant.pose.y - y) ** 2) ** 0.5

    def _obey(self, message):
        now = time.monotonic()
        self.commands.append((now, message.linear.x, message.angular.z))
        self.plant.receive(now - self._start, Twist(message.linear.x, message.angular.z))

    def _tick(self):
        self.plant.advance(time.monotonic() - self._start)
        if not self.silent:
            self.publisher.publish(self.spoil(self.message()))

    def message(self):
        """Return the odometry now."""
        reading = self.plant.read()
        message = Odometry()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id, message.child_frame_id = "odom", "base_footprint"
        message.pose.pose.position.x = reading.x
        message.pose.pose.position.y = reading.y
        message.pose.pose.orientation.z = reading.q_z
        message.pose.pose.orientation.w = reading.q_w
        return message

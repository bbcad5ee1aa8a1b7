# SPDX-License-Identifier: Apache-2.0
"""A TurtleBot3 Burger without the robot: driver, wheels and odometry of the fake robot."""

import math
from collections import deque

import numpy as np

from tbot_gradnav.odometry import Reading
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.unicycle import Pose, Twist, quaternion, step

# turtlebot3_node and OpenCR firmware 2.3.6
TOP_V = 0.2108  # [m/s] clamp of v
TOP_OMEGA = 2.635  # [rad/s] clamp of omega
TOP_WHEEL = 0.2097  # [m/s] a wheel command above the motor's limit is ignored
HALF_SEPARATION = 0.080  # [m]
WHEEL_RADIUS = 0.033  # [m]


class Plant:
    """The true pose, and the odometry that the robot believes.

    Commands take effect command_latency after they arrive, and hold until the next. As in the
    TurtleBot3's driver, odometry has its distances from the wheels and its heading from the gyro,
    so a slip spoils the distances alone.
    """

    def __init__(self, options: FakeRobotOptions, initial: Pose) -> None:
        self.pose = initial  # in the world
        self.wheels = (0.0, 0.0)  # [rad] turned by the left and the right wheel
        self._options = options
        self._rng = np.random.default_rng(options.seed)
        self._scale_v, self._scale_omega = 1.0 + options.odometry_drift * self._rng.normal(size=2)
        self._odometry = Pose.at(0.0, 0.0, 0.0)
        self._rims = (0.0, 0.0)  # [m/s] speeds of the wheels' rims
        self._pending: deque[tuple[float, Twist]] = deque()
        self._now = 0.0
        self._expiry = math.inf  # [s] when the last command loses its effect

    @property
    def twist(self) -> Twist:
        """The velocity at which the wheels would move the robot without slip."""
        left, right = self._rims
        return Twist(0.5 * (left + right), 0.5 * (right - left) / HALF_SEPARATION)

    def receive(self, now: float, twist: Twist) -> None:
        """Take a command that arrives at time `now` [s]."""
        self._pending.append((now + self._options.command_latency, twist))

    def advance(self, now: float) -> None:
        """Move on to time `now` [s]."""
        while self._pending and self._pending[0][0] <= now:
            due, twist = self._pending.popleft()
            self._expire(due)
            self._roll(max(due, self._now))
            self._drive(twist)
            self._expiry = due + (self._options.command_timeout or math.inf)
        self._expire(now)
        self._roll(now)

    def read(self) -> Reading:
        """Return the odometry now, with noise."""
        n_x, n_y, n_theta = self._rng.normal(size=3)
        options, odometry = self._options, self._odometry
        q_z, q_w = quaternion(float(odometry.theta) + options.heading_noise * n_theta)
        return Reading(
            self._now,
            float(odometry.x) + options.position_noise * n_x,
            float(odometry.y) + options.position_noise * n_y,
            0.0,
            0.0,
            q_z,
            q_w,
        )

    def reset_odometry(self) -> None:
        """Begin the odometry anew at zero."""
        self._odometry = Pose.at(0.0, 0.0, 0.0)

    def _expire(self, now: float) -> None:
        """Stop the wheels at the end of the timeout, if that is before `now` [s]."""
        if self._expiry < now:
            self._roll(max(self._expiry, self._now))
            self._rims, self._expiry = (0.0, 0.0), math.inf

    def _drive(self, twist: Twist) -> None:
        """Set the wheels' speeds as the driver would."""
        options, before = self._options, self._rims
        left, right = _rims(driven(twist) if options.driver_quirks else twist)
        self._rims = options.left_wheel * left, options.right_wheel * right
        if options.driver_quirks:
            self._rims = (
                self._rims[0] if abs(left) <= TOP_WHEEL else before[0],
                self._rims[1] if abs(right) <= TOP_WHEEL else before[1],
            )

    def _roll(self, until: float) -> None:
        dt = until - self._now
        v, omega = self.twist
        grip = 1.0 - self._options.wheel_slip
        self.pose = step(self.pose, Twist(grip * v, grip * omega), dt)
        believed = Twist(v * self._scale_v, grip * omega * self._scale_omega)
        self._odometry = step(self._odometry, believed, dt)
        left, right = (rim * dt / WHEEL_RADIUS for rim in self._rims)
        self.wheels = self.wheels[0] + left, self.wheels[1] + right
        self._now = until


def driven(twist: Twist) -> Twist:
    """Return what is left of a command behind the driver: cut to its resolution and clamped."""
    return Twist(_cut(float(twist.v), TOP_V), _cut(float(twist.omega), TOP_OMEGA))


def _rims(twist: Twist) -> tuple[float, float]:
    """Return the rim speeds [m/s] of the left and the right wheel."""
    turn = float(twist.omega) * HALF_SEPARATION
    return float(twist.v) - turn, float(twist.v) + turn


def _cut(value: float, top: float) -> float:
    hundredths = math.trunc(max(-1e6, min(1e6, value)) * 100.0)  # an int32 of 0.01 units
    return max(-top, min(top, hundredths / 100.0))

# SPDX-License-Identifier: Apache-2.0
"""How the navigator does: a line for people on status, and /diagnostics for machines."""

import math
from collections.abc import Callable
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import String

from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.unicycle import STOP, Twist

PERIOD = 1.0  # [s]
LATE = 0.02  # [s] from odometry to command; a TurtleBot3's odometry comes every 0.05 s
LEVELS = {  # where it is not OK
    State.WAITING: DiagnosticStatus.WARN,
    State.STUCK: DiagnosticStatus.ERROR,
    State.NO_ODOMETRY: DiagnosticStatus.STALE,
}


class Vitals(NamedTuple):
    """What is told of the robot: speeds, distances [m], and the last second's odometry."""

    twist: Twist
    to_go: float  # straight to the goal; nan without one
    clearance: float  # nan before the first odometry
    rate: float  # [Hz] of odometry
    latency: float  # [s] of the slowest, from odometry heard to command published
    age: float  # [s] of the last


class Health:
    """Publishes status and /diagnostics once a second; computes nothing that nobody hears.

    `age` returns for how long [s] no odometry has been heard, `refusal` why the last goal was
    refused, if it was.
    """

    def __init__(
        self,
        node: Node,
        navigation: Navigation,
        age: Callable[[], float],
        refusal: Callable[[], str],
    ) -> None:
        self._node, self._navigation, self._age, self._refusal = node, navigation, age, refusal
        self._heard = 0  # messages since the last tick
        self._slowest = 0.0  # [s]
        self._twist = STOP
        self._status = node.create_publisher(String, "status", 10)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.create_timer(PERIOD, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def note(self, twist: Twist, seconds: float) -> None:
        """Take note of a command and of how long after its odometry it was published."""
        self._heard += 1
        self._slowest = max(self._slowest, seconds)
        self._twist = twist

    def _tick(self) -> None:
        listeners = [p for p in (self._status, self._diagnostics) if p.get_subscription_count()]
        if listeners:
            vitals = self._vitals()
            if self._status in listeners:
                refused = f"; goal refused: {self._refusal()}" if self._refusal() else ""
                self._status.publish(String(data=worded(self._navigation, vitals) + refused))
            if self._diagnostics in listeners:
                self._diagnostics.publish(self._diagnosed(vitals))
        self._heard, self._slowest = 0, 0.0

    def _vitals(self) -> Vitals:
        pose, goal = self._navigation.pose, self._navigation.settings.goal
        to_go = clearance = math.nan
        if pose is not None:
            clearance = float(self._navigation.potential.room(pose.x, pose.y))
            if goal:
                to_go = math.hypot(pose.x - goal[0], pose.y - goal[1])
        lost = self._navigation.state is State.NO_ODOMETRY
        twist = STOP if lost else self._twist
        rate = self._heard / PERIOD
        return Vitals(twist, to_go, clearance, rate, self._slowest, self._age())

    def _diagnosed(self, vitals: Vitals) -> DiagnosticArray:
        state = self._navigation.state
        level = LEVELS.get(state, DiagnosticStatus.OK)
        message = state.value
        if level == DiagnosticStatus.OK and vitals.latency > LATE:
            level, message = DiagnosticStatus.WARN, f"{message}, commands are late"
        values = {
            "state": state.value,
            "odometry rate [Hz]": f"{vitals.rate:.1f}",
            "latency [ms]": f"{1e3 * vitals.latency:.2f}",
            "odometry age [s]": f"{vitals.age:.2f}",
            "distance to goal [m]": f"{vitals.to_go:.3f}",
            "clearance [m]": f"{vitals.clearance:.3f}",
            "v [m/s]": f"{vitals.twist.v:.3f}",
            "omega [rad/s]": f"{vitals.twist.omega:.3f}",
            "goal refused": self._refusal(),
        }
        status = DiagnosticStatus(
            level=level,
            name=f"{self._node.get_fully_qualified_name().lstrip('/')}: drive",
            message=message,
            hardware_id=self._node.get_namespace().strip("/"),
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        return array


def worded(navigation: Navigation, vitals: Vitals) -> str:
    """Return how the robot does in a line."""
    words, pose = [navigation.state.value], navigation.pose
    if pose is not None:
        words[0] += f" at ({pose.x:.2f}, {pose.y:.2f}) m"
        if not math.isnan(vitals.to_go):
            words.append(f"{vitals.to_go:.2f} m to the goal")
        if math.isfinite(vitals.clearance):
            words.append(f"{vitals.clearance:.2f} m clear")
        words.append(f"{vitals.twist.v:.2f} m/s")
    return ", ".join(words)

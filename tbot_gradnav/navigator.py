# SPDX-License-Identifier: Apache-2.0
"""The node that drives: odometry in, velocity out."""

import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from tbot_gradnav import ros
from tbot_gradnav.command_publisher import CommandPublisher
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.odometry import BadOdometryError, GoalPose, Notice, Reading
from tbot_gradnav.options import Configuration
from tbot_gradnav.unicycle import STOP

FIXED = ("initial_pose", "cmd_vel_type", "world_frame")  # decided when the node starts
CHECKS_PER_TIMEOUT = 10


class Navigator(Node):
    """Drives to the goal of its parameters or of goal_pose.

    Subscribes odom (nav_msgs/Odometry) and goal_pose (geometry_msgs/PoseStamped), publishes
    cmd_vel. Whatever is unusual ends in zero velocity first and a word after. Raises
    GradnavError for parameters that are not allowed.
    """

    def __init__(self, **node_arguments: Any) -> None:
        super().__init__(
            "navigator",
            automatically_declare_parameters_from_overrides=True,
            allow_undeclared_parameters=True,
            **node_arguments,
        )
        self._configuration = ros.declare(self)
        options = self._configuration.navigator
        self._navigation = Navigation(self._configuration.settings, options.world_frame)
        self._commands = CommandPublisher(self, options.cmd_vel_type)
        self._checked = self._configuration  # parameters that have passed, to be taken next
        self._heard: float | None = None  # [s] when the last good odometry came
        self._told: set[str] = set()
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._take_parameters)
        self.create_subscription(OdometryMessage, "odom", self._on_odometry, 10)
        self.create_subscription(PoseStamped, "goal_pose", self._on_goal, 10)
        self.create_timer(options.odometry_timeout / CHECKS_PER_TIMEOUT, self._check_odometry)
        self._introduce()

    def close(self) -> None:
        """Stop the robot, for good."""
        self._commands.publish(STOP)
        self._commands.flush()
        self.get_logger().info("stopped: zero velocity published")

    def _on_odometry(self, message: OdometryMessage) -> None:
        try:
            _, twist, notices = self._navigation.update(Reading.of(message))
            if twist is not None:
                self._commands.publish(twist)
        except BadOdometryError as error:
            self._stop("bad odometry", f"stopped: {error}")
            return
        except Exception as error:
            self._stop("error", f"stopped: {type(error).__name__}: {error}")
            return
        self._resume()
        for notice in notices:
            self._tell(notice)

    def _resume(self) -> None:
        """Note that good odometry came; say so after an interruption."""
        self._heard = self._seconds()
        interruptions = self._told & {"bad odometry", "error", "stale"}
        if interruptions:
            self.get_logger().info("good odometry again: going on")
            self._told -= interruptions

    def _check_odometry(self) -> None:
        timeout = self._configuration.navigator.odometry_timeout
        if self._heard is not None and self._seconds() - self._heard > timeout:
            self._heard = None
            self._stop("stale", f"stopped: no odometry for {timeout:g} s")

    def _stop(self, kind: str, text: str) -> None:
        """Publish zero velocity, then say why, once until odometry is good again."""
        self._commands.publish(STOP)
        if kind not in self._told:
            self._told.add(kind)
            self.get_logger().error(text)

    def _tell(self, notice: Notice) -> None:
        if notice.kind in self._told:
            return
        self._told.add(notice.kind)
        if notice.kind == "arrived":
            self.get_logger().info(notice.text)
        elif notice.kind == "stuck":
            self.get_logger().error(f"stopped: {notice.text}")
        else:
            self.get_logger().warning(f"{notice.text} (said once for each goal)")

    def _on_goal(self, message: PoseStamped) -> None:
        try:
            goal = self._navigation.odometry.in_world(GoalPose.of(message))
        except GradnavError as error:
            self.get_logger().error(f"goal refused: {error}")
            return
        result = self.set_parameters(
            [RosParameter("goal", RosParameter.Type.DOUBLE_ARRAY, list(goal))]
        )
        if not result[0].successful:
            self.get_logger().error(f"goal refused: {result[0].reason}")
            return
        self._navigation.restart()

    def _check_parameters(self, parameters: list[RosParameter]) -> SetParametersResult:
        try:
            self._checked = self._changed(parameters)
        except GradnavError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_parameters(self, _: list[RosParameter]) -> None:
        before, self._configuration = self._configuration.settings, self._checked
        settings = self._configuration.settings
        self._navigation.change(settings)
        if settings.goal != before.goal:
            self._told.clear()
            self.get_logger().info(f"new goal: {_worded(settings.goal)}")

    def _changed(self, parameters: list[RosParameter]) -> Configuration:
        """Return the configuration with some parameters changed. Raises GradnavError.

        That may take a moment (navigation_function.k: 0 tries several), so the robot stands.
        """
        if self._navigation.state is State.DRIVING:
            self._commands.publish(STOP)
        changes = {p.name: ros.plain(p.value) for p in parameters}
        for name in changes:
            if name in FIXED:
                raise GradnavError(f"{name}: it is decided at the start; restart the navigator")
        return Configuration.of(ros.values(self) | changes)

    def _introduce(self) -> None:
        settings = self._configuration.settings
        self.get_logger().info(
            f"law {settings.law}, potential {settings.potential}, "
            f"{len(settings.obstacles)} obstacles; "
            f"goal: {_worded(settings.goal)}"
        )
        if settings.obstacles and settings.law != "descent":
            self.get_logger().warning(
                f"law {settings.law} does not avoid obstacles; law descent does"
            )

    def _seconds(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9


def _worded(goal: Sequence[float]) -> str:
    if not goal:
        return "none, waiting for goal_pose"
    yaw = f", {goal[2]:g} rad" if len(goal) == 3 else ""
    return f"({goal[0]:g}, {goal[1]:g}) m{yaw}"


def main(arguments: Sequence[str] = sys.argv) -> int:
    """Run the navigator until a signal; return the exit status."""
    return ros.run(Navigator, Navigator.close, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Goals and waypoints that others send: brought into the world frame and made parameters."""

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.parameter import Parameter

from tbot_gradnav import transforms
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.navigation import Navigation
from tbot_gradnav.odometry import Route, route


class Goals:
    """Takes a goal from goal_pose, and waypoints with the goal as the last from waypoints.

    Either replaces the parameters `goal` and `waypoints` together and sets out anew, or is
    refused with a word and changes nothing.
    """

    def __init__(self, node: Node, navigation: Navigation) -> None:
        self._node, self._navigation = node, navigation
        self._lookup: transforms.Lookup | None = None  # for the last goal, if it waits
        node.create_subscription(PoseStamped, "goal_pose", self._on_route, 10)
        node.create_subscription(Path, "waypoints", self._on_route, 10)

    def forget(self) -> None:
        """Give up goal and waypoints. Raises GradnavError where no goal is set."""
        if not self._navigation.settings.has_goal:
            raise GradnavError("nothing to cancel: no goal is set")
        self._wait_no_more()
        self._set((), ())

    def _on_route(self, message: PoseStamped | Path) -> None:
        try:
            self._take(route(message))
        except GradnavError as error:
            self._refuse(str(error))

    def _take(self, poses: Route) -> None:
        """Set out for the last pose by way of the others, once their frame is known."""
        self._wait_no_more()
        odometry, frame = self._navigation.odometry, poses[0].frame
        if not transforms.CAN_LOOK_UP or frame in ("", *odometry.frame_names):
            self._set_out(poses)
            return
        target = odometry.frame_names[1]

        def on_found(transform: Any) -> None:
            self._lookup = None
            self._set_out([transforms.moved(pose, transform, target) for pose in poses])

        self._lookup = transforms.Lookup(self._node, target, frame, on_found, self._refuse)

    def _set_out(self, poses: Route) -> None:
        try:
            self._set(*self._navigation.odometry.in_world(poses))
        except GradnavError as error:
            self._refuse(str(error))
            return
        self._navigation.restart()

    def _set(self, goal: Sequence[float], waypoints: Sequence[float]) -> None:
        result = self._node.set_parameters_atomically(
            [
                Parameter("goal", Parameter.Type.DOUBLE_ARRAY, list(goal)),
                Parameter("waypoints", Parameter.Type.DOUBLE_ARRAY, list(waypoints)),
            ]
        )
        if not result.successful:
            raise GradnavError(result.reason)

    def _wait_no_more(self) -> None:
        if self._lookup is not None:
            self._lookup.end()
            self._lookup = None

    def _refuse(self, reason: str) -> None:
        self._lookup = None
        self._node.get_logger().error(f"goal refused: {reason}")

# SPDX-License-Identifier: Apache-2.0
"""Goals and waypoints that others send: brought into the world frame and made parameters."""

from collections.abc import Callable, Sequence
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
    refused with a word and changes nothing. `stop` publishes zero velocity.
    """

    def __init__(self, node: Node, navigation: Navigation, stop: Callable[[], None]) -> None:
        self._node, self._navigation, self._stop = node, navigation, stop
        self._lookup: transforms.Lookup | None = None  # for the last goal, if it waits
        self.refusal = ""  # why the last goal was refused, if it was
        node.create_subscription(PoseStamped, "goal_pose", self._on_route, 10)
        node.create_subscription(Path, "waypoints", self._on_route, 10)

    def forget(self) -> None:
        """Stop, and give up goal and waypoints. Raises GradnavError where there is no goal."""
        waited, self.refusal = self.wait_no_more(), ""
        if self._navigation.settings.has_goal:
            self._navigation.cancel()  # whatever becomes of the parameters
            self._stop()
            try:
                self._set((), ())
            except GradnavError as error:
                raise GradnavError(f"the robot stands, but its goal stays set: {error}") from error
        elif not waited:
            raise GradnavError("nothing to cancel: no goal is set")

    def wait_no_more(self) -> bool:
        """Forget a goal that waits for its frame to be known; return whether there was one."""
        lookup, self._lookup = self._lookup, None
        if lookup is not None:
            lookup.end()
        return lookup is not None

    def _on_route(self, message: PoseStamped | Path) -> None:
        try:
            self._take(route(message))
        except GradnavError as error:
            self._refuse(str(error))

    def _take(self, poses: Route) -> None:
        """Set out for the last pose by way of the others, once their frame is known."""
        self.wait_no_more()
        odometry, frame = self._navigation.odometry, poses[0].frame
        if not transforms.CAN_LOOK_UP or frame in ("", *odometry.frame_names):
            self._set_out(poses)
            return
        target = odometry.frame_names[1]

        def on_found(transform: Any) -> None:
            self._lookup = None
            try:
                self._set_out([transforms.moved(pose, transform, target) for pose in poses])
            except GradnavError as error:
                self._refuse(str(error))

        self._lookup = transforms.Lookup(self._node, target, frame, on_found, self._refuse)

    def _set_out(self, poses: Route) -> None:
        """Go. Raises GradnavError, and then nothing has changed."""
        self._set(*self._navigation.odometry.in_world(poses))
        self._navigation.restart()
        self.refusal = ""

    def _set(self, goal: Sequence[float], waypoints: Sequence[float]) -> None:
        result = self._node.set_parameters_atomically(
            [
                Parameter("goal", Parameter.Type.DOUBLE_ARRAY, list(goal)),
                Parameter("waypoints", Parameter.Type.DOUBLE_ARRAY, list(waypoints)),
            ]
        )
        if not result.successful:
            raise GradnavError(result.reason)

    def _refuse(self, reason: str) -> None:
        self._lookup, self.refusal = None, reason
        self._node.get_logger().error(f"goal refused: {reason}")

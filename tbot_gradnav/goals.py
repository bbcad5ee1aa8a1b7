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
from tbot_gradnav.odometry import GoalPose


class Goals:
    """Takes a goal from goal_pose, and waypoints with the goal as the last from waypoints.

    Either replaces the parameters `goal` and `waypoints` together and sets out anew, or is
    refused with a word and changes nothing.
    """

    def __init__(self, node: Node, navigation: Navigation) -> None:
        self._node, self._navigation = node, navigation
        self._lookup: transforms.Lookup | None = None  # for the last goal, if it waits
        node.create_subscription(PoseStamped, "goal_pose", self._on_goal, 10)
        node.create_subscription(Path, "waypoints", self._on_waypoints, 10)

    def forget(self) -> None:
        """Give up goal and waypoints. Raises GradnavError where no goal is set."""
        if not self._navigation.settings.has_goal:
            raise GradnavError("nothing to cancel: no goal is set")
        self._wait_no_more()
        self._set((), ())

    def _on_goal(self, message: PoseStamped) -> None:
        self._take([GoalPose.of(message)])

    def _on_waypoints(self, message: Path) -> None:
        frame = message.header.frame_id
        route = [GoalPose.of(pose) for pose in message.poses]
        if not route:
            self._refuse("a path without poses; to stop, call the service cancel")
        elif {pose.frame for pose in route} - {"", frame}:
            self._refuse("the poses of a path must be in the frame of the path")
        else:
            self._take([pose._replace(frame=frame) for pose in route])

    def _take(self, route: Sequence[GoalPose]) -> None:
        """Set out for the last pose by way of the others, once their frame is known."""
        self._wait_no_more()
        odometry, frame = self._navigation.odometry, route[0].frame
        if not transforms.CAN_LOOK_UP or frame in ("", *odometry.frame_names):
            self._set_out(route)
            return
        target = odometry.frame_names[1]

        def on_found(transform: Any) -> None:
            self._lookup = None
            self._set_out([transforms.moved(pose, transform, target) for pose in route])

        self._lookup = transforms.Lookup(self._node, target, frame, on_found, self._refuse)

    def _set_out(self, route: Sequence[GoalPose]) -> None:
        try:
            *waypoints, goal = [self._navigation.odometry.in_world(pose) for pose in route]
            self._set(goal, [value for point in waypoints for value in point[:2]])
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

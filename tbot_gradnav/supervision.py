# SPDX-License-Identifier: Apache-2.0
"""What others see of a drive and may do to it: the topic state; pause, resume and cancel."""

from collections.abc import Callable
from functools import partial

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.ros import LATCHED


class Supervision:
    """Publishes each change of state, and serves pause, resume and cancel.

    `stop` publishes zero velocity, `forget` gives up the goal or raises GradnavError.
    """

    def __init__(
        self,
        node: Node,
        navigation: Navigation,
        stop: Callable[[], None],
        forget: Callable[[], None],
    ) -> None:
        self._navigation, self._stop, self._logger = navigation, stop, node.get_logger()
        self._announced: State | None = None
        self._publisher = node.create_publisher(String, "state", LATCHED)
        acts = {"pause": self._pause, "resume": navigation.resume, "cancel": forget}
        for name, act in acts.items():
            node.create_service(Trigger, name, partial(self._serve, name, act))
        self.announce()

    def announce(self) -> None:
        """Publish the state if it has changed."""
        state = self._navigation.state
        if state is not self._announced:
            self._announced = state
            self._publisher.publish(String(data=state.value))

    def _pause(self) -> None:
        self._navigation.pause()
        self._stop()

    def _serve(
        self,
        name: str,
        act: Callable[[], None],
        _: Trigger.Request,
        response: Trigger.Response,
    ) -> Trigger.Response:
        try:
            act()
        except GradnavError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, self._navigation.state.value
            self._logger.info(f"{name}: {response.message}")
        self.announce()
        return response

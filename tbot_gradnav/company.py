# SPDX-License-Identifier: Apache-2.0
"""Who else tells the robot what to do."""

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tbot_gradnav.command_publisher import TOPIC, WATCHDOG

LOOK_PERIOD = 2.0  # [s]


class Company:
    """Warns of others that publish on cmd_vel; the watchdog, which only ever stops, may."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._topic = node.resolve_topic_name(TOPIC)
        self._known: list[str] = []
        node.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        infos = self._node.get_publishers_info_by_topic(self._topic)
        names = sorted(info.node_name for info in infos if info.node_name != WATCHDOG)
        if self._node.get_name() in names:
            names.remove(self._node.get_name())  # once: another of the same name is company
        if names and names != self._known:
            self._node.get_logger().warning(
                f"commands on {self._topic} come from somebody else too ({', '.join(names)}): the "
                "robot obeys whoever spoke last. A node that was killed is listed for some 20 s"
            )
        self._known = names

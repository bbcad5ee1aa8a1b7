# SPDX-License-Identifier: Apache-2.0
"""Maps from the topic map, as map_server and SLAM publish them."""

import threading
from collections.abc import Callable
from typing import Any

from nav_msgs.msg import OccupancyGrid
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.ros import LATCHED
from tbot_gradnav.walls import walls

PERIOD = 0.05  # [s] between looks whether a map is ready
PATIENCE = 60  # such looks, before the lack of a map is mentioned


class MapTopic:
    """Hands each map over once the distances from its walls are known.

    That takes a while and is done in a thread of its own; of maps that come meanwhile only the
    last is taken, and none that is like the one before.
    """

    def __init__(self, node: Node, frame: str, take: Callable[[Occupancy], None]) -> None:
        self._node, self._frame, self._take = node, frame, take
        self._looks, self._came = 0, False
        self._next: OccupancyGrid | None = None
        self._found: Occupancy | GradnavError | None = None
        self._last: Occupancy | None = None  # that was handed over
        self._thread: threading.Thread | None = None
        self._subscription = node.create_subscription(OccupancyGrid, "map", self._on_map, LATCHED)
        self._timer = node.create_timer(
            PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def close(self) -> None:
        """Listen no more."""
        self._node.destroy_subscription(self._subscription)
        self._node.destroy_timer(self._timer)

    def _on_map(self, message: OccupancyGrid) -> None:
        if message.header.frame_id not in ("", self._frame):
            self._node.get_logger().error(
                f"map refused: it is in frame {message.header.frame_id}, and world_frame is "
                f"{self._frame}"
            )
            return
        self._next, self._came = message, True

    def _look(self) -> None:
        self._looks += 1
        if self._looks == PATIENCE and not self._came:
            topic = self._subscription.topic_name
            self._node.get_logger().warning(
                f"waiting for a map on {topic}: is map_server or SLAM up?"
            )
        if self._thread is not None and not self._thread.is_alive():
            found, self._found, self._thread = self._found, None, None
            if isinstance(found, Occupancy):
                self._last = found
                self._take(found)
            elif found is not None:
                self._node.get_logger().error(f"map refused: {found}")
        if self._next is not None and self._thread is None:
            message, self._next = self._next, None
            self._thread = threading.Thread(target=self._measure, args=(message,), daemon=True)
            self._thread.start()

    def _measure(self, message: Any) -> None:
        try:
            occupancy = Occupancy.of(message)
            if self._last is None or not occupancy.is_like(self._last):
                _ = walls(occupancy).depth
                self._found = occupancy
        except Exception as error:
            self._found = GradnavError(str(error))

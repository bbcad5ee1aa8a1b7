# SPDX-License-Identifier: Apache-2.0
"""What a node says to people, without saying it over and over."""

import math
import time

from rclpy.node import Node

from tbot_gradnav.odometry import Notice

QUIET = 10.0  # [s] without something before it is said again


class Journal:
    """Logs what happens; what goes on is said once, and again only after it had ended."""

    def __init__(self, node: Node) -> None:
        self._logger = node.get_logger()
        self._last: dict[str, float] = {}  # [s] when a kind of thing last went on

    def warn(self, kind: str, text: str) -> None:
        """Say that something is not as it should be, unless it was said and goes on."""
        if self._is_news(kind):
            self._logger.warning(text)

    def fail(self, kind: str, text: str) -> None:
        """Say that the robot was stopped, unless it was said and goes on."""
        if self._is_news(kind):
            self._logger.error(f"stopped: {text}")

    def tell(self, notice: Notice) -> None:
        """Pass on what the navigation noticed."""
        if notice.kind in ("arrived", "waypoint"):
            self._logger.info(notice.text)
        elif notice.kind == "stuck":
            self._logger.error(f"stopped: {notice.text}")
        else:
            self.warn(notice.kind, notice.text)

    def _is_news(self, kind: str) -> bool:
        now = time.monotonic()
        news = now - self._last.get(kind, -math.inf) > QUIET
        self._last[kind] = now
        return news

# SPDX-License-Identifier: Apache-2.0
"""What the navigator does with each odometry message; the node and the replay share it."""

import math
from typing import NamedTuple

from tbot_gradnav.controller import Controller
from tbot_gradnav.odometry import Notice, Odometry, Reading
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import STOP, Floats, Pose, Twist


class Outcome(NamedTuple):
    """The command for one message; None while there is no goal to drive to."""

    twist: Twist | None
    notices: list[Notice]


class Navigation:
    """A controller with its memory: where the odometry frame is, the gear, whether it arrived."""

    def __init__(self, settings: Settings) -> None:
        self.odometry = Odometry(settings.start, settings.limits)
        self.settings = settings
        self._controller = Controller.of(settings)
        self._gear: Floats | None = None  # chosen at the first message after a goal is set
        self._arrived = False

    @property
    def arrived(self) -> bool:
        """Whether the goal has been reached."""
        return self._arrived

    def change(self, settings: Settings) -> None:
        """Go on with other settings, from the same pose. A new goal starts a new drive."""
        self._controller = Controller.of(settings)
        if settings.goal != self.settings.goal:
            self.restart()
        self.settings = settings

    def restart(self) -> None:
        """Set out for the goal anew: choose the gear again, and forget an arrival."""
        self._gear, self._arrived = None, False

    def update(self, reading: Reading) -> Outcome:
        """Return the command for one odometry message. Raises BadOdometryError."""
        pose, notices = self.odometry.update(reading)
        if not self.settings.has_goal:
            return Outcome(None, notices)
        if self._gear is None:
            self._gear = self._controller.gear(pose)
        if not self._arrived:
            notices += self._arrival(pose)
        if self._arrived:
            return Outcome(STOP, notices)
        v, omega = map(float, self._controller.command(pose, self._gear))
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ArithmeticError(f"the command ({v}, {omega}) at {pose} is not finite")
        return Outcome(Twist(v, omega), notices)

    def _arrival(self, pose: Pose) -> list[Notice]:
        distance = float(self._controller.distance(pose))
        self._arrived = bool(self._controller.arrived(distance))
        return [Notice("arrived", f"arrived, {distance:.3f} m from the goal")] * self._arrived

# SPDX-License-Identifier: Apache-2.0
"""What the navigator does with each odometry message; the node and the replay share it."""

import math
from enum import Enum
from typing import NamedTuple

from tbot_gradnav.controller import Controller
from tbot_gradnav.odometry import Notice, Odometry, Reading
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import STOP, Floats, Pose, Twist

STUCK_RADIUS = 0.1  # [m] a robot that stays within this, or a quarter of its way to go, ...
STUCK_TIME = 15.0  # [s] ... for this long is stuck
INTERRUPTION = 1.0  # [s] without odometry, after which the time starts anew


class State(Enum):
    """What the robot is doing."""

    IDLE = "idle"  # it has no goal
    DRIVING = "driving"
    ARRIVED = "arrived"
    STUCK = "stuck"


class Outcome(NamedTuple):
    """What came of a message: the pose in the world, and the command; None without a goal."""

    pose: Pose
    twist: Twist | None
    notices: list[Notice]


class Navigation:
    """A controller with its memory: where the odometry frame is, the gear, how the drive goes."""

    def __init__(self, settings: Settings, world_frame: str = "map") -> None:
        self.odometry = Odometry(settings.start, settings.limits, world_frame)
        self.settings = settings
        self._controller = Controller.of(settings)
        self.restart()

    @property
    def state(self) -> State:
        """What the robot is doing."""
        return self._state

    def change(self, settings: Settings) -> None:
        """Go on with other settings, from the same pose. A new goal starts a new drive.

        A robot that was stuck tries again.
        """
        self._controller = Controller.of(settings)
        self.odometry.limits = settings.limits
        before, self.settings = self.settings, settings
        if _aim(settings) != _aim(before) or self._state is State.STUCK:
            self.restart()

    def restart(self) -> None:
        """Set out for the goal anew: choose the gear again, and forget how the last drive ended."""
        self._state = State.DRIVING if self.settings.has_goal else State.IDLE
        self._gear: Floats | None = None  # chosen at the first message of a drive
        self._progress = _Progress()

    def update(self, reading: Reading) -> Outcome:
        """Return the command for one odometry message. Raises BadOdometryError."""
        pose, notices = self.odometry.update(reading)
        if self._state is State.IDLE:
            return Outcome(pose, None, notices)
        if self._state is State.DRIVING:
            notices += self._judged(reading.stamp, pose)
        if self._state is not State.DRIVING:
            return Outcome(pose, STOP, notices)
        if self._gear is None:
            self._gear = self._controller.gear(pose)
        v, omega = map(float, self._controller.command(pose, self._gear))
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ArithmeticError(f"the command ({v}, {omega}) at {pose} is not finite")
        return Outcome(pose, Twist(v, omega), notices)

    def _judged(self, stamp: float, pose: Pose) -> list[Notice]:
        """Find out whether the drive has ended, and say so."""
        distance = float(self._controller.distance(pose))
        if self._controller.arrived(pose):
            self._state = State.ARRIVED
            return [Notice("arrived", f"arrived, {distance:.3f} m from the goal")]
        if self._progress.is_stuck(stamp, pose, distance):
            self._state = State.STUCK
            return [Notice("stuck", self._complaint(pose, distance))]
        return []

    def _complaint(self, pose: Pose, distance: float) -> str:
        potential = self._controller.potential
        field = potential(pose.x, pose.y)
        return (
            f"stuck at ({pose.x:.2f}, {pose.y:.2f}) m, {distance:.2f} m from the goal: no "
            f"progress for {STUCK_TIME:g} s, phi = {field.phi:.4g}, |grad phi| = "
            f"{field.polar[0]:.3g}. A minimum other than the goal? `gradnav check` tells. Try "
            f"{potential.advice}, or another goal"
        )


def _aim(settings: Settings) -> tuple[object, ...]:
    """Return what decides whether a robot has arrived."""
    return settings.goal, settings.xy_goal_tolerance, settings.yaw_goal_tolerance


class _Progress:
    """Whether a robot gets anywhere."""

    def __init__(self) -> None:
        self._since = math.nan  # [s] when it came to where it is
        self._last = math.nan  # [s] stamp of the last message
        self._x = self._y = math.nan  # [m] where it is

    def is_stuck(self, stamp: float, pose: Pose, distance: float) -> bool:
        """Take note of pose and distance to the goal [m]; return whether it stayed for too long."""
        x, y = float(pose.x), float(pose.y)
        interrupted = not 0.0 <= stamp - self._last <= INTERRUPTION
        self._last = stamp
        if interrupted or math.hypot(x - self._x, y - self._y) > min(STUCK_RADIUS, distance / 4):
            self._since, self._x, self._y = stamp, x, y
        return stamp - self._since > STUCK_TIME

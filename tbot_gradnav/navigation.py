# SPDX-License-Identifier: Apache-2.0
"""What the navigator does with each odometry message; the node and the replay share it."""

import math
from dataclasses import replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.lidar import Sweep
from tbot_gradnav.odometry import Notice, Odometry, Reading
from tbot_gradnav.potentials import Potential
from tbot_gradnav.settings import Settings
from tbot_gradnav.sightings import Sightings
from tbot_gradnav.unicycle import STOP, Floats, Pose, Twist

STUCK_RADIUS = 0.1  # [m] a robot that stays within this, or a quarter of its way to go, ...
STUCK_TIME = 15.0  # [s] ... for this long is stuck
BLIND = 1.0  # [s] without a sweep of the lidar, after which a robot that needs it must stand
INTERRUPTION = 1.0  # [s] without odometry, after which the time starts anew


class State(Enum):
    """What the robot is doing."""

    IDLE = "idle"  # it has no goal
    DRIVING = "driving"
    TURNING = "turning"  # on the spot, at the goal, to its yaw
    WAITING = "waiting"  # for the lidar or the map that its potential needs
    ARRIVED = "arrived"
    STUCK = "stuck"
    PAUSED = "paused"  # until it is resumed, whatever it was doing
    NO_ODOMETRY = "no odometry"  # none yet, none for too long, or none that is usable


class Outcome(NamedTuple):
    """What came of a message: the pose in the world, and the command; None without a goal."""

    pose: Pose
    twist: Twist | None
    notices: list[Notice]


class Navigation:
    """A controller with its memory: where the odometry frame is, the gear, how the drive goes.

    A potential that takes long to make is made when it is first asked for, or, `in_background`,
    while the robot stands.
    """

    def __init__(self, settings: Settings, world_frame: str = "map") -> None:
        self.odometry = Odometry(settings.start, settings.limits, world_frame)
        self.settings = settings
        self.pose: Pose | None = None  # in the world, by the last odometry
        self._lost = True  # whether there is no odometry
        self._paused = False
        self._waiting = False
        self._legs = [Controller.of(leg) for leg in settings.legs]
        self._controller = self._legs[0]
        self._sightings = Sightings()
        self._sweep: Sweep | None = None  # the last, until odometry tells where it was taken
        self._looked = -math.inf  # [s] stamp of the last sweep that was placed
        self._too_old = 0.0  # [s] by how much the last sweep was, where it could not be placed
        self._background = False
        self.restart()

    @property
    def state(self) -> State:
        """What the robot is doing."""
        if self._paused:
            return State.PAUSED
        if self._lost:
            return State.NO_ODOMETRY
        if self._waiting:
            return State.WAITING
        return State.TURNING if self._turning else self._state

    @property
    def has_drive(self) -> bool:
        """Whether the robot has somewhere to go, paused or not."""
        return self._state is State.DRIVING

    @property
    def potential(self) -> Potential:
        """The potential that it follows now, to the goal or the next waypoint."""
        return self._controller.potential

    def lose_odometry(self) -> None:
        """Take note that no usable odometry comes; the next that does ends this."""
        self._lost = True

    def pause(self) -> None:
        """Stand until `resume`, whatever goal is set. Raises GradnavError if it is paused."""
        if self._paused:
            raise GradnavError("paused already")
        self._paused = True

    def resume(self) -> None:
        """Go on after `pause`. Raises GradnavError where there was none."""
        if not self._paused:
            raise GradnavError(f"not paused: {self.state.value}")
        self._paused = False
        self._progress = _Progress()

    def change(self, settings: Settings) -> None:
        """Go on with other settings, from the same pose. A new goal starts a new drive.

        A robot that was stuck tries again.
        """
        self._legs = [Controller.of(leg) for leg in settings.legs]
        self.odometry.limits = settings.limits
        before, self.settings = self.settings, settings
        if _aim(settings) != _aim(before) or self._state is State.STUCK:
            self.restart()
        elif self._legs[self._leg].potential == self._controller.potential:
            kept = self._controller.potential  # with what it has seen and planned
            self._controller = replace(self._legs[self._leg], potential=kept)
        else:
            self._head_for(self._leg)

    def in_background(self) -> None:
        """Make potentials that take long in the background from now on."""
        self._background = True
        self._head_for(self._leg)

    def cancel(self) -> None:
        """Give up the goal, whatever the settings say, until others have another."""
        self._state, self._waiting, self._turning = State.IDLE, False, False

    def restart(self) -> None:
        """Set out for the goal anew: choose the gear again, and forget how the last drive ended."""
        self._state = State.DRIVING if self.settings.has_goal else State.IDLE
        self._waiting = False
        self._turning = False
        self._gear: Floats | None = None  # chosen at the first message of a drive
        self._head_for(0)

    def see(self, sweep: Sweep) -> None:
        """Take note of what the lidar sees; it is placed once odometry as new as it has come.

        Until then a newer sweep does not take its place, or scans that are always a little ahead
        of odometry would never be placed.
        """
        if self._sweep is None or not 0.0 <= sweep.stamp - self._sweep.stamp <= BLIND:
            self._sweep = sweep

    def update(self, reading: Reading) -> Outcome:
        """Return the command for one odometry message. Raises BadOdometryError."""
        self._lost = True
        pose, notices = self.odometry.update(reading)
        self.pose, self._lost = pose, False
        if self._controller.potential.looks:
            self._look(reading.stamp)
        if self._state is State.IDLE:
            return Outcome(pose, None, notices)
        if self._paused:
            return Outcome(pose, STOP, notices)
        self._waiting = False
        if self._blind(reading.stamp):
            self._wait()
            notices.append(Notice("blind", self._why_blind(reading.stamp)))
            return Outcome(pose, STOP, notices)
        if self._state is State.DRIVING:
            notices += self._judged(reading.stamp, pose)
        if self._state is not State.DRIVING:
            return Outcome(pose, STOP, notices)
        if not self._controller.potential.ready:  # asked after a waypoint may have been passed
            self._wait()
            return Outcome(pose, STOP, notices)
        self._prepare(self._leg + 1)
        if self._gear is None:
            self._gear = self._controller.gear(pose)
        v, omega = map(float, self._controller.command(pose, self._gear))
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ArithmeticError(f"the command ({v}, {omega}) at {pose} is not finite")
        return Outcome(pose, Twist(v, omega), notices)

    def _wait(self) -> None:
        self._waiting, self._progress = self._state is State.DRIVING, _Progress()

    def _look(self, now: float) -> None:
        """Place the last sweep by the odometry at its stamp."""
        if self._sweep is None or self._sweep.stamp > now:
            return
        pose = self.odometry.at(self._sweep.stamp)
        self._too_old = now - self._sweep.stamp if pose is None else 0.0
        if pose is not None:
            lidar = pose.compose(Pose(self.settings.lidar_x, 0.0, 1.0, 0.0))
            if np.isfinite(self._sweep.measured).any():  # else it may be covered
                driving = self._state is State.DRIVING and not self._paused
                self._sightings.update(self._sweep, lidar, driving)
                self._controller = self._controller.seeing(self._sightings.points)
                self._looked = self._sweep.stamp
        self._sweep = None

    def _blind(self, now: float) -> bool:
        """Return whether a robot that needs its lidar has none."""
        return self._controller.potential.looks and not abs(now - self._looked) <= BLIND

    def _why_blind(self, now: float) -> str:
        text = f"stopped: no lidar scan that shows anything for {BLIND:g} s"
        if self._sweep is not None:
            text += f"; the last is stamped {self._sweep.stamp - now:.3g} s after the odometry"
        elif self._too_old:
            text += f"; the last is {self._too_old:.3g} s older than the odometry, which is too old"
        return text

    def _judged(self, stamp: float, pose: Pose) -> list[Notice]:
        """Find out whether a waypoint was passed or the drive has ended, and say so."""
        distance = float(self._controller.distance(pose))
        if self._leg < len(self._legs) - 1:
            if distance <= self.settings.waypoint_tolerance:
                self._head_for(self._leg + 1)
                passed = f"passed waypoint {self._leg} of {len(self._legs) - 1}"
                return [Notice("waypoint", passed), *self._judged(stamp, pose)]
        elif self._controller.arrived(pose):
            self._state, self._turning = State.ARRIVED, False
            return [Notice("arrived", f"arrived, {distance:.3f} m from the goal")]
        if self._progress.is_stuck(stamp, pose, distance):
            self._state, self._turning = State.STUCK, False
            return [Notice("stuck", self._complaint(pose, distance))]
        self._turning = (
            self._controller.settings.goal_heading is not None
            and distance <= self.settings.xy_goal_tolerance
        )
        return []

    def _head_for(self, leg: int) -> None:
        """Steer for a waypoint or, on the last leg, the goal."""
        self._leg = leg
        self._prepare(leg)
        self._controller = self._legs[leg].seeing(self._sightings.points)
        self._progress = _Progress()

    def _prepare(self, leg: int) -> None:
        """Begin with what takes long of a leg, if there is such a leg and it is to be driven."""
        if self._background and self._state is State.DRIVING and leg < len(self._legs):
            self._legs[leg].potential.prepare()

    def _complaint(self, pose: Pose, distance: float) -> str:
        potential = self._controller.potential
        field = potential(pose.x, pose.y)
        last = self._leg == len(self._legs) - 1
        whither = "the goal" if last else f"waypoint {self._leg + 1}"
        return (
            f"stuck at ({pose.x:.2f}, {pose.y:.2f}) m, {distance:.2f} m from {whither}: no "
            f"progress for {STUCK_TIME:g} s, phi = {field.phi:.4g}, |grad phi| = "
            f"{field.polar[0]:.3g}. A minimum other than the goal? `gradnav check` tells. Try "
            f"{potential.advice}, or another goal"
        )


def _aim(settings: Settings) -> tuple[object, ...]:
    """Return what decides whether a robot has arrived."""
    tolerances = settings.xy_goal_tolerance, settings.yaw_goal_tolerance
    return settings.goal, settings.waypoints, *tolerances


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

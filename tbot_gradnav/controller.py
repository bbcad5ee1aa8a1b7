# SPDX-License-Identifier: Apache-2.0
"""The whole controller: pose, potential, law, limits, command."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tbot_gradnav import pose_law, shaping
from tbot_gradnav.elementwise import Bools, choose, larger
from tbot_gradnav.laws import LAWS, TOWARDS_GOAL, Law, State
from tbot_gradnav.potentials import Points, Potential
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import Floats, Pose, Twist


@dataclass(frozen=True)
class Controller:
    """A law on a potential, for one robot or many.

    It keeps no state: the gear is chosen with `gear` when a goal is set and handed back in.
    """

    settings: Settings
    potential: Potential
    law: Law

    @classmethod
    def of(cls, settings: Settings) -> "Controller":
        """Return the controller that `settings` describe. Raises ParameterError."""
        return cls(settings, settings.chosen_potential, LAWS[settings.law])

    def command(self, pose: Pose, gear: Floats) -> Twist:
        """Return the command at `pose` (world frame) in a gear, zero at the goal."""
        settings = self.settings
        at = self._state(pose)
        v, omega = settings.limits(*self.law(gear * settings.k_v, gear * settings.k_omega, at))
        if settings.goal_heading is not None:
            v, omega = self._aligned(at, v, omega, settings.goal_heading)
        driving = choose(self.arrived(pose), 0.0, 1.0)
        return Twist(driving * v, driving * omega)

    def seeing(self, points: Points) -> "Controller":
        """Return the same controller with these points seen by the lidar."""
        return replace(self, potential=self.potential.seeing(points))

    def gear(self, pose: Pose) -> Floats:
        """Return +1 to keep the signs of the gains, -1 to flip both (Remark IV.4).

        With auto_reverse the robot starts whichever way, forward or backward, is nearer the
        direction it has to go; exactly abeam it keeps the signs.
        """
        if not self.settings.auto_reverse:
            return np.ones_like(pose.x)
        at = self._state(pose)
        if self.settings.law in TOWARDS_GOAL:
            ahead = -(at.cos_theta * at.cos_alpha + at.sin_theta * at.sin_alpha)
        else:
            ahead = -(at.cos_theta * at.cos_gamma + at.sin_theta * at.sin_gamma)
        return choose(ahead * self.settings.k_v < 0.0, -1.0, 1.0)

    def distance(self, pose: Pose) -> Floats:
        """Return rho, the distance to the goal [m]."""
        dx, dy = pose.x - self.settings.world.goal[0], pose.y - self.settings.world.goal[1]
        return (dx * dx + dy * dy) ** 0.5

    def arrived(self, pose: Pose) -> Bools:
        """Return whether a robot is at the goal and, if that matters, headed as it asks."""
        settings = self.settings
        there = self.distance(pose) <= settings.xy_goal_tolerance
        if settings.goal_heading is None:
            return there
        cos, sin = settings.goal_heading
        aligned = pose.cos * cos + pose.sin * sin >= math.cos(settings.yaw_goal_tolerance)
        return there & aligned

    @cached_property
    def _ball(self) -> float:
        return pose_law.ball(self.potential.room(*self.settings.world.goal))

    def _aligned(self, at: State, v: Floats, omega: Floats, heading: tuple[float, float]) -> Twist:
        """Return the command of the pose law where it holds, else the one given."""
        settings = self.settings
        inside = at.rho <= self._ball
        there = at.rho <= settings.xy_goal_tolerance
        align = settings.limits(*pose_law.align(at, *heading))
        turn = settings.limits(*pose_law.turn(at, *heading))
        return Twist(
            np.where(there, turn.v, np.where(inside, align.v, v)),
            np.where(there, turn.omega, np.where(inside, align.omega, omega)),
        )

    def _state(self, pose: Pose) -> State:
        settings = self.settings
        x, y = pose.x - settings.world.goal[0], pose.y - settings.world.goal[1]
        rho = (x * x + y * y) ** 0.5
        inverse = 1.0 / larger(rho, 1e-150)
        mu, cos_gamma, sin_gamma = self.potential(pose.x, pose.y).polar
        pace = shaping.Pace(abs(settings.k_v), settings.limits.v, settings.deceleration)
        speed = shaping.SHAPINGS[settings.speed_shaping](pace, rho, mu)
        return State(
            pose.cos,
            pose.sin,
            rho,
            x * inverse,
            y * inverse,
            speed / pace.k_v,
            cos_gamma,
            sin_gamma,
        )

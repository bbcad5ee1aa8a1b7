# SPDX-License-Identifier: Apache-2.0
"""A dynamic-window approach, vectorised: Fox, Burgard and Thrun, IEEE RAM 4(1), 1997.

The plant has limits of speed but none of acceleration, so every command within them is reachable
and the window is all of them, which only helps it. The arc of each command is followed for
HORIZON; a command is admissible if it can stop, at DECELERATION, before the arc meets anything,
and stop at the goal. The best is that with the largest weighted sum of heading towards the goal
where the arc is nearest to it, of the nearest distance along the arc, and of speed, each between
0 and 1.

The weights and the horizon were tried on worlds with other seeds than those of the table, for
arrivals without collision first and for time next.
"""

from dataclasses import dataclass

import numpy as np

from tbot_gradnav.controller import Controller
from tbot_gradnav.unicycle import Floats, Pose, Twist, step

SPEEDS, TURNS = 8, 25  # candidates
HORIZON = 1.5  # [s]
POINTS = 10  # along an arc
DECELERATION = 0.5  # [m/s^2]
RANGE = 0.2  # [m] of distance that is worth 1
HEADING, NEAREST, SPEED = 0.8, 0.3, 0.2  # weights


@dataclass(frozen=True)
class DynamicWindow(Controller):
    """The approach in place of a law; it stays forward and looks at no potential."""

    def command(self, pose: Pose, gear: Floats) -> Twist:
        """Return the best command of each robot."""
        limits = self.settings.limits
        v, omega = self._candidates()
        here = Pose(*(np.asarray(part)[None, None, :] for part in pose))
        candidates = Twist(v[:, None, None], omega[:, None, None])
        times = np.linspace(HORIZON / POINTS, HORIZON, POINTS)[None, :, None]
        arc = step(here, candidates, times)  # (candidates, points, robots)
        clear = np.asarray(self.settings.world.clearance(arc.x, arc.y))
        free = np.logical_and.accumulate(clear > 0.0, axis=1)
        stops = v[:, None] ** 2 / (2.0 * DECELERATION)
        length = v[:, None] * (free.sum(axis=1) - 1) * HORIZON / POINTS  # before a collision
        admissible = free[:, -1] | (stops < length) | (v[:, None] == 0.0)
        admissible &= v[:, None] <= np.sqrt(2.0 * DECELERATION * np.asarray(self.distance(pose)))
        nearest = np.min(np.where(free, clear, 0.0), axis=1)
        score = (
            HEADING * self._heading(arc)
            + NEAREST * np.clip(nearest / RANGE, 0.0, 1.0)
            + SPEED * v[:, None] / limits.v
        )
        best = np.argmax(np.where(admissible, score, -1.0), axis=0)
        home = np.asarray(self.arrived(pose))
        return Twist(np.where(home, 0.0, v[best]), np.where(home, 0.0, omega[best]))

    def gear(self, pose: Pose) -> Floats:
        """Return forward."""
        return np.ones_like(pose.x)

    def _candidates(self) -> tuple[np.ndarray, np.ndarray]:
        """Return v [m/s] and omega [rad/s] of all commands, fitted into the limits."""
        limits = self.settings.limits
        v, omega = np.meshgrid(
            np.linspace(0.0, limits.v, SPEEDS),
            np.linspace(-1.0, 1.0, TURNS) ** 3 * limits.omega,  # finer where they are slow
        )
        fitted = limits(v.ravel(), omega.ravel())
        return np.asarray(fitted.v), np.asarray(fitted.omega)

    def _heading(self, arc: Pose) -> np.ndarray:
        """Return how well the robot heads for the goal where the arc is nearest to it, in [0, 1].

        That is the arc's end, but for one that would pass the goal.
        """
        goal_x, goal_y = self.settings.world.goal
        to_x, to_y = goal_x - np.asarray(arc.x), goal_y - np.asarray(arc.y)
        last = np.argmin(to_x**2 + to_y**2, axis=1)[:, None]
        to_x, to_y, cos, sin = (
            np.take_along_axis(np.broadcast_to(part, to_x.shape), last, axis=1)[:, 0]
            for part in (to_x, to_y, np.asarray(arc.cos), np.asarray(arc.sin))
        )
        off = np.arctan2(cos * to_y - sin * to_x, cos * to_x + sin * to_y)
        return 1.0 - np.abs(off) / np.pi

# SPDX-License-Identifier: Apache-2.0
"""Khatib's potential with the distances that the robot's own lidar measures."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tbot_gradnav.parameters import Number, field
from tbot_gradnav.potentials.field import Field, Potential
from tbot_gradnav.potentials.repulsion import distances_from, repulsion
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import Distances


@dataclass(frozen=True)
class Scan(Potential):
    """U = rho^2 / 2 + rho^2 times the repulsion of all that the lidar sees.

    What the parameter file says of obstacles and boundary is not used. The factor rho^2 keeps the
    minimum at the goal (Ge and Cui, IEEE Trans. Robotics and Automation 16(5), 2000).
    """

    looks: ClassVar[bool] = True
    advice: ClassVar[str] = "a smaller scan.influence_distance or a map (potential map)"

    k_repulsive: float = field(0.01, Number("k_r, weight of the repulsion", above=0.0))
    influence_distance: float = field(
        0.5, Number("d_0, how near something must be to repel", "m", above=0.0)
    )

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return U and its gradient at (x, y)."""
        dx, dy = x - self.world.goal[0], y - self.world.goal[1]
        rho2 = dx * dx + dy * dy
        push = repulsion(self._near(x, y), self.k_repulsive, self.influence_distance)
        pull = 1.0 + 2.0 * push.value
        return Field(
            rho2 * (0.5 + push.value), pull * dx + rho2 * push.x, pull * dy + rho2 * push.y
        )

    def room(self, x: Floats, y: Floats) -> Floats:
        """Return how far [m] a robot at (x, y) is from the nearest thing seen."""
        nearest: Floats = np.min(self._near(x, y).d, axis=0, initial=np.inf)
        return nearest

    def _near(self, x: Floats, y: Floats) -> Distances:
        if self.revealed:
            return self.world.distances(x, y)
        return distances_from(self.seen, x, y, self.world.robot_radius)

# SPDX-License-Identifier: Apache-2.0
"""Khatib's attractive-repulsive potential (FIRAS), with Ge and Cui's remedy at the goal."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tbot_gradnav.parameters import Flag, Number, field
from tbot_gradnav.potentials.field import Field, Potential
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import TOUCHING, over_rows


@dataclass(frozen=True)
class AttractiveRepulsive(Potential):
    """U = k_a rho^2 / 2 + sum of k_r (1/d_i - 1/d_0)^2 / 2 over the obstacles with d_i < d_0.

    With goal_scaled the repulsive terms are multiplied by rho^2, which keeps the minimum at the
    goal when an obstacle is within d_0 of it. Khatib, Int. J. Robotics Research 5(1), 1986;
    Ge and Cui, IEEE Trans. Robotics and Automation 16(5), 2000.
    """

    advice: ClassVar[str] = (
        "a smaller attractive_repulsive.influence_distance or attractive_repulsive.k_repulsive"
    )

    k_attractive: float = field(1.0, Number("k_a, weight of the attraction", "1/s", above=0.0))
    k_repulsive: float = field(0.01, Number("k_r, weight of the repulsion", above=0.0))
    influence_distance: float = field(
        0.4, Number("d_0, how near an obstacle must be to repel", "m", above=0.0)
    )
    goal_scaled: bool = field(True, Flag("multiply the repulsion by rho^2 (Ge and Cui)"))

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return U and its gradient at (x, y)."""
        dx, dy = x - self.world.goal[0], y - self.world.goal[1]
        rho2 = dx * dx + dy * dy
        d, n_x, n_y = self.world.distances(x, y)
        inverse = 1.0 / np.maximum(d, TOUCHING)
        excess = np.maximum(inverse - 1.0 / self.influence_distance, 0.0)
        push = excess * inverse * inverse
        push_x, push_y = over_rows(push, n_x), over_rows(push, n_y)
        repulsion = 0.5 * self.k_repulsive * over_rows(excess, excess)
        scale = rho2 if self.goal_scaled else 1.0
        pull = self.k_attractive + (2.0 * repulsion if self.goal_scaled else 0.0)
        weight = self.k_repulsive * scale
        return Field(
            phi=0.5 * self.k_attractive * rho2 + scale * repulsion,
            g_x=pull * dx - weight * push_x,
            g_y=pull * dy - weight * push_y,
        )

    def attraction(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the gradient of k_a rho^2 / 2."""
        goal_x, goal_y = self.world.goal
        return self.k_attractive * (x - goal_x), self.k_attractive * (y - goal_y)

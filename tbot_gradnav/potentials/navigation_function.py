# SPDX-License-Identifier: Apache-2.0
"""The navigation function of Koditschek and Rimon, in logarithms."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tbot_gradnav.errors import ParameterError
from tbot_gradnav.parameters import Number, field
from tbot_gradnav.potentials.field import Field, Potential
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import TOUCHING, column, over_rows


@dataclass(frozen=True)
class NavigationFunction(Potential):
    """psi = gamma / (gamma^k + B)^(1/k), gamma = |x - goal|^2, B the product of all beta_i.

    beta_i = |x - c_i|^2 - r_i^2 for an obstacle and r_0^2 - |x - c_0|^2 for the boundary, radii
    inflated by the robot's. With d_i the distance to either, beta_i = d_i (2 r_i + s_i d_i),
    s_i = 1 outside an obstacle and -1 inside the boundary. Products and powers overflow, so
    everything is done with logarithms: with chi = log gamma - (1/k) sum log beta_i,

        grad psi = psi w grad chi,   w = B / (gamma^k + B),

    and gamma grad chi = 2 (x - goal) - (gamma/k) sum grad beta_i / beta_i is well conditioned
    where psi rounds to 1. Rimon and Koditschek, IEEE Trans. Robotics and Automation 8(5), 1992.
    """

    advice: ClassVar[str] = "a larger navigation_function.k"

    k: float = field(
        8.0, Number("exponent; 0: the smallest integer that `gradnav check` accepts", at_least=0.0)
    )

    def __post_init__(self) -> None:
        """Check k, and that the world is bounded; find k where it is 0."""
        super().__post_init__()
        if not self.world.bounded:
            raise ParameterError(
                "boundary.radius", 0.0, "potential navigation_function needs a boundary"
            )

        if self.k == 0.0:
            object.__setattr__(self, "k", self._certified_k())

    def _certified_k(self) -> float:
        from tbot_gradnav.certify import smallest_k  # which itself tries out potentials

        k = smallest_k(self.world)
        if k is None:
            raise ParameterError("k", 0, "no k leaves the goal as the only minimum in this world")
        return float(k)

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return psi and its gradient at (x, y)."""
        dx, dy = x - self.world.goal[0], y - self.world.goal[1]
        gamma = np.maximum(dx * dx + dy * dy, 1e-300)
        d, n_x, n_y = self.world.distances(x, y)
        d = np.maximum(d, TOUCHING)
        size, side = column(self.world.size, x), column(self.world.side, x)
        to_centre = size + side * d
        beta = d * (size + to_centre)
        steepness = to_centre / beta  # |grad beta_i| / (2 beta_i)
        log_gamma = np.log(gamma)
        ratio = np.log(beta).sum(axis=0) - self.k * log_gamma  # log(B / gamma^k)
        total = np.logaddexp(0.0, ratio)  # log(1 + B / gamma^k)
        weight = 2.0 * gamma / self.k
        return Field(
            phi=np.exp(-total / self.k),
            g_x=2.0 * dx - weight * over_rows(steepness, n_x),
            g_y=2.0 * dy - weight * over_rows(steepness, n_y),
            scale=np.exp(ratio - total - total / self.k - log_gamma),  # psi w / gamma
        )

    def attraction(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the part of grad log gamma in grad psi; that of the log beta_i is the rest."""
        scale, (goal_x, goal_y) = self(x, y).scale, self.world.goal
        return 2.0 * scale * (x - goal_x), 2.0 * scale * (y - goal_y)

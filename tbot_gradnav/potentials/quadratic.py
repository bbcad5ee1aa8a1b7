# SPDX-License-Identifier: Apache-2.0
"""The quadratic potential, whose gradient is the position itself."""

from dataclasses import dataclass
from typing import ClassVar

from tbot_gradnav.potentials.field import Field, Potential
from tbot_gradnav.unicycle import Floats


@dataclass(frozen=True)
class Quadratic(Potential):
    """phi = rho^2 / 2: mu = rho and gamma = alpha. It knows of no obstacles."""

    repels: ClassVar[bool] = False

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return phi and its gradient at (x, y)."""
        dx, dy = x - self.world.goal[0], y - self.world.goal[1]
        return Field(0.5 * (dx * dx + dy * dy), dx, dy)

    def attraction(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the gradient, which is nothing else."""
        return self(x, y).gradient

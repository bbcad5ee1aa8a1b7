# SPDX-License-Identifier: Apache-2.0
"""What a potential is and what it returns."""

from abc import ABC, abstractmethod
from copy import copy
from dataclasses import dataclass, fields
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.elementwise import larger
from tbot_gradnav.parameters import Checked
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import World


class Field(NamedTuple):
    """Value and gradient of a potential at some points.

    The gradient is scale * (g_x, g_y) with scale > 0. A potential whose gradient may be too
    small for a float, though its direction is well defined, keeps the two apart.
    """

    phi: Floats
    g_x: Floats
    g_y: Floats
    scale: Floats = 1.0

    @property
    def gradient(self) -> tuple[Floats, Floats]:
        """The gradient (d phi/dx, d phi/dy) [1/m]."""
        return self.scale * self.g_x, self.scale * self.g_y

    @property
    def polar(self) -> tuple[Floats, Floats, Floats]:
        """The gradient as its norm mu and its unit direction, which is (0, 0) where it vanishes."""
        norm = (self.g_x * self.g_x + self.g_y * self.g_y) ** 0.5
        inverse = 1.0 / larger(norm, 1e-150)
        return self.scale * norm, self.g_x * inverse, self.g_y * inverse


class Points(NamedTuple):
    """Points (x, y) [m] in the world frame."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]


NOTHING = Points(np.empty(0), np.empty(0))


@dataclass(frozen=True)
class Potential(Checked, ABC):
    """A potential of the robot's position in a world, smooth and least at the goal.

    A subclass is a frozen dataclass too; its further fields are its gains, made with
    `parameters.field`, and are what a user sets in a parameter file.
    """

    advice: ClassVar[str] = "another potential"  # for a robot stuck in a minimum

    repels: ClassVar[bool] = True  # whether it is largest on obstacles and boundary

    looks: ClassVar[bool] = False  # whether it repels from what the lidar of one robot sees

    borrows: ClassVar[tuple[str, ...]] = ()  # potentials whose gains it takes, having none itself

    world: World

    def seeing(self, points: Points) -> Self:
        """Return the same potential with these points seen by the lidar."""
        other = copy(self)  # with whatever is cached
        object.__setattr__(other, "_seen", points)
        return other

    def all_seen(self) -> Self:
        """Return the same potential as if the lidar had seen all there is."""
        other = copy(self)
        object.__setattr__(other, "_revealed", True)
        return other

    @property
    def revealed(self) -> bool:
        """Whether all there is counts as seen."""
        return "_revealed" in self.__dict__

    @property
    def seen(self) -> Points:
        """What the lidar sees."""
        points: Points = self.__dict__.get("_seen", NOTHING)
        return points

    def room(self, x: Floats, y: Floats) -> Floats:
        """Return how far [m] a robot at (x, y) is from the nearest thing the potential knows."""
        return self.world.clearance(x, y)

    def attraction(self, x: Floats, y: Floats) -> tuple[Floats, Floats] | None:
        """Return the part of the gradient that leads to the goal, the rest being repulsion.

        None where the potential has no such parts.
        """
        return None

    def reaches(self, x: Floats, y: Floats) -> NDArray[np.bool_]:
        """Return whether there is a way from (x, y) to the goal, as far as the potential knows."""
        return np.ones(np.broadcast_shapes(np.shape(x), np.shape(y)), dtype=bool)

    @property
    def ready(self) -> bool:
        """Whether a call would return at once."""
        return True

    def prepare(self) -> None:
        """Begin, in the background, what takes longer than a control period."""

    def worded(self, name: str) -> str:
        """Return the potential's name with its gains, for people."""
        named = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "world"}
        gains = [f"{k} {v if isinstance(v, str) else format(v, 'g')}" for k, v in named.items()]
        return f"{name} ({', '.join(gains)})" if gains else name

    @abstractmethod
    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return value and gradient at (x, y) [m] in the world frame; floats or arrays."""

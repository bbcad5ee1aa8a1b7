# SPDX-License-Identifier: Apache-2.0
"""The world a robot moves in: a goal, obstacles, a boundary, and how far away they are."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import ParameterError
from tbot_gradnav.parameters import Checked, Number, field
from tbot_gradnav.unicycle import Floats

TOUCHING = 1e-9  # [m] potentials see a robot at or inside an obstacle this far outside: led out


@dataclass(frozen=True)
class Circle(Checked):
    """A circular obstacle."""

    x: float = field(0.0, Number("centre", "m"))
    y: float = field(0.0, Number("centre", "m"))
    radius: float = field(0.0, Number("radius", "m", above=0.0))


@dataclass(frozen=True)
class Boundary(Checked):
    """The disc that the robot must not leave."""

    x: float = field(0.0, Number("centre of the boundary", "m"))
    y: float = field(0.0, Number("centre of the boundary", "m"))
    radius: float = field(
        0.0, Number("radius of the boundary; 0: there is none", "m", at_least=0.0)
    )


class Distances(NamedTuple):
    """How far the robot is from everything; first axis: the obstacles, then the boundary if any.

    d: distance [m] from the robot's disc, negative where it overlaps; (n_x, n_y): its gradient,
    the unit vector pointing away.
    """

    d: NDArray[np.float64]
    n_x: NDArray[np.float64]
    n_y: NDArray[np.float64]


@dataclass(frozen=True)
class World:
    """A goal (x, y) [m] among obstacles, for a robot of some radius [m].

    The laws steer a point, so obstacles and boundary are inflated by the robot's radius.
    Raises ParameterError where obstacles overlap or lie outside the boundary.
    """

    goal: tuple[float, float] = (0.0, 0.0)
    obstacles: Mapping[str, Circle] = dataclasses.field(default_factory=dict)
    boundary: Boundary = dataclasses.field(default_factory=Boundary)
    robot_radius: float = 0.0

    def __post_init__(self) -> None:
        """Check that the obstacles are apart and inside."""
        if self.bounded and self.boundary.radius <= self.robot_radius:
            raise ParameterError(
                "boundary.radius",
                self.boundary.radius,
                f"must be above robot_radius {self.robot_radius:g}, or 0 for none",
            )
        self._refuse_overlaps()

    @property
    def bounded(self) -> bool:
        """Whether there is a boundary."""
        return self.boundary.radius > 0.0

    @cached_property
    def size(self) -> NDArray[np.float64]:
        """Inflated radius [m] of each circle in `distances`."""
        radii = [circle.radius + self.robot_radius for circle in self.obstacles.values()]
        return np.array(radii + [self.boundary.radius - self.robot_radius] * self.bounded)

    @cached_property
    def side(self) -> NDArray[np.float64]:
        """+1 for each obstacle, which is kept out of, -1 for the boundary, which is kept inside."""
        return np.array([1.0] * len(self.obstacles) + [-1.0] * self.bounded)

    @cached_property
    def _centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        centres = [(c.x, c.y) for c in self.obstacles.values()]
        centres += [(self.boundary.x, self.boundary.y)] * self.bounded
        x, y = np.array(centres).reshape(-1, 2).T
        return x, y

    def distances(self, x: Floats, y: Floats) -> Distances:
        """Return the distances of a robot at (x, y) [m] from obstacles and boundary."""
        c_x, c_y, size, side = (
            column(values, x) for values in (*self._centres, self.size, self.side)
        )
        dx, dy = x - c_x, y - c_y
        to_centre = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-150)
        outward = side / to_centre
        return Distances(side * (to_centre - size), dx * outward, dy * outward)

    def clearance(self, x: Floats, y: Floats) -> Floats:
        """Return the distance [m] to the nearest obstacle or boundary, inf where there is none."""
        nearest: Floats = np.min(self.distances(x, y).d, axis=0, initial=np.inf)
        return nearest

    def refuse_occupied(self, name: str, x: float, y: float) -> None:
        """Raise ParameterError about parameter `name` unless a robot at (x, y) touches nothing."""
        if self.side.size == 0:
            return
        d = self.distances(x, y).d
        worst = int(np.argmin(d))
        if d[worst] <= 0.0:
            inside = worst < len(self.obstacles)
            what = (
                f"inside obstacles.{list(self.obstacles)[worst]}"
                if inside
                else "outside the boundary"
            )
            raise ParameterError(
                name,
                [x, y],
                f"a robot of radius {self.robot_radius:g} there is {what} ({-d[worst]:.3g} m deep)",
            )

    def _refuse_overlaps(self) -> None:
        names = list(self.obstacles)
        circles = np.array([(c.x, c.y, c.radius) for c in self.obstacles.values()]).reshape(-1, 3)
        x, y, radius = circles.T
        apart = np.hypot(x[:, None] - x, y[:, None] - y) - radius[:, None] - radius
        for i, j in np.argwhere(np.tril(apart <= 0.0, -1)):
            raise ParameterError(
                f"obstacles.{names[i]}",
                circles[i].tolist(),
                f"it overlaps obstacles.{names[j]} by {-apart[i, j]:.3g} m",
            )
        if self.bounded:
            from_centre = np.hypot(x - self.boundary.x, y - self.boundary.y)
            for (i,) in np.argwhere(from_centre - radius >= self.boundary.radius):
                raise ParameterError(
                    f"obstacles.{names[i]}", circles[i].tolist(), "it lies outside the boundary"
                )


def column(values: NDArray[np.float64], like: Floats) -> NDArray[np.float64]:
    """Return one value an obstacle, shaped to broadcast against the robots of `like`."""
    return values.reshape((-1,) + (1,) * np.ndim(like))

# SPDX-License-Identifier: Apache-2.0
"""The world a robot moves in: a goal, obstacles, a boundary, and how far away they are."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import ParameterError
from tbot_gradnav.parameters import Checked, Choice, Number, Numbers, field
from tbot_gradnav.shapes import Circle, Polygon, Shape, outward, refuse_unless_convex
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.walls import Walls

Array = NDArray[np.float64]

TOUCHING = 1e-9  # [m] potentials see a robot at or inside an obstacle this far outside: led out


@dataclass(frozen=True)
class Boundary(Checked):
    """The convex region that the robot must not leave: a disc, or a room with straight walls."""

    x: float = field(0.0, Number("centre of a circle", "m"))
    y: float = field(0.0, Number("centre of a circle", "m"))
    radius: float = field(0.0, Number("radius of a circle; 0: there is none", "m", at_least=0.0))
    shape: str = field("circle", Choice("shape of the boundary", ("circle", "polygon")))
    points: tuple[float, ...] = field((), Numbers("corners of a polygon, x y x y ...", "m", rows=2))

    def __post_init__(self) -> None:
        """Check that a polygon is convex."""
        super().__post_init__()
        if self.shape == "polygon":
            refuse_unless_convex(self.points)

    @property
    def exists(self) -> bool:
        """Whether there is a boundary at all."""
        return self.shape == "polygon" or self.radius > 0.0

    @property
    def region(self) -> Shape:
        """What is enclosed, as a shape."""
        if self.shape == "polygon":
            return Polygon(self.points)
        return Circle(self.x, self.y, self.radius)


class Distances(NamedTuple):
    """How far the robot is from everything; the first axis is that of the rows of a World.

    d: distance [m] from the robot's disc, negative where it overlaps; (n_x, n_y): its gradient,
    the unit vector pointing away.
    """

    d: Array
    n_x: Array
    n_y: Array


@dataclass(frozen=True)
class World:
    """A goal (x, y) [m] among obstacles, for a robot of some radius [m].

    The laws steer a point, so obstacles and boundary are inflated by the robot's radius. There is
    a row for each circle (a circular boundary the last of them), each other obstacle, each
    wall of a room, and one for all walls of a map. Raises ParameterError where obstacles overlap
    or lie outside the boundary.
    """

    goal: tuple[float, float] = (0.0, 0.0)
    obstacles: Mapping[str, Shape] = dataclasses.field(default_factory=dict)
    boundary: Boundary = dataclasses.field(default_factory=Boundary)
    robot_radius: float = 0.0
    walls: Walls | None = None  # of a map

    def __post_init__(self) -> None:
        """Check that the obstacles are apart and inside."""
        region = self.boundary.region.size if self.bounded else math.inf
        if region <= self.robot_radius:
            raise ParameterError(
                "boundary.radius",
                self.boundary.radius,
                f"must be above robot_radius {self.robot_radius:g}, or 0 for none",
            )
        self._refuse_overlaps()

    @property
    def bounded(self) -> bool:
        """Whether there is a boundary."""
        return self.boundary.exists

    @cached_property
    def size(self) -> Array:
        """A length [m] of each row: the inflated radius of a circle or of a disc as large."""
        inflated = [shape.size + self.robot_radius for shape in (*self._circles, *self._others)]
        disc = [self.boundary.radius - self.robot_radius] * self._disc
        walls = [self.boundary.region.size] * len(self._walls[0]) if self._room else []
        n = len(self._circles)
        mapped = [self.walls.size] if self.walls else []
        return np.array([*inflated[:n], *disc, *inflated[n:], *walls, *mapped])

    @cached_property
    def side(self) -> Array:
        """+1 for each row that is kept out of, -1 for a disc kept inside, 0 for a straight wall."""
        walls = [0.0] * len(self._walls[0]) if self._room else []
        mapped = [1.0] if self.walls else []
        others = [1.0] * len(self._others)
        return np.array([1.0] * len(self._circles) + [-1.0] * self._disc + others + walls + mapped)

    @cached_property
    def names(self) -> list[str]:
        """What each row is, for people."""
        circles = [f"obstacles.{n}" for n, s in self.obstacles.items() if isinstance(s, Circle)]
        others = [f"obstacles.{n}" for n, s in self.obstacles.items() if not isinstance(s, Circle)]
        walls = ["the boundary"] * len(self._walls[0]) if self._room else []
        mapped = ["a wall of the map, or what is unknown or beyond it"] if self.walls else []
        return [*circles, *(["the boundary"] * self._disc), *others, *walls, *mapped]

    def distances(self, x: Floats, y: Floats) -> Distances:
        """Return the distances of a robot at (x, y) [m] from obstacles and boundary."""
        rows = self._from_circles(x, y)
        if self._only_circles:
            return rows
        found = [shape.distance(x, y) for shape in self._others]
        mapped = [self.walls.distance(x, y)] if self.walls else []
        blocks = [rows, *(self._inflated(*distance) for distance in found)]
        if self._room:
            blocks.append(self._from_walls(x, y))
        blocks += [self._inflated(*distance) for distance in mapped]
        return Distances(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))

    def clearance(self, x: Floats, y: Floats) -> Floats:
        """Return the distance [m] to the nearest obstacle or boundary, inf where there is none."""
        d = self._to_circles(x, y) if self._only_circles else self.distances(x, y).d
        nearest: Floats = np.min(d, axis=0, initial=np.inf)
        return nearest

    def refuse_occupied(self, name: str, x: float, y: float) -> None:
        """Raise ParameterError about parameter `name` unless a robot at (x, y) touches nothing."""
        if self.side.size == 0:
            return
        d = self.distances(x, y).d
        worst = int(np.argmin(d))
        if d[worst] <= 0.0:
            side = "inside" if self.side[worst] > 0.0 else "outside"
            raise ParameterError(
                name,
                [x, y],
                f"a robot of radius {self.robot_radius:g} there is {side} {self.names[worst]} "
                f"({-d[worst]:.3g} m deep)",
            )

    def gap(self, a: Shape, b: Shape) -> float:
        """Return the distance [m] between two obstacles of true size, negative if they overlap.

        To the spacing of points along the outlines, where they are not both circles.
        """
        if isinstance(a, Circle) and isinstance(b, Circle):
            return math.hypot(a.x - b.x, a.y - b.y) - a.radius - b.radius
        return float(min(np.min(a.distance(*b.outline).d), np.min(b.distance(*a.outline).d)))

    def room_around(self, shape: Shape) -> float:
        """Return the distance [m] of an obstacle of true size from the boundary."""
        if isinstance(shape, Circle) and self._disc:
            return (
                self.boundary.radius
                - math.hypot(shape.x - self.boundary.x, shape.y - self.boundary.y)
                - shape.radius
            )
        return float(np.min(-np.asarray(self.boundary.region.distance(*shape.outline).d)))

    @cached_property
    def _circles(self) -> list[Circle]:
        return [shape for shape in self.obstacles.values() if isinstance(shape, Circle)]

    @cached_property
    def _others(self) -> list[Shape]:
        return [shape for shape in self.obstacles.values() if not isinstance(shape, Circle)]

    @property
    def _only_circles(self) -> bool:
        return not (self._others or self._room or self.walls)

    @property
    def _disc(self) -> bool:
        return self.bounded and self.boundary.shape == "circle"

    @property
    def _room(self) -> bool:
        return self.boundary.shape == "polygon"

    @cached_property
    def _circular(self) -> tuple[Array, Array, Array, Array]:
        """Centre x, y, size and side of the rows of circles."""
        centres = [(c.x, c.y) for c in self._circles]
        centres += [(self.boundary.x, self.boundary.y)] * self._disc
        x, y = np.array(centres).reshape(-1, 2).T
        return x, y, self.size[: x.size], self.side[: x.size]

    @cached_property
    def _walls(self) -> tuple[Array, Array, Array]:
        """Inward normals (n_x, n_y) and offsets c of the walls: d = n_x x + n_y y + c."""
        region = self.boundary.region
        if not isinstance(region, Polygon):
            raise AssertionError("only a room has walls")
        n_x, n_y = -outward(region.corners).T
        c = -(n_x * region.corners[:, 0] + n_y * region.corners[:, 1]) - self.robot_radius
        return n_x, n_y, c

    def _to_circles(self, x: Floats, y: Floats) -> Array:
        """Return the distances from circles without their gradients, in half the time."""
        c_x, c_y, size, side = (column(values, x) for values in self._circular)
        d = _lengths(x - c_x, y - c_y)
        d -= size
        d *= side
        return d

    def _from_circles(self, x: Floats, y: Floats) -> Distances:
        c_x, c_y, size, side = (column(values, x) for values in self._circular)
        dx, dy = x - c_x, y - c_y
        d = _lengths(dx, dy)
        away = side / np.maximum(d, 1e-150)
        d -= size
        d *= side
        return Distances(d, dx * away, dy * away)

    def _inflated(self, d: Floats, n_x: Floats, n_y: Floats) -> Distances:
        """Return the row of what is at a distance from the robot's centre."""
        return Distances(*(np.asarray(part)[None] for part in (d - self.robot_radius, n_x, n_y)))

    def _from_walls(self, x: Floats, y: Floats) -> Distances:
        n_x, n_y, c = (column(values, x) for values in self._walls)
        d = n_x * x + n_y * y + c
        return Distances(d, np.broadcast_to(n_x, d.shape), np.broadcast_to(n_y, d.shape))

    def _refuse_overlaps(self) -> None:
        self._refuse_overlapping_circles()
        named = list(self.obstacles.items())
        for i, (name, a) in enumerate(named):
            for other, b in named[:i]:
                both_round = isinstance(a, Circle) and isinstance(b, Circle)
                if not both_round and (gap := self.gap(a, b)) <= 0.0:
                    raise _overlap(name, a, other, gap)
            if self.bounded and self.room_around(a) <= -2.0 * a.size:
                raise ParameterError(
                    f"obstacles.{name}", list(a.centre), "it lies outside the boundary"
                )

    def _refuse_overlapping_circles(self) -> None:
        """Do so for all pairs at once, since there may be a thousand."""
        names = [name for name, shape in self.obstacles.items() if isinstance(shape, Circle)]
        circles = np.array([(c.x, c.y, c.radius) for c in self._circles]).reshape(-1, 3)
        x, y, radius = circles.T
        apart = np.hypot(x[:, None] - x, y[:, None] - y) - radius[:, None] - radius
        for i, j in np.argwhere(np.tril(apart <= 0.0, -1)):
            raise _overlap(names[i], self._circles[i], names[j], float(apart[i, j]))


def _lengths(x: Array, y: Array) -> Array:
    """Return the lengths of vectors."""
    squares = x * x + y * y
    return np.sqrt(squares, out=squares)  # in place: faster for thousands of robots


def _overlap(name: str, a: Shape, other: str, gap: float) -> ParameterError:
    return ParameterError(
        f"obstacles.{name}", list(a.centre), f"it overlaps obstacles.{other} by {-gap:.3g} m"
    )


def column(values: NDArray[np.float64], like: Floats) -> NDArray[np.float64]:
    """Return one value an obstacle, shaped to broadcast against the robots of `like`."""
    return values if isinstance(like, float) else values.reshape((-1,) + (1,) * np.ndim(like))


def over_rows(a: Array, b: Array) -> Floats:
    """Return the sum of a b over the rows of a world, which are the first axis of both."""
    if a.ndim == 1:
        return float(a @ b)
    total: Array = np.einsum("i...,i...->...", a, b)
    return total

# SPDX-License-Identifier: Apache-2.0
"""Whether a world is sound: the critical points of its potential, found and counted.

What is found here is numerical evidence, not proof. One thing can be checked against theory: for
a potential that rises towards obstacles and boundary, minima plus maxima minus saddles make the
Euler characteristic of the free space, 1 - (number of obstacles) where they are apart
(Poincare-Hopf; Koditschek and Rimon, Advances in Applied Mathematics 11, 1990).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.free_space import NOWHERE, components
from tbot_gradnav.potentials import Map, NavigationFunction, Potential
from tbot_gradnav.simulate import extent
from tbot_gradnav.world import World

Array = NDArray[np.float64]

GRIDS = (201, 401, 801)  # points a side; a finer one where the count disagrees with theory
CHUNK = 1_000_000  # points times obstacles evaluated at once
DIFFERENCE = 1e-6  # [m] for the Hessian
NEWTON_STEPS = 60
CONVERGED = 1e-9  # [m] of the last Newton step
DEGENERATE = 1e-9  # ratio of the Hessian's eigenvalues
SAME = 1e-4  # [m] nearer points are one
AT_GOAL = 1e-3  # [m] where a minimum must be to be the goal
LARGEST_K = 1024
UNBOUNDED_MARGIN = 1.0  # [m] beyond the obstacles, where there is no boundary
BASIN_GRID = 61  # points a side
BASIN_STEP = 0.01  # [m]


@dataclass(frozen=True)
class CriticalPoint:
    """A point (x, y) [m] where the gradient vanishes: a minimum, saddle, maximum or degenerate."""

    x: float
    y: float
    kind: str


@dataclass(frozen=True)
class Landscape:
    """The critical points of a potential, and whether their number agrees with theory.

    `agrees` is None where theory says nothing, because inflated obstacles overlap.
    """

    potential: Potential
    points: list[CriticalPoint]
    agrees: bool | None
    tolerance: float  # [m] a minimum nearer to the goal is the goal

    @property
    def minima(self) -> list[CriticalPoint]:
        """All minima."""
        return [p for p in self.points if p.kind == "minimum"]

    @property
    def spurious(self) -> list[CriticalPoint]:
        """The minima that are not the goal."""
        return [p for p in self.minima if not self._is_goal(p)]

    @property
    def goal_is_minimum(self) -> bool:
        """Whether there is a minimum at the goal."""
        return any(self._is_goal(p) for p in self.minima)

    def _is_goal(self, point: CriticalPoint) -> bool:
        goal_x, goal_y = self.potential.world.goal
        return bool(np.hypot(point.x - goal_x, point.y - goal_y) <= self.tolerance)


def landscape(potential: Potential, tolerance: float = AT_GOAL) -> Landscape:
    """Return the critical points of a potential in the free space of its world.

    A minimum within `tolerance` [m] of the goal is taken for the goal.
    """
    expected = None if overlaps(potential.world) else 1 - len(potential.world.obstacles)
    points: list[CriticalPoint] = []
    for side in GRIDS:
        points = _critical_points(potential, side)
        index = sum({"saddle": -1, "degenerate": 0}.get(p.kind, 1) for p in points)
        if expected is None or index == expected:
            break
    agrees = None if expected is None else index == expected
    return Landscape(potential, points, agrees, tolerance)


def on_lattice(potential: Map, tolerance: float = AT_GOAL) -> Landscape:
    """Return the minima of a potential on a map's lattice; it has no others."""
    pits = zip(*(values.tolist() for values in potential.pits), strict=True)
    points = [CriticalPoint(x, y, "minimum") for x, y in (potential.world.goal, *pits)]
    return Landscape(potential, points, None, tolerance)


def smallest_k(world: World) -> int | None:
    """Return the smallest integer k for which psi has no minimum but the goal.

    By doubling and bisection, so on the assumption that a larger k never brings a minimum back.
    None where there is none up to LARGEST_K.
    """

    def sound(k: int) -> bool:
        found = landscape(NavigationFunction(world, float(k)))
        return found.goal_is_minimum and not found.spurious

    low, high = 0, 1
    while not sound(high):
        low, high = high, 2 * high
        if high > LARGEST_K:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if sound(middle) else (middle, high)
    return high


def basins(found: Landscape) -> tuple[Array, Array, NDArray[np.intp]]:
    """Return points (x, y) [m] over the free space and the index of the minimum each flows to.

    The flow is that of a holonomic point along -grad phi; -1 where it reaches none.
    """
    world = found.potential.world
    x, y = (values.ravel() for values in _grid(world, BASIN_GRID))
    free = np.greater(world.clearance(x, y), 0.0)
    x, y = x[free], y[free]
    owner = np.full(x.size, -1)
    now_x, now_y, flowing = x.copy(), y.copy(), np.arange(x.size)
    minima = np.array([(p.x, p.y) for p in found.minima]).reshape(-1, 2)
    for _ in range(round(6.0 * extent(world)[2] / BASIN_STEP)):
        if flowing.size == 0 or minima.size == 0:
            break
        _, u_x, u_y = found.potential(now_x[flowing], now_y[flowing]).polar
        now_x[flowing] -= BASIN_STEP * u_x
        now_y[flowing] -= BASIN_STEP * u_y
        apart = np.hypot(now_x[flowing] - minima[:, :1], now_y[flowing] - minima[:, 1:])
        nearest = np.argmin(apart, axis=0)
        home = apart[nearest, np.arange(flowing.size)] < 2.0 * BASIN_STEP
        owner[flowing[home]] = nearest[home]
        flowing = flowing[~home]
    return x, y, owner


def overlaps(world: World) -> list[tuple[str, str, float]]:
    """Return the pairs of obstacles that overlap after inflation, and their true gap [m].

    The boundary counts as the obstacle of this name.
    """
    named, width = list(world.obstacles.items()), 2.0 * world.robot_radius
    found = []
    for i, (name, a) in enumerate(named):
        gaps = [(other, name, world.gap(a, b)) for other, b in named[:i]]
        if world.bounded:
            gaps.append(("boundary", name, world.room_around(a)))
        found += [pair for pair in gaps if pair[2] <= width]
    return found


def cut_off(world: World) -> float:
    """Return the share of the free area, on a grid, from which there is no way to the goal."""
    x, y = _grid(world, GRIDS[-1])
    rows = _few_rows(world, x)
    part = components(np.concatenate([world.clearance(x[few], y[few]) for few in rows]) > 0.0)
    away = np.where(part == NOWHERE, np.inf, np.hypot(x - world.goal[0], y - world.goal[1]))
    home = part.flat[np.argmin(away)]
    return float(np.mean(part[part != NOWHERE] != home))


def _critical_points(potential: Potential, side: int) -> list[CriticalPoint]:
    """Find the cells where both components of the gradient change sign; polish by Newton."""
    x, y = _grid(potential.world, side)
    clearance, g_x, g_y = _sampled(potential, x, y)
    cell = _any(clearance > 0.0) & _changes_sign(g_x) & _changes_sign(g_y)
    spacing = float(x[0, 1] - x[0, 0])
    found = _newton(
        potential,
        x[:-1, :-1][cell] + 0.5 * spacing,
        y[:-1, :-1][cell] + 0.5 * spacing,
        spacing,
    )
    return [_classified(potential, *point) for point in _distinct(*found)]


def _newton(potential: Potential, x: Array, y: Array, spacing: float) -> tuple[Array, Array]:
    """Return where Newton's method for grad phi = 0 converges from (x, y), near there and free."""
    from_x, from_y, residue = x, y, np.full_like(x, np.inf)
    for _ in range(NEWTON_STEPS):
        (a, b), (c, d) = _hessian(potential, x, y)
        field = potential(x, y)
        determinant = a * d - b * c
        determinant = np.where(determinant == 0.0, 1e-300, determinant)
        dx = (d * field.g_x - b * field.g_y) / determinant
        dy = (a * field.g_y - c * field.g_x) / determinant
        residue = np.hypot(dx, dy)
        limit = np.minimum(1.0, 0.5 * spacing / np.maximum(residue, 1e-300))
        x, y = x - limit * dx, y - limit * dy
    good = (
        (residue < CONVERGED)
        & (np.hypot(x - from_x, y - from_y) < 4.0 * spacing)
        & np.greater(potential.world.clearance(x, y), 0.0)
    )
    return x[good], y[good]


def _hessian(potential: Potential, x: Array, y: Array) -> tuple[tuple[Array, Array], ...]:
    """Return the Jacobian of (g_x, g_y), which at a critical point is the Hessian over scale."""
    right, left = potential(x + DIFFERENCE, y), potential(x - DIFFERENCE, y)
    above, below = potential(x, y + DIFFERENCE), potential(x, y - DIFFERENCE)
    step = 2.0 * DIFFERENCE
    return (
        (np.asarray(right.g_x - left.g_x) / step, np.asarray(above.g_x - below.g_x) / step),
        (np.asarray(right.g_y - left.g_y) / step, np.asarray(above.g_y - below.g_y) / step),
    )


def _distinct(x: Array, y: Array) -> Iterator[tuple[float, float]]:
    """Yield each point once."""
    seen: list[tuple[float, float]] = []
    for point in zip(x.tolist(), y.tolist(), strict=True):
        if all(np.hypot(point[0] - a, point[1] - b) > SAME for a, b in seen):
            seen.append(point)
            yield point


def _classified(potential: Potential, x: float, y: float) -> CriticalPoint:
    hessian = np.array(_hessian(potential, np.array(x), np.array(y)))
    low, high = np.linalg.eigvalsh(0.5 * (hessian + hessian.T))
    if min(abs(low), abs(high)) < DEGENERATE * max(abs(low), abs(high)):
        return CriticalPoint(x, y, "degenerate")
    kind = "minimum" if low > 0.0 else "maximum" if high < 0.0 else "saddle"
    return CriticalPoint(x, y, kind)


def _grid(world: World, side: int) -> tuple[Array, Array]:
    c_x, c_y, radius = extent(world)
    radius += 0.0 if world.bounded else UNBOUNDED_MARGIN
    # not symmetric, so that no critical point of a symmetric world lies on a line of the grid
    x, y = np.meshgrid(
        c_x + np.linspace(-1.0123 * radius, 1.0071 * radius, side),
        c_y + np.linspace(-1.0057 * radius, 1.0139 * radius, side),
    )
    return x, y


def _sampled(potential: Potential, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return clearance, g_x and g_y on a grid."""
    out = np.empty((3, *x.shape))
    for few in _few_rows(potential.world, x):
        field = potential(x[few], y[few])
        out[:, few] = potential.world.clearance(x[few], y[few]), field.g_x, field.g_y
    return out[0], out[1], out[2]


def _few_rows(world: World, x: Array) -> Iterator[slice]:
    """Yield a few rows of a grid at a time, to spare memory."""
    rows = max(1, CHUNK // (x.shape[1] * (len(world.obstacles) + 1)))
    for i in range(0, len(x), rows):
        yield slice(i, i + rows)


def _changes_sign(g: Array) -> NDArray[np.bool_]:
    return _any(g >= 0.0) & _any(g <= 0.0)


def _any(corner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each cell of a grid whether it holds at any of its corners."""
    return corner[:-1, :-1] | corner[:-1, 1:] | corner[1:, :-1] | corner[1:, 1:]

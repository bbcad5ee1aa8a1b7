# SPDX-License-Identifier: Apache-2.0
"""Where a robot can be in a map, and from where it can get where."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.lattice import Lattice
from tbot_gradnav.shapes import Shape
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.walls import Walls
from tbot_gradnav.world import Boundary, World

Array = NDArray[np.float64]
Cells = NDArray[np.bool_]
Labels = NDArray[np.intp]

MARGIN = 0.1  # of a cell, by which a node must be clear
NEAR = 3  # cells within which a robot that is nowhere is looked for
NOWHERE = -1
ASIDE = np.mgrid[-NEAR : NEAR + 1, -NEAR : NEAR + 1].reshape(2, -1)  # columns and rows


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The nodes of a map's lattice: how clear a robot is there, and which nodes hang together.

    clearance [m]: of the robot's disc, of shape (rows, columns).
    """

    lattice: Lattice
    clearance: Array

    @cached_property
    def free(self) -> Cells:
        """Whether each node is free: clear, and a corner of a square of four that are.

        Ways lead along such squares and from one to the next across a common side, so that they
        are everywhere wide enough for a robot to turn back from their edges. Where the side
        between two free nodes has a free square on neither hand, both are given up.
        """
        free, before = self.clearance >= MARGIN * self.lattice.spacing, None
        while before is None or np.any(free != before):
            before = free
            square = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
            free = _touched(square, 1, 1)
            across = free[:, :-1] & free[:, 1:] & ~_touched(square, 1, 0)
            along = free[:-1] & free[1:] & ~_touched(square, 0, 1)
            free = free & ~_touched(across, 0, 1) & ~_touched(along, 1, 0)
        return free

    @cached_property
    def part(self) -> Labels:
        """A number for each node, the same for all that hang together along rows and columns."""
        return components(self.free)

    def part_at(self, x: Floats, y: Floats) -> NDArray[np.intp]:
        """Return the part that the nearest free node to each point (x, y) [m] belongs to."""
        _, _, part = self.nearest(x, y)
        return part

    def nearest(self, x: Floats, y: Floats) -> tuple[Array, Array, NDArray[np.intp]]:
        """Return distance [m] from, index (flat) and part of the nearest free node to points.

        Within NEAR cells; inf and NOWHERE where there is none.
        """
        lattice = self.lattice
        u, w = (np.asarray(part)[..., None] for part in lattice.place(x, y))
        i, j = np.rint(u).astype(np.intp) + ASIDE[0], np.rint(w).astype(np.intp) + ASIDE[1]
        inside = (i >= 0) & (i < lattice.columns) & (j >= 0) & (j < lattice.rows)
        index = np.where(inside, j * lattice.columns + i, 0)
        away = np.where(inside & self.free.reshape(-1)[index], np.hypot(u - i, w - j), np.inf)
        least = np.argmin(away, axis=-1)[..., None]
        away, index = (np.take_along_axis(part, least, -1)[..., 0] for part in (away, index))
        part = np.where(np.isfinite(away), self.part.reshape(-1)[index], NOWHERE)
        return lattice.spacing * away, index, part


def _touched(marked: Cells, rows: int, columns: int) -> Cells:
    """Return a larger array, marked where any was that lies up to so many rows and columns back."""
    found = np.pad(marked, ((0, rows), (0, columns)))
    for i in range(rows + 1):
        for j in range(columns + 1):
            found |= np.pad(marked, ((i, rows - i), (j, columns - j)))
    return found


def free_space(world: World) -> FreeSpace:
    """Return the free space of a world with walls, whatever its goal; the last few are kept."""
    if world.walls is None:
        raise AssertionError("only a world with walls has a lattice")
    obstacles = tuple(world.obstacles.items())
    return _free_space(world.walls, obstacles, world.boundary, world.robot_radius)


@lru_cache(maxsize=4)
def _free_space(
    walls: Walls, obstacles: tuple[tuple[str, Shape], ...], boundary: Boundary, radius: float
) -> FreeSpace:
    x, y = walls.lattice.nodes
    clearance = walls.depth - radius
    if obstacles or boundary.exists:
        others = World((0.0, 0.0), dict(obstacles), boundary, radius)
        clearance = np.minimum(clearance, others.clearance(x, y))
    return FreeSpace(walls.lattice, clearance)


def blocked(space: FreeSpace, x: Array, y: Array, robot_radius: float, ample: float) -> FreeSpace:
    """Return a free space with points (x, y) [m] in it, as far as a clearance of `ample` [m]."""
    lattice, clearance = space.lattice, space.clearance.copy()
    reach = int(np.ceil((ample + robot_radius) / lattice.spacing)) + 1
    aside = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1)
    u, w = (np.asarray(part)[:, None] for part in lattice.place(x, y))
    i, j = np.rint(u).astype(np.intp) + aside[0], np.rint(w).astype(np.intp) + aside[1]
    inside = (i >= 0) & (i < lattice.columns) & (j >= 0) & (j < lattice.rows)
    away = lattice.spacing * np.hypot(u - i, w - j) - robot_radius
    np.minimum.at(clearance, (j[inside], i[inside]), away[inside])
    return FreeSpace(lattice, clearance)


def components(free: Cells) -> Labels:
    """Return a number for each connected component of a grid, NOWHERE where it is not free.

    Each round hangs every tree of nodes below the lowest root that it touches, then flattens all.
    """
    root = np.arange(free.size)
    index = root.reshape(free.shape)
    across, along = free[:-1] & free[1:], free[:, :-1] & free[:, 1:]
    a = np.concatenate([index[:-1][across], index[:, :-1][along]])
    b = np.concatenate([index[1:][across], index[:, 1:][along]])
    while a.size:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        np.minimum.at(root, high, low)
        while np.any((flat := root[root]) != root):
            root = flat
        apart = root[a] != root[b]
        a, b = a[apart], b[apart]
    return np.where(free, root.reshape(free.shape), NOWHERE)

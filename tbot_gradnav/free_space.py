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
    def free(self) -> NDArray[np.bool_]:
        """Whether each node is free: clear, and with three others a corner of a free square.

        So a way is at least a cell wide everywhere, room for a robot to turn back from its sides.
        """
        clear = self.clearance >= MARGIN * self.lattice.spacing
        square = clear[:-1, :-1] & clear[:-1, 1:] & clear[1:, :-1] & clear[1:, 1:]
        free = np.zeros_like(clear)
        for rows in (slice(None, -1), slice(1, None)):
            for columns in (slice(None, -1), slice(1, None)):
                free[rows, columns] |= square
        return free

    @cached_property
    def part(self) -> Labels:
        """A number for each node, the same for all that hang together along rows and columns."""
        return _components(self.free)

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


def _components(free: NDArray[np.bool_]) -> Labels:
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

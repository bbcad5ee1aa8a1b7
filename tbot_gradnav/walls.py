# SPDX-License-Identifier: Apache-2.0
"""The walls of a map: how far away they are."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.lattice import Lattice
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.shapes import Distance
from tbot_gradnav.unicycle import Floats

Array = NDArray[np.float64]
Cells = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Walls:
    """All that is not free in a map: occupied cells, unknown ones, and what lies beyond the map.

    Distances are exact at the centres of cells and interpolated between: exact before straight
    walls along the grid, to about a fifth of a cell elsewhere. Raises GradnavError for a map
    without a free cell.
    """

    occupancy: Occupancy

    def __post_init__(self) -> None:
        """Check that a robot could be somewhere."""
        if not self.occupancy.free.any():
            raise GradnavError("no cell of the map is free")

    def distance(self, x: Floats, y: Floats) -> Distance:
        """Return the distance of points (x, y) [m], negative in a wall; its gradient has norm 1.

        But for where several walls are as near: there it is shorter.
        """
        return Distance(*self.lattice.sampled(self.depth, x, y, beyond=-1.0))

    @property
    def size(self) -> float:
        """Radius [m] of a disc as large as what is free."""
        return self.occupancy.resolution * float(np.sqrt(self.free.sum() / np.pi))

    @property
    def corners(self) -> tuple[Array, Array]:
        """The corners (x, y) [m] of the rectangle, turned like the map, that holds all free cells.

        Counter-clockwise.
        """
        right, top = self.lattice.columns - 1.5, self.lattice.rows - 1.5
        return self.lattice.world(
            np.array([0.5, right, right, 0.5]), np.array([0.5, 0.5, top, top])
        )

    @cached_property
    def lattice(self) -> Lattice:
        """The centres of the cells from which distances are interpolated."""
        rows, columns = self._extent
        cells = Lattice(*self.occupancy.origin, self.occupancy.resolution, 1, 1)
        x, y = cells.world(columns.start - 0.5, rows.start - 0.5)
        size = rows.stop - rows.start + 2, columns.stop - columns.start + 2
        return Lattice(float(x), float(y), self.occupancy.yaw, self.occupancy.resolution, *size)

    @cached_property
    def free(self) -> Cells:
        """Whether the cell about each node of the lattice is free; those of its rim are not."""
        return np.pad(self.occupancy.free[self._extent], 1)

    @cached_property
    def depth(self) -> Array:
        """Distance [m] of each node from the walls, negative in them."""
        return self.occupancy.resolution * (_from_cells(~self.free) - _from_cells(self.free))

    @cached_property
    def _extent(self) -> tuple[slice, slice]:
        """The rows and columns that hold all free cells."""
        rows, columns = (np.flatnonzero(self.occupancy.free.any(axis=axis)) for axis in (1, 0))
        return (
            slice(int(rows[0]), int(rows[-1]) + 1),
            slice(int(columns[0]), int(columns[-1]) + 1),
        )


@lru_cache(maxsize=4)
def walls(occupancy: Occupancy) -> Walls:
    """Return the walls of a map, the same for the same."""
    return Walls(occupancy)


def _from_cells(marked: Cells) -> Array:
    """Return the distance from each cell's centre to the nearest marked cell, a square of side 1.

    First along the columns, then the least of the sums of squares along the rows; exact.
    """
    away = _along_columns(marked)
    column: Array = away * away
    nearest = column.copy()
    for k in range(1, marked.shape[1]):
        aside = (k - 0.5) ** 2
        if aside >= nearest.max():
            break
        np.minimum(nearest[:, k:], column[:, :-k] + aside, out=nearest[:, k:])
        np.minimum(nearest[:, :-k], column[:, k:] + aside, out=nearest[:, :-k])
    return np.sqrt(nearest)


def _along_columns(marked: Cells) -> Array:
    """Return the distance within its column from each cell's centre to the nearest marked cell."""
    row = np.arange(len(marked), dtype=float)[:, None]
    below = np.maximum.accumulate(np.where(marked, row, -np.inf), axis=0)
    above = np.minimum.accumulate(np.where(marked, row, np.inf)[::-1], axis=0)[::-1]
    away: Array = np.maximum(np.minimum(row - below, above - row) - 0.5, 0.0)
    return away

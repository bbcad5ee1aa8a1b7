# SPDX-License-Identifier: Apache-2.0
"""Occupancy grids, as map_server's files and nav_msgs/OccupancyGrid hold them."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.unicycle import Pose, has_heading, heading

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
LIMIT = 50  # a cell this probably occupied [%], or unknown, is not free
LARGEST = 16_000_000  # cells
FINEST, COARSEST = 1e-3, 10.0  # [m] sides of a cell


@dataclass(frozen=True, eq=False)
class Occupancy:
    """A grid of square cells: 0 (free) to 100 (occupied), or -1 where that is unknown.

    cells: int8 of shape (rows, columns), the first row lowest; resolution [m] is a cell's side;
    x, y [m] and yaw [rad]: the lower left corner of the first cell, and how the grid is turned.
    Raises GradnavError for what cannot be a map.
    """

    cells: NDArray[np.int8]
    resolution: float
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        """Check sizes and numbers."""
        if not FINEST <= self.resolution <= COARSEST:
            raise GradnavError(
                f"resolution {self.resolution:g} m is not allowed; must be from {FINEST:g} to "
                f"{COARSEST:g}"
            )
        if not all(math.isfinite(value) and abs(value) <= 1e6 for value in self.origin):
            raise GradnavError(f"origin {list(self.origin)} is not allowed; must be 3 numbers")
        refuse_size(*reversed(self.cells.shape))

    @classmethod
    def of(cls, message: Any) -> "Occupancy":
        """Return the grid of a nav_msgs/OccupancyGrid. Raises GradnavError."""
        info, origin = message.info, message.info.origin
        cells = np.asarray(message.data, dtype=np.int8)
        if cells.size != info.width * info.height:
            raise GradnavError(
                f"{cells.size} cells are not the {info.width} x {info.height} the map speaks of"
            )
        q_z, q_w = origin.orientation.z, origin.orientation.w
        turned = math.isfinite(q_z + q_w) and has_heading(q_z, q_w)
        yaw = Pose(0.0, 0.0, *heading(q_z, q_w)).theta if turned else 0.0
        return cls(
            cells.reshape(info.height, info.width),
            round(info.resolution, 9),  # a float32 in the message
            origin.position.x,
            origin.position.y,
            float(yaw),
        )

    @property
    def origin(self) -> tuple[float, float, float]:
        """x, y [m] and yaw [rad]."""
        return self.x, self.y, self.yaw

    def is_like(self, other: "Occupancy") -> bool:
        """Return whether another grid says the same of the same places."""
        same = self.resolution == other.resolution and self.origin == other.origin
        return same and np.array_equal(self.cells, other.cells)

    @property
    def worded(self) -> str:
        """Its size, for people."""
        rows, columns = self.cells.shape
        return f"{columns} x {rows} cells of {self.resolution:g} m"

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """Whether each cell is free; an unknown one is not."""
        return (self.cells >= FREE) & (self.cells < LIMIT)


def refuse_size(columns: int, rows: int) -> None:
    """Raise GradnavError for a grid without cells or with too many."""
    if columns < 1 or rows < 1 or columns * rows > LARGEST:
        raise GradnavError(
            f"{columns} x {rows} cells are not allowed; must be at least 1 and at most {LARGEST}"
        )

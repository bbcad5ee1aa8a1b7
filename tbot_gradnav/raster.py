# SPDX-License-Identifier: Apache-2.0
"""A potential as an image."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.potentials import Potential
from tbot_gradnav.simulate import extent

CELLS = 200  # along a side
TAKEN = 100  # where the robot cannot be


class Raster(NamedTuple):
    """Levels of a potential in square cells of `resolution` [m].

    The first has its corner at (x, y). A free cell's level, 0 to 99, is the share of the free cells
    that lie lower, in per cent: it shows the basins of a potential that is flat over most of its
    range as well as of any other.
    """

    x: float
    y: float
    resolution: float
    levels: NDArray[np.int8]  # of shape (CELLS, CELLS), a row for each y


def raster(potential: Potential) -> Raster:
    """Return the potential over its whole world."""
    c_x, c_y, radius = extent(potential.world)
    resolution = 2.0 * radius / CELLS
    along = np.asarray((np.arange(CELLS) + 0.5) * resolution - radius, dtype=np.float64)
    phi, clearance = np.empty((CELLS, CELLS)), np.empty((CELLS, CELLS))
    for row, offset in enumerate(along):  # one at a time: a thousand obstacles fit in memory
        x, y = c_x + along, np.full(CELLS, c_y + offset)
        phi[row], clearance[row] = potential(x, y).phi, potential.room(x, y)
    free = clearance > 0.0
    levels = np.full((CELLS, CELLS), TAKEN, dtype=np.int8)
    lower = np.searchsorted(np.sort(phi[free]), phi[free])
    levels[free] = 100 * lower // max(lower.size, 1)
    return Raster(c_x - radius, c_y - radius, resolution, levels)

# SPDX-License-Identifier: Apache-2.0
"""What the lidar has seen and not yet seen gone."""

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.lidar import Sweep
from tbot_gradnav.potentials.field import Points
from tbot_gradnav.unicycle import Pose

CELL = 0.05  # [m] returns within a square of this side are one point
REACH = 4.0  # [m] from the robot, beyond which nothing is remembered
BEHIND = 0.1  # [m] a beam that goes this much further has looked through a point
MISSES = 3  # sweeps in a row that look through a point, after which it is gone
MEMORY = 30.0  # [s] for a point that is not seen, because it is hidden ...
TOO_NEAR = 10.0  # [s] ... or nearer than the lidar measures; less than it takes to be stuck

Array = NDArray[np.float64]


class Sightings:
    """Points in the world, each the mean of the last sweep's returns in its cell.

    A point is forgotten when three sweeps in a row look through it, when it was not seen for half a
    minute (ten seconds, if it would be too near to be seen), or when it is far away.
    """

    def __init__(self) -> None:
        self._cell = np.empty(0, dtype=np.int64)
        self._x, self._y = np.empty(0), np.empty(0)
        self._seen = np.empty(0)  # [s] stamp of the sweep
        self._misses = np.empty(0, dtype=np.int64)
        self._last = np.nan  # [s] stamp of the last sweep

    @property
    def points(self) -> Points:
        """What is there, as far as is known."""
        return Points(self._x, self._y)

    def update(self, sweep: Sweep, lidar: Pose, driving: bool = True) -> None:
        """Take note of a sweep from the lidar's pose in the world.

        Nothing is forgotten for its age but while `driving`: somebody may stand too near to be
        seen before a robot that waits.
        """
        cell, x, y = _gathered(sweep.points(lidar))
        unseen = ~np.isin(self._cell, cell)  # what the sweep does not see again
        distance = np.hypot(self._x - lidar.x, self._y - lidar.y)
        too_near = distance <= sweep.reach[0] + BEHIND
        self._misses[unseen] += self._looked_through(sweep, lidar, distance, too_near)[unseen]
        memory = np.where(too_near, TOO_NEAR, MEMORY)
        if not driving and self._seen.size:
            self._seen[unseen] += sweep.stamp - self._last
        self._last = sweep.stamp
        recent = np.abs(sweep.stamp - self._seen) <= memory
        kept = unseen & (self._misses < MISSES) & recent & (distance <= REACH)
        self._cell = np.append(self._cell[kept], cell)
        self._x, self._y = np.append(self._x[kept], x), np.append(self._y[kept], y)
        self._seen = np.append(self._seen[kept], np.full(cell.size, sweep.stamp))
        self._misses = np.append(self._misses[kept], np.zeros(cell.size, dtype=np.int64))

    def _looked_through(
        self, sweep: Sweep, lidar: Pose, distance: Array, too_near: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return whether the sweep sees what is behind a point, or that nothing is there.

        Of what is too near, that nothing comes back says nothing.
        """
        in_lidar = lidar.inverse().compose(Pose(self._x, self._y, 1.0, 0.0))
        range_there = sweep.along(np.arctan2(in_lidar.y, in_lidar.x))
        telling = np.isfinite(range_there) | (~too_near & (distance < sweep.reach[1] - BEHIND))
        return telling & (range_there > distance + BEHIND)


def _gathered(points: Points) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the cells in which there are points, and the mean of each cell's points."""
    i = np.floor(points.x / CELL).astype(np.int64)
    j = np.floor(points.y / CELL).astype(np.int64)
    cell, which, count = np.unique(i * 2**32 + j, return_inverse=True, return_counts=True)
    x = np.bincount(which, points.x, cell.size) / count
    y = np.bincount(which, points.y, cell.size) / count
    return cell, x, y

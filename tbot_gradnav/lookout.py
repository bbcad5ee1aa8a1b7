# SPDX-License-Identifier: Apache-2.0
"""The lidars of many simulated robots in one world, and what each remembers."""

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.fake_lidar import LIDARS, SWEEP_PERIOD, FakeLidar
from tbot_gradnav.potentials.field import ABSENT, Points
from tbot_gradnav.settings import Settings
from tbot_gradnav.sightings import Sightings
from tbot_gradnav.unicycle import Pose


class Lookout:
    """N robots that see what their world holds, five times a second, without noise."""

    def __init__(self, settings: Settings, n: int) -> None:
        self._lidar = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_02"], 0.0, 0.0, 0)
        self._sightings = [Sightings() for _ in range(n)]
        self._next = 0.0  # [s] when the lidars have turned once more

    def look(self, now: float, pose: Pose, robots: NDArray[np.intp]) -> None:
        """Sweep, where it is time at `now` [s], from the poses of these of the robots."""
        if now < self._next:
            return
        self._next += SWEEP_PERIOD
        for i, *components in zip(robots, *np.asarray(pose), strict=True):
            at = Pose(*map(float, components))
            self._sightings[i].update(self._lidar.sweep(now, at), at.compose(self._lidar.mount))

    def seen_by(self, robots: NDArray[np.intp]) -> Points:
        """Return what these of the robots remember, a column each."""
        seen = [self._sightings[i].points for i in robots]
        shape = max((points.x.size for points in seen), default=0), len(seen)
        x, y = np.full(shape, ABSENT), np.full(shape, ABSENT)
        for i, points in enumerate(seen):
            x[: points.x.size, i], y[: points.y.size, i] = points
        return Points(x, y)

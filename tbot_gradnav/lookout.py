# SPDX-License-Identifier: Apache-2.0
"""A simulated robot's lidar, and what the robot remembers of it."""

import numpy as np

from tbot_gradnav.fake_lidar import LIDARS, SWEEP_PERIOD, FakeLidar
from tbot_gradnav.potentials import Points
from tbot_gradnav.settings import Settings
from tbot_gradnav.sightings import Sightings
from tbot_gradnav.unicycle import Pose


class Lookout:
    """What one robot sees of its world, five times a second, without noise."""

    def __init__(self, settings: Settings) -> None:
        self._lidar = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_02"], 0.0, 0.0, 0)
        self._sightings = Sightings()
        self._next = 0.0  # [s] when the lidar has turned once more

    def look(self, now: float, pose: Pose) -> Points | None:
        """Return what there is, as far as is known; None where nothing is new at `now` [s]."""
        if now < self._next:
            return None
        self._next += SWEEP_PERIOD
        x, y, cos, sin = (float(np.squeeze(component)) for component in pose)
        at = Pose(x, y, cos, sin)
        self._sightings.update(self._lidar.sweep(now, at), at.compose(self._lidar.mount))
        return self._sightings.points

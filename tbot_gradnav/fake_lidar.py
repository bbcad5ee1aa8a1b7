# SPDX-License-Identifier: Apache-2.0
"""A lidar for those without one: rays cast in a world."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.lidar import LDS_02_RANGE, Sweep
from tbot_gradnav.unicycle import Pose
from tbot_gradnav.world import World

SWEEP_PERIOD = 0.2  # [s] both lidars turn five times a second
CLOSE = 1e-3  # [m] a ray this near something has hit it
STEPS = 80  # of a ray at most


@dataclass(frozen=True)
class Model:
    """How a lidar publishes: its range [m] as published and in truth, beams, and a missing one."""

    published: tuple[float, float]
    true: tuple[float, float]
    beams: tuple[int, int]  # least and most in a sweep
    missing: float


# hls_lfcd_lds_driver, ld08_driver (2300 measurements a second, speed not quite constant)
LIDARS = {
    "lds_01": Model((0.12, 3.5), (0.12, 3.5), (360, 360), 0.0),
    "lds_02": Model((0.0, 100.0), LDS_02_RANGE, (450, 470), math.nan),
}


class FakeLidar:
    """The lidar of a simulated robot: rays cast in the world as it is."""

    def __init__(
        self, world: World, ahead: float, model: Model, noise: float, dropout: float, seed: int
    ) -> None:
        """Take how far ahead of the robot's centre it is [m] and how it errs.

        noise: standard deviation of a range [m]; dropout: share of beams that are lost.
        """
        self.see_in(world)
        self._mount = Pose(ahead, 0.0, 1.0, 0.0)
        self._model, self._noise, self._dropout = model, noise, dropout
        self._rng = np.random.default_rng(seed)

    def see_in(self, world: World) -> None:
        """Look around in this world from now on."""
        self._world = replace(world, robot_radius=0.0)  # obstacles at their true size

    def sweep(self, stamp: float, robot: Pose) -> Sweep:
        """Return what is published at the robot's pose in the world, all beams at one time."""
        model, rng, lidar = self._model, self._rng, robot.compose(self._mount)
        n = int(rng.integers(model.beams[0], model.beams[1] + 1))
        increment = 2.0 * math.pi / n
        angle: NDArray[np.float64] = increment * np.arange(n)
        ray = lidar.compose(Pose.at(0.0, 0.0, angle))
        ranges = cast(self._world, ray, model.true[1])
        ranges = ranges + self._noise * rng.normal(size=n)
        lost = rng.random(n) < self._dropout
        valid = (ranges >= model.true[0]) & (ranges <= model.true[1]) & ~lost
        ranges = np.where(valid, ranges, model.missing)
        return Sweep(stamp, 0.0, increment, *model.published, ranges)


def cast(world: World, ray: Pose, reach: float) -> NDArray[np.float64]:
    """Return how far [m] rays go, each from its pose along its heading; inf beyond `reach`.

    A ray may go on as far as nothing is near (sphere tracing), whatever shapes there are.
    """
    x, y, cos, sin = np.broadcast_arrays(*np.atleast_1d(*ray))
    r = np.zeros(x.shape)
    going = np.arange(x.size)
    for _ in range(STEPS):
        at = r[going]
        d = np.asarray(world.clearance(x[going] + at * cos[going], y[going] + at * sin[going]))
        r[going] = at + d
        going = going[(d > CLOSE) & (r[going] <= reach)]
        if going.size == 0:
            break
    return np.where(r <= reach, r, np.inf)

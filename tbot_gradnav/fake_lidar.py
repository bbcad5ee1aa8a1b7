# SPDX-License-Identifier: Apache-2.0
"""A lidar for those without one: rays cast in a world."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.lidar import LDS_02_RANGE, Sweep
from tbot_gradnav.shapes import Cornered, Shape, outward
from tbot_gradnav.unicycle import Pose
from tbot_gradnav.walls import Walls
from tbot_gradnav.world import World

Array = NDArray[np.float64]

SWEEP_PERIOD = 0.2  # [s] both lidars turn five times a second
CLOSE = 1e-3  # [m] a ray this near something has hit it
STEPS = 80  # of a ray at most
COARSE = 6  # of so many points of an outline one is enough: 0.3 mm for a circle of 1 m


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
        self.mount = Pose(ahead, 0.0, 1.0, 0.0)
        self._model, self._noise, self._dropout = model, noise, dropout
        self._rng = np.random.default_rng(seed)

    def see_in(self, world: World) -> None:
        """Look around in this world from now on."""
        self._world = replace(world, robot_radius=0.0)  # obstacles at their true size

    def sweep(self, stamp: float, robot: Pose) -> Sweep:
        """Return what is published at the robot's pose in the world, all beams at one time."""
        model, rng, lidar = self._model, self._rng, robot.compose(self.mount)
        n = int(rng.integers(model.beams[0], model.beams[1] + 1))
        increment = 2.0 * math.pi / n
        angle: Array = increment * np.arange(n, dtype=float)
        ray = lidar.compose(Pose.at(0.0, 0.0, angle))
        ranges = cast(self._world, ray, model.true[1])
        ranges = ranges + self._noise * rng.normal(size=n)
        lost = rng.random(n) < self._dropout
        valid = (ranges >= model.true[0]) & (ranges <= model.true[1]) & ~lost
        ranges = np.where(valid, ranges, model.missing)
        return Sweep(stamp, 0.0, increment, *model.published, ranges)


def cast(world: World, ray: Pose, reach: float) -> Array:
    """Return how far [m] rays go, each from its pose along its heading; inf beyond `reach`."""
    x, y, cos, sin = np.broadcast_arrays(*np.atleast_1d(*ray))
    ray = Pose(x, y, cos, sin)
    r = np.full(x.shape, np.inf)
    for shape in world.obstacles.values():
        enter, leave = _clipped(shape, ray)
        r = np.where((enter <= leave) & (leave > 0.0), np.minimum(r, np.maximum(enter, 0.0)), r)
    if world.bounded:
        r = np.minimum(r, np.maximum(_clipped(world.boundary.region, ray)[1], 0.0))
    if world.walls is not None:
        r = np.minimum(r, _marched(world.walls, ray, reach))
    return np.where(r <= reach, r, np.inf)


def _clipped(shape: Shape, ray: Pose) -> tuple[Array, Array]:
    """Return where rays enter a convex shape, by the edges of its outline, and where they leave."""
    if isinstance(shape, Cornered):
        corners = shape.corners
    else:
        corners = np.stack(shape.outline, axis=1)[:-1:COARSE]  # the last point is the first
    n_x, n_y = outward(corners).T[:, :, None]
    depth = n_x * (corners[:, :1] - ray.x) + n_y * (corners[:, 1:] - ray.y)
    approach = n_x * ray.cos + n_y * ray.sin
    with np.errstate(divide="ignore", invalid="ignore"):
        r = depth / approach
    parallel = np.where(depth >= 0.0, -np.inf, np.inf)  # to an edge: within its line, or out of it
    enter = np.where(approach < 0.0, r, np.where(approach == 0.0, parallel, -np.inf))
    leave = np.where(approach > 0.0, r, np.inf)
    return enter.max(axis=0), leave.min(axis=0)


def _marched(walls: Walls, ray: Pose, reach: float) -> Array:
    """Return where rays meet the walls of a map: each may go on as far as nothing is near."""
    r = np.zeros(np.shape(ray.x))
    going = np.arange(r.size)
    for _ in range(STEPS):
        x, y, cos, sin = (np.asarray(component)[going] for component in ray)
        d, _, _ = walls.distance(x + r[going] * cos, y + r[going] * sin)
        r[going] += d
        going = going[(d > CLOSE) & (r[going] <= reach)]
        if going.size == 0:
            break
    return r

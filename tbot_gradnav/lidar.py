# SPDX-License-Identifier: Apache-2.0
"""A sweep of the lidar, whatever the lidar publishes."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.potentials.field import Points
from tbot_gradnav.unicycle import Pose

Array = NDArray[np.float64]

# The driver of the LDS-02 publishes a range of 0 to 100 m, whatever the data sheet says.
LDS_02_RANGE = 0.16, 8.0  # [m]
FINEST = 1e-5  # [rad] no lidar has beams nearer to each other
TURNS = 100.0  # [rad] nor counts its angle from further away


class BadScanError(GradnavError):
    """A sweep from which nothing can be had."""


class Sweep(NamedTuple):
    """One turn of a lidar as published: beam i at angle_min + i angle_increment [rad].

    A range [m] that is not finite, or out of the lidar's range, says nothing was measured.
    """

    stamp: float  # [s]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Array

    @classmethod
    def of(cls, message: Any) -> "Sweep":
        """Return what is used of a sensor_msgs/LaserScan. Raises BadScanError."""
        stamp = message.header.stamp
        sweep = cls(
            stamp.sec + stamp.nanosec * 1e-9,
            message.angle_min,
            message.angle_increment,
            message.range_min,
            message.range_max,
            np.asarray(message.ranges, dtype=float),
        )
        if not (sweep.ranges.size > 0 and 0.0 <= sweep.range_min < sweep.range_max):
            raise BadScanError(
                f"a scan measures nothing: {sweep.ranges.size} beams, range_min "
                f"{sweep.range_min:g}, range_max {sweep.range_max:g}"
            )
        sane = FINEST <= abs(sweep.angle_increment) <= 2.0 * math.pi
        if not (sane and abs(sweep.angle_min) <= TURNS):
            raise BadScanError(
                f"a scan's beams cannot be placed: angle_min {sweep.angle_min:g}, "
                f"angle_increment {sweep.angle_increment:g}"
            )
        return sweep

    @property
    def reach(self) -> tuple[float, float]:
        """The least and the largest range [m] that the lidar really measures."""
        if not self.range_max <= LDS_02_RANGE[1]:
            return LDS_02_RANGE
        return self.range_min, self.range_max

    @property
    def measured(self) -> Array:
        """The ranges [m], inf where nothing was measured."""
        least, largest = self.reach
        valid = (self.ranges >= least) & (self.ranges <= largest)  # not so for nan
        return np.where(valid, self.ranges, np.inf)

    def points(self, lidar: Pose) -> Points:
        """Return what was hit, in the frame in which the lidar's pose is given."""
        hit = np.isfinite(measured := self.measured)
        angle: Array = self.angle_min + self.angle_increment * np.flatnonzero(hit).astype(float)
        ray = lidar.compose(Pose.at(0.0, 0.0, angle))
        return Points(lidar.x + measured[hit] * ray.cos, lidar.y + measured[hit] * ray.sin)

    def along(self, bearing: Array) -> Array:
        """Return the nearest range [m] of the three beams about each bearing [rad].

        inf where they measured nothing, 0 where the lidar has no beam.
        """
        n = self.ranges.size
        turn = math.copysign(2.0 * math.pi, self.angle_increment)
        beam = np.round(((bearing - self.angle_min) % turn) / self.angle_increment).astype(int)
        around = round(abs(turn / self.angle_increment)) - n < 3  # whether the last meets the first
        measured = self.measured
        nearest = np.full(bearing.shape, np.inf)
        for index in (beam - 1, beam, beam + 1):
            inside = (index >= 0) & (index < n)
            there = measured[index % n if around else np.clip(index, 0, n - 1)]
            nearest = np.minimum(nearest, there if around else np.where(inside, there, 0.0))
        return nearest

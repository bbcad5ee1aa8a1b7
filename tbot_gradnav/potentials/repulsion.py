# SPDX-License-Identifier: Apache-2.0
"""Repulsion from points that the lidar sees."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.potentials.field import Points
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import TOUCHING, column

Array = NDArray[np.float64]

P = 8.0  # exponent of the norm over points: nearly the largest, but smooth
NEARLY_ZERO = 1e-150


class Repulsion(NamedTuple):
    """Value and gradient of a repulsion at some points."""

    value: Floats
    x: Floats
    y: Floats


def repulsion(
    seen: Points, x: Floats, y: Floats, robot_radius: float, k: float, d_0: float
) -> Repulsion:
    """Return Khatib's k (1/d - 1/d_0)^2 / 2 for a robot at (x, y) [m] among points seen.

    With e_i = max(1/d_i - 1/d_0, 0) for the distance d_i [m] of point i from the robot's disc,
    1/d - 1/d_0 is here the norm S = (sum e_i^p)^(1/p). It is the e of the nearest point, made
    smooth: how densely the lidar samples a wall hardly matters, nothing needs to be told apart,
    and it is infinite where the robot touches a point.
    """
    dx, dy = x - _rows(seen.x, x), y - _rows(seen.y, x)
    to_point = np.maximum(np.sqrt(dx * dx + dy * dy), NEARLY_ZERO)
    inverse = 1.0 / np.maximum(to_point - robot_radius, TOUCHING)
    excess = np.maximum(inverse - 1.0 / d_0, 0.0)
    largest = np.maximum(np.max(excess, axis=0, initial=0.0), NEARLY_ZERO)
    ratio = excess / largest
    norm = (ratio**P).sum(axis=0) ** (1.0 / P)  # S / largest, at least 1 where anything repels
    weight = (ratio / np.maximum(norm, 1.0)) ** (P - 1.0) * inverse * inverse / to_point
    s = largest * norm
    return Repulsion(
        0.5 * k * s * s,
        -k * s * (weight * dx).sum(axis=0),
        -k * s * (weight * dy).sum(axis=0),
    )


def distance_from(seen: Points, x: Floats, y: Floats) -> Floats:
    """Return the distance [m] of (x, y) from the nearest point seen, inf where there is none."""
    nearest: Floats = np.min(
        np.hypot(x - _rows(seen.x, x), y - _rows(seen.y, x)), axis=0, initial=np.inf
    )
    return nearest


def _rows(points: Array, x: Floats) -> Array:
    """Return points so that they broadcast against x: a new first axis for shape (M,)."""
    return points if points.ndim > 1 else column(points, x)

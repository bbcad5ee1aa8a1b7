# SPDX-License-Identifier: Apache-2.0
"""Repulsion from whatever is near, by its distances."""

from typing import NamedTuple

import numpy as np

from tbot_gradnav.potentials.field import Points
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import TOUCHING, Distances, column

P = 8.0  # exponent of the norm: nearly the largest, but smooth
NEARLY_ZERO = 1e-150


class Repulsion(NamedTuple):
    """Value and gradient (x, y) of a repulsion."""

    value: Floats
    x: Floats
    y: Floats


def repulsion(near: Distances, k: float, d_0: float) -> Repulsion:
    """Return Khatib's k (1/d - 1/d_0)^2 / 2 from all that is near, as if it were one obstacle.

    With e_i = max(1/d_i - 1/d_0, 0), the 1/d - 1/d_0 here is the norm S = (sum e_i^p)^(1/p): that
    of the nearest, made smooth. So how densely a lidar samples a wall hardly matters, its points
    need not be told apart, and it is infinite where anything is touched.
    """
    inverse = 1.0 / np.maximum(near.d, TOUCHING)
    excess = np.maximum(inverse - 1.0 / d_0, 0.0)
    largest = np.maximum(np.max(excess, axis=0, initial=0.0), NEARLY_ZERO)
    ratio = excess / largest
    norm = (ratio**P).sum(axis=0) ** (1.0 / P)  # S / largest, at least 1 where anything repels
    weight = (ratio / np.maximum(norm, 1.0)) ** (P - 1.0) * inverse * inverse
    s = largest * norm
    return Repulsion(
        0.5 * k * s * s,
        -k * s * (weight * near.n_x).sum(axis=0),
        -k * s * (weight * near.n_y).sum(axis=0),
    )


def distances_from(points: Points, x: Floats, y: Floats, robot_radius: float) -> Distances:
    """Return how far a robot at (x, y) [m] is from each point."""
    dx, dy = x - column(points.x, x), y - column(points.y, x)
    to_point = np.maximum(np.sqrt(dx * dx + dy * dy), NEARLY_ZERO)
    return Distances(to_point - robot_radius, dx / to_point, dy / to_point)

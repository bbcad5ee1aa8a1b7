# SPDX-License-Identifier: Apache-2.0
"""Worlds that several tests use, as parameters with dotted names; and ways to make, move and run.

NINE is the arena of the measurements: nine circular obstacles in a disc of radius 4.5 m about the
goal. EMPTY is a goal in the open. FREE removes every limit of the drive. Importing this also makes
hypothesis repeatable and independent of the machine's speed.
"""

import math

import hypothesis
import numpy as np

from tbot_gradnav.controller import Controller
from tbot_gradnav.limits import Limits
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import Pose

hypothesis.settings.register_profile("core", deadline=None, derandomize=True, max_examples=100)
hypothesis.settings.load_profile("core")

OBSTACLES_OF_NINE = (
    (1.6, 0.2, 0.35),
    (-1.4, 1.0, 0.4),
    (0.3, 1.9, 0.35),
    (0.6, -1.6, 0.4),
    (-1.7, -1.2, 0.35),
    (2.6, 2.0, 0.4),
    (-0.4, -3.0, 0.4),
    (-3.0, 0.3, 0.4),
    (2.6, -1.5, 0.35),
)
NAVIGATION_FUNCTION = {"potential": "navigation_function", "navigation_function.k": 8.0}
ATTRACTIVE_REPULSIVE = {
    "potential": "attractive_repulsive",
    "attractive_repulsive.k_repulsive": 0.01,
    "attractive_repulsive.influence_distance": 0.3,
}
FREE = {
    "limits.v": math.inf,
    "limits.omega": math.inf,
    "limits.wheel": math.inf,
    "limits.wheel_floor": 0.0,
}


def obstacles(circles):
    """Return the parameters of obstacles given as (x, y, radius), named o0, o1, ..."""
    values = {"obstacles.names": [f"o{i}" for i in range(len(circles))]}
    for i, (x, y, radius) in enumerate(circles):
        values |= {f"obstacles.o{i}.x": x, f"obstacles.o{i}.y": y, f"obstacles.o{i}.radius": radius}
    return values


def disc(radius, x=0.0, y=0.0):
    """Return the parameters of a boundary."""
    return {"boundary.x": x, "boundary.y": y, "boundary.radius": radius}


EMPTY = {"goal": [0.0, 0.0], "robot_radius": 0.0, "potential": "quadratic"}
NINE = {"goal": [0.0, 0.0], **disc(4.5), **obstacles(OBSTACLES_OF_NINE)}


def controller(*parameters):
    """Return the controller that dictionaries of parameters describe, later ones first."""
    values = {}
    for more in parameters:
        values |= more
    return Controller.of(Settings.of(values))


def assert_sound(v, omega):
    """Check that a command is finite and within the limits of a TurtleBot3."""
    limits = Limits()
    assert math.isfinite(v)
    assert math.isfinite(omega)
    assert abs(v) <= limits.v
    assert abs(omega) <= limits.omega
    assert abs(v) + 0.08 * abs(omega) <= limits.wheel * (1.0 + 1e-12)


def wrapped(angle):
    """Return an angle [rad] brought into [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def row(poses):
    """Return one Pose of arrays from many (x, y, theta)."""
    return Pose.at(*np.array(poses, dtype=float).T)

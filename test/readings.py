# SPDX-License-Identifier: Apache-2.0
"""Odometry messages as tests need them, and what takes them."""

import itertools

import numpy as np
from arenas import ATTRACTIVE_REPULSIVE, NINE

from tbot_gradnav.navigation import Navigation
from tbot_gradnav.odometry import Reading
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import Pose, quaternion, step

PERIOD = 0.05  # [s]
START = Pose.at(1.0, -2.0, 0.5)
GOOD = Reading(0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0)


def close(one, other, tolerance=1e-9):
    return np.allclose(np.array(one, float), np.array(other, float), rtol=0.0, atol=tolerance)


def reading(stamp, pose):
    """Return the odometry message of a pose in the odometry frame."""
    q_z, q_w = quaternion(float(pose.theta))
    return Reading(stamp, float(pose.x), float(pose.y), 0.0, 0.0, q_z, q_w)


def kinds(notices):
    return [notice.kind for notice in notices]


def driving(twist, origin=Pose.at(0.0, 0.0, 0.0)):  # noqa: B008 (a constant)
    """Yield the messages of a robot that keeps a twist, from the origin of its odometry on."""
    for i in itertools.count():
        yield reading(i * PERIOD, step(origin, twist, i * PERIOD))


def navigation(**parameters):
    start = {"initial_pose": [-3.4, -2.2, 2.0]}
    return Navigation(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, **start, **parameters}))


def plant(initial=START, **options):
    return Plant(FakeRobotOptions(**options), initial)

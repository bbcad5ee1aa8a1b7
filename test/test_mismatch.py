# SPDX-License-Identifier: Apache-2.0
"""Robots that are not what the controller takes them for, in the arenas of the measurements."""

import os

import numpy as np
import pytest
from conftest import CONFIG

from tbot_gradnav import shipped
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant
from tbot_gradnav.simulate import random_starts
from tbot_gradnav.unicycle import Pose, Twist, heading, step

STARTS = int(os.environ.get("GRADNAV_STARTS", "8"))  # of each case
TIME_LIMIT = 200.0  # [s]
AFTER = 1.0  # [s] for the last command to take effect

WRONG = {
    "a weak left wheel": {"left_wheel": 0.95},
    "both wheels weak": {"left_wheel": 0.8, "right_wheel": 0.8},
    "late": {"command_latency": 0.3},
    "rare odometry": {"rate": 5.0},
    "drift": {"odometry_drift": 0.02},
    "slip": {"wheel_slip": 0.1},
}
SLOW_TURNS = {"k_omega": 1.0}  # for a robot that obeys late; else it turns to and fro
WRONG["all but slip"] = {k: v for name in list(WRONG)[:-1] for k, v in WRONG[name].items()}


ORIGIN = Pose.at(0.0, 0.0, 0.0)


def after(seconds, twist, **options):
    """Return the true pose and the one that odometry believes, after a time at a twist."""
    robot = Plant(FakeRobotOptions(**options), ORIGIN)
    robot.receive(0.0, twist)
    robot.advance(seconds)
    reading = robot.read()
    return robot.pose, Pose(reading.x, reading.y, *heading(reading.q_z, reading.q_w))


def test_a_weak_wheel_bends_the_path_and_odometry_sees_it():
    truth, believed = after(5.0, Twist(0.1, 0.0), left_wheel=0.95)
    wheels = Twist(0.1 * 0.975, 0.1 * 0.05 / 0.16)
    assert np.allclose(truth, step(ORIGIN, wheels, 5.0))
    assert np.allclose(believed, truth)


def test_slip_takes_its_share_and_odometry_sees_the_heading_only():
    truth, believed = after(5.0, Twist(0.1, 0.2), wheel_slip=0.2)
    assert np.allclose(truth, step(ORIGIN, Twist(0.08, 0.16), 5.0))
    assert np.allclose(believed, step(ORIGIN, Twist(0.1, 0.16), 5.0))


def drive(settings, start, options):
    """Return how it ends and the true positions on the way, shape (2, steps)."""
    track = Navigation(settings)
    robot, period = Plant(options, start), 1.0 / options.rate
    path = []
    for tick in range(round(TIME_LIMIT / period)):
        robot.advance(tick * period)
        path.append((float(robot.pose.x), float(robot.pose.y)))
        robot.receive(tick * period, track.update(robot.read()).twist)
        if track.state is not State.DRIVING:
            break
    robot.advance(tick * period + AFTER)
    return track.state, np.array([*path, (float(robot.pose.x), float(robot.pose.y))]).T


@pytest.mark.parametrize("potential", ["attractive_repulsive", "navigation_function"])
@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG.keys())
def test_every_robot_arrives_in_the_arenas_and_touches_nothing(potential, wrong):
    file = str(CONFIG / f"nine_{potential}.yaml")
    gains = SLOW_TURNS if "command_latency" in wrong else {}
    world = shipped.configuration(file).settings.world
    starts = random_starts(world, STARTS, seed=7)
    for seed in range(STARTS):
        start = Pose(*(part[seed] for part in starts))
        place = [float(start.x), float(start.y), float(start.theta)]
        settings = shipped.configuration(file, gains | {"initial_pose": place}).settings
        state, path = drive(settings, start, FakeRobotOptions(**wrong, seed=seed))
        assert world.clearance(*path).min() > 0.0, place
        assert state is State.ARRIVED, place

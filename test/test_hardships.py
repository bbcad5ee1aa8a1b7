# SPDX-License-Identifier: Apache-2.0
"""The navigation brings home a fake robot that has its troubles."""

import math

import numpy as np
import pytest
from arenas import ATTRACTIVE_REPULSIVE, NINE
from readings import PERIOD

from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.options import FakeRobotOptions
from tbot_gradnav.plant import Plant
from tbot_gradnav.settings import Settings

HARDSHIPS = {
    "ideal": {},
    "quirks": {"driver_quirks": True},
    "latency": {"driver_quirks": True, "command_latency": 0.3},
    "noise": {"driver_quirks": True, "position_noise": 0.01, "heading_noise": 0.03},
}


def drive(settings, options, seconds=200.0, reset_at=-1.0):
    """Drive the fake robot; return the true poses until the navigation says it arrived."""
    track, robot, truth = Navigation(settings), Plant(options, settings.start), []
    for i in range(round(seconds / PERIOD)):
        robot.advance(i * PERIOD)
        truth.append(robot.pose)
        if i == round(reset_at / PERIOD):
            robot.reset_odometry()
        robot.receive(i * PERIOD, track.update(robot.read()).twist)
        if track.state is State.ARRIVED:
            return truth
        if track.state is State.STUCK:
            break
    raise AssertionError(f"it did not arrive but is {track.state}: {robot.pose} after {i} periods")


def is_home(settings, pose, tolerance):
    return math.dist((pose.x, pose.y), settings.goal) <= tolerance


@pytest.mark.parametrize("options", HARDSHIPS.values(), ids=HARDSHIPS.keys())
def test_the_fake_robot_is_brought_home_untouched(options):
    settings = Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "initial_pose": [-3.4, -2.2, 2.0]})
    truth = drive(settings, FakeRobotOptions(**options))
    assert is_home(settings, truth[-1], 0.1)
    x, y = np.array([pose[:2] for pose in truth], float).T
    assert settings.world.clearance(x, y).min() > 0.0


def test_a_reset_of_the_odometry_on_the_way_costs_no_more_than_one_period_of_motion():
    settings = Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "initial_pose": [-3.4, -2.2, 2.0]})
    truth = drive(settings, FakeRobotOptions(), reset_at=8.0)
    at_reset = truth[round(8.0 / PERIOD)]
    to_go = math.hypot(at_reset.x, at_reset.y)
    lost = PERIOD * (settings.limits.v + settings.limits.omega * to_go)
    assert is_home(settings, truth[-1], settings.xy_goal_tolerance + lost)


SLOW = {
    "gains of the paper": {"k_v": 0.1, "k_omega": 0.5, "limits.wheel_floor": 0.0},
    "crawling robot": {"limits.v": 0.009, "limits.wheel": 0.009, "limits.wheel_floor": 0.0},
}


@pytest.mark.parametrize("slow", SLOW.values(), ids=SLOW.keys())
def test_a_robot_that_is_slow_but_on_its_way_is_not_stuck(slow):
    start = {"goal": [0.0, 0.0], "initial_pose": [0.5, 0.0, 3.0], "xy_goal_tolerance": 0.02}
    law = {"law": "position", "speed_shaping": "exponential"}
    settings = Settings.of({**start, **law, **slow})
    assert is_home(settings, drive(settings, FakeRobotOptions())[-1], 0.02)


@pytest.mark.parametrize("law", ["position", "heading", "descent"])
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
def test_the_fake_robot_with_quirks_arrives_though_it_faces_exactly_away(law, auto_reverse):
    """The driver cuts turning speeds below 0.01 rad/s to zero."""
    settings = Settings.of(
        {
            "law": law,
            "auto_reverse": auto_reverse,
            "potential": "quadratic",
            "goal": [0.0, 0.0],
            "initial_pose": [1.0, 0.0, 0.0],
        }
    )
    truth = drive(settings, FakeRobotOptions(driver_quirks=True))
    assert is_home(settings, truth[-1], 0.05)

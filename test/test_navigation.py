# SPDX-License-Identifier: Apache-2.0
"""What the navigation makes of odometry: commands, arrival, new goals, and being stuck."""

import math

import numpy as np
from arenas import ATTRACTIVE_REPULSIVE, NINE
from readings import GOOD, PERIOD, kinds, navigation, reading

from tbot_gradnav.limits import Limits
from tbot_gradnav.navigation import STUCK_TIME, Navigation, State
from tbot_gradnav.odometry import BadOdometryError, Reading
from tbot_gradnav.settings import Settings
from tbot_gradnav.unicycle import STOP, Pose

TINY, HUGE, UNREAL = (1e-9, 5e-324, 1e-300), (1e9, 1e308, -1e308), (math.nan, math.inf, -math.inf)
AWKWARD = np.array([0.0, -0.0, 1.0, -1.0, 0.5, 1e6, -1e6, *TINY, *HUGE, *UNREAL])


def garbage(n, seed):
    """Yield n messages of awkward and of ordinary numbers, some of them good."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        values = rng.normal(scale=3.0, size=7)
        awkward = rng.random(7) < rng.choice([0.0, 0.1, 0.5])
        values[awkward] = rng.choice(AWKWARD, size=awkward.sum())
        yield Reading(*values.tolist())


def test_10000_messages_of_garbage_end_in_a_command_within_the_limits_or_a_bad_odometry():
    drive, counts = Limits(), {"commands": 0, "bad": 0}
    track = navigation()
    for message in garbage(10_000, seed=0):
        try:
            v, omega = track.update(message).twist
        except BadOdometryError:
            counts["bad"] += 1
            continue
        counts["commands"] += 1
        assert math.isfinite(v)
        assert math.isfinite(omega)
        assert abs(v) <= drive.v
        assert abs(omega) <= drive.omega
        assert abs(v) + 0.08 * abs(omega) <= drive.wheel * (1.0 + 1e-12)
        if track.state is not State.DRIVING:
            track.restart()
    assert min(counts.values()) > 1000


def test_without_a_goal_there_is_no_command():
    track = Navigation(Settings.of({}))
    assert track.update(GOOD).twist is None
    assert track.state is State.IDLE


def test_a_robot_that_arrived_stays_put_and_says_so_once():
    track = navigation(initial_pose=[0.02, 0.0, 0.0])
    told = []
    for place in (0.0, 0.08, 0.3):  # pushed away afterwards, slowly
        outcome = track.update(reading(place * 20.0, Pose.at(place, 0.0, 0.0)))
        assert outcome.twist == STOP
        told += [kind for kind in kinds(outcome.notices) if kind == "arrived"]
    assert track.state is State.ARRIVED
    assert told == ["arrived"]


def test_a_new_goal_starts_a_new_drive_from_where_the_robot_is():
    track = navigation(initial_pose=[0.0, 0.0, 0.0])
    assert track.update(GOOD).twist == STOP
    track.change(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "goal": [0.5, 0.0]}))
    assert track.state is State.DRIVING
    assert track.update(GOOD._replace(stamp=PERIOD)).twist.v > 0.0


def test_other_settings_for_the_same_goal_do_not_forget_the_arrival():
    track = navigation(initial_pose=[0.0, 0.0, 0.0])
    track.update(GOOD)
    track.change(Settings.of({**NINE, **ATTRACTIVE_REPULSIVE, "k_v": 0.4}))
    assert track.state is State.ARRIVED


def test_the_gear_is_kept_for_a_whole_drive():
    """A robot turned round by hand after it set out forward does not change to backward."""
    track = navigation(initial_pose=[0.5, 0.0, math.pi])
    assert track.update(reading(0.0, Pose.at(0.0, 0.0, 0.0))).twist.v > 0.0
    half_round = [Pose.at(0.0, 0.0, angle) for angle in np.arange(0.0, math.pi, 0.2)]
    for i, pose in enumerate(half_round):
        outcome = track.update(reading((1 + i) * 0.2, pose))
        assert outcome.twist.v >= 0.0
        assert outcome.notices == []


def standing(track, seconds, since=0.0):
    """Feed a navigation the odometry of a robot that does not move; return the last outcome."""
    for i in range(round(seconds / PERIOD) + 1):
        outcome = track.update(GOOD._replace(stamp=since + i * PERIOD))
    return outcome


def test_a_robot_that_gets_nowhere_is_stuck_and_stands():
    track = navigation()
    assert standing(track, STUCK_TIME - 1.0).twist != STOP
    assert track.state is State.DRIVING
    assert standing(track, 2.0, since=STUCK_TIME - 1.0).twist == STOP
    assert track.state is State.STUCK


def test_a_robot_that_is_stuck_says_so_once_and_in_one_line():
    track, told = navigation(), []
    for i in range(1000):
        told += track.update(GOOD._replace(stamp=i * PERIOD)).notices
    assert kinds(told) == ["stuck"]
    assert len(told[0].text.splitlines()) == 1


def test_a_robot_that_was_stuck_tries_again_with_other_settings():
    track = navigation()
    standing(track, STUCK_TIME + 1.0)
    other = {**NINE, **ATTRACTIVE_REPULSIVE, "k_v": 0.4, "initial_pose": [-3.4, -2.2, 2.0]}
    track.change(Settings.of(other))
    assert track.state is State.DRIVING
    assert standing(track, 1.0, since=STUCK_TIME + 1.0).twist != STOP


def test_time_without_odometry_is_not_time_spent_stuck():
    track = navigation()
    for i in range(10):
        assert standing(track, 3.0, since=i * 100.0).twist != STOP

# SPDX-License-Identifier: Apache-2.0
"""The robot behind the fake driver: arcs, quirks, latency, timeouts and noise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from readings import PERIOD, START, close, plant

from tbot_gradnav.limits import Limits
from tbot_gradnav.plant import driven
from tbot_gradnav.unicycle import STOP, Pose, Twist, step


def decoded(message):
    return Pose.at(message.x, message.y, 2.0 * math.atan2(message.q_z, message.q_w))


def test_a_command_moves_the_robot_along_its_arc():
    robot, twist = plant(), Twist(0.1, 0.5)
    robot.receive(0.0, twist)
    for i in range(41):
        robot.advance(i * PERIOD)
    assert close(robot.pose, step(START, twist, 2.0))
    assert close(robot.twist, twist)


@given(
    commands=st.lists(
        st.tuples(st.floats(0.0, 0.5), st.floats(-0.2, 0.2), st.floats(-2, 2)), max_size=20
    )
)
def test_without_noise_and_drift_odometry_is_the_truth(commands):
    robot, now = plant(), 0.0
    for dt, v, omega in commands:
        robot.receive(now, Twist(v, omega))
        now += dt
        robot.advance(now)
        assert close(START.compose(decoded(robot.read())), robot.pose)
        assert robot.read().stamp == pytest.approx(now)


@pytest.mark.parametrize(
    ("commanded", "expected"),
    [
        (Twist(0.019, 0.019), Twist(0.01, 0.01)),
        (Twist(-0.019, -0.019), Twist(-0.01, -0.01)),
        (Twist(0.009, -0.009), Twist(0.0, 0.0)),
        (Twist(0.125, 0.0), Twist(0.12, 0.0)),
        (Twist(5.0, 0.0), Twist(0.2108, 0.0)),
        (Twist(0.0, -9.0), Twist(0.0, -2.635)),
        (Twist(1e300, -1e300), Twist(0.2108, -2.635)),
    ],
)
def test_the_driver_cuts_towards_zero_and_clamps(commanded, expected):
    assert close(driven(commanded), expected, 1e-12)


def test_with_quirks_the_robot_drives_what_the_driver_leaves():
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(0.019, -0.519))
    robot.advance(1.0)
    assert close(robot.twist, Twist(0.01, -0.51))


@pytest.mark.parametrize(
    ("v", "moves"), [(0.2, True), (0.209, True), (0.2108, False), (5.0, False)]
)
def test_a_wheel_command_above_the_motors_limit_is_ignored(v, moves):
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(v, 0.0))
    robot.advance(1.0)
    assert (robot.twist.v > 0.0) == moves


def test_a_wheel_whose_command_is_ignored_keeps_its_speed():
    robot = plant(driver_quirks=True)
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(1.0)
    robot.receive(1.0, Twist(0.2, 0.5))  # left 0.16, right 0.24 m/s
    robot.advance(2.0)
    left, right = (robot.twist.v + side * 0.08 * robot.twist.omega for side in (-1.0, 1.0))
    assert (left, right) == (pytest.approx(0.16), pytest.approx(0.1))


def test_no_command_within_the_default_limits_is_ignored():
    rng = np.random.default_rng(0)
    for v, omega in rng.normal(scale=[0.3, 3.0], size=(300, 2)):
        robot, twist = plant(driver_quirks=True), Limits()(v, omega)
        robot.receive(0.0, twist)
        robot.advance(1.0)
        assert close(robot.twist, driven(twist))


def test_a_command_takes_effect_when_its_latency_is_over():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_latency=0.3)
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(0.25)
    assert robot.pose.x == 0.0
    robot.advance(1.3)
    assert robot.pose.x == pytest.approx(0.1)


def test_every_command_is_late_by_the_same():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_latency=0.3)
    for i in range(10):
        robot.receive(0.1 * i, Twist(0.01 * i, 0.0))
    robot.advance(1.3)
    assert robot.pose.x == pytest.approx(sum(0.1 * 0.01 * i for i in range(10)))


@pytest.mark.parametrize("tick", [0.01, 0.05, 10.0])
def test_without_commands_the_robot_stops_after_its_timeout(tick):
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5)
    robot.receive(0.0, Twist(0.1, 0.0))
    for i in range(1 + round(10.0 / tick)):
        robot.advance(i * tick)
    assert robot.pose.x == pytest.approx(0.05)
    assert close(robot.twist, STOP)


@pytest.mark.parametrize("latency", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("tick", [0.05, 10.0])
def test_it_stops_after_its_timeout_however_late_the_last_command_takes_effect(latency, tick):
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5, command_latency=latency)
    robot.receive(0.0, Twist(0.1, 0.0))
    for i in range(1 + round(10.0 / tick)):
        robot.advance(i * tick)
    assert close(robot.twist, STOP)


def test_commands_that_keep_coming_keep_it_going():
    robot = plant(Pose.at(0.0, 0.0, 0.0), command_timeout=0.5)
    for i in range(41):
        robot.advance(i * PERIOD)
        robot.receive(i * PERIOD, Twist(0.1, 0.0))
    assert robot.pose.x == pytest.approx(0.2)


def test_without_a_timeout_the_last_command_holds():
    robot = plant(Pose.at(0.0, 0.0, 0.0))
    robot.receive(0.0, Twist(0.1, 0.0))
    robot.advance(100.0)
    assert robot.pose.x == pytest.approx(10.0)


def noisy(seed):
    """Return 500 messages of a noisy robot that drives, and its true poses."""
    robot = plant(
        seed=seed, position_noise=0.01, heading_noise=0.03, odometry_drift=0.05, initial=START
    )
    robot.receive(0.0, Twist(0.1, 0.2))
    messages, truth = [], []
    for i in range(500):
        robot.advance(i * PERIOD)
        messages.append(robot.read())
        truth.append(robot.pose)
    return messages, truth


def test_noise_is_repeatable_by_its_seed():
    assert noisy(7) == noisy(7)
    assert noisy(7)[0] != noisy(8)[0]


def test_noise_and_drift_spoil_the_odometry_only():
    _, truth = noisy(7)
    assert close(truth[-1], step(START, Twist(0.1, 0.2), 499 * PERIOD))


def test_noise_is_as_large_as_its_standard_deviation():
    robot = plant(position_noise=0.01, heading_noise=0.03)
    still = [decoded(robot.read()) for _ in range(2000)]
    for values, expected in (
        ([pose.x for pose in still], 0.01),
        ([pose.y for pose in still], 0.01),
        ([pose.theta for pose in still], 0.03),
    ):
        assert np.mean(values) == pytest.approx(0.0, abs=5.0 * expected / math.sqrt(2000))
        assert np.std(values) == pytest.approx(expected, rel=0.1)


def test_the_wheels_turn_as_far_as_their_rims_roll():
    robot = plant()
    robot.receive(0.0, Twist(0.1, 0.5))
    robot.advance(3.0)
    left, right = (0.033 * turned for turned in robot.wheels)
    assert (left + right) / 2.0 == pytest.approx(0.3)
    assert (right - left) / 0.16 == pytest.approx(1.5)


def test_resetting_the_odometry_moves_the_odometry_only():
    robot = plant()
    robot.receive(0.0, Twist(0.1, 0.5))
    robot.advance(3.0)
    before = robot.pose
    robot.reset_odometry()
    assert close(robot.pose, before)
    assert close(decoded(robot.read()), Pose.at(0.0, 0.0, 0.0))

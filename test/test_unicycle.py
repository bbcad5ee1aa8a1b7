# SPDX-License-Identifier: Apache-2.0
"""The unicycle: heading from a quaternion, poses as a group, and motion along exact arcs."""

import math

import numpy as np
import pytest
from arenas import wrapped
from hypothesis import given
from hypothesis import strategies as st

from tbot_gradnav.unicycle import Pose, Twist, heading, quaternion, step

ANGLES = st.floats(-10.0, 10.0)
METRES = st.floats(-100.0, 100.0)
POSES = st.builds(Pose.at, METRES, METRES, ANGLES)
ORIGIN = Pose(0.0, 0.0, 1.0, 0.0)


def close(one, other, tolerance=1e-9):
    return np.allclose(one, other, rtol=tolerance, atol=tolerance)


def product(p, q):
    """Return the quaternion product pq, components (x, y, z, w)."""
    (a, b, c, d), (e, f, g, h) = p, q
    return (
        d * e + a * h + b * g - c * f,
        d * f - a * g + b * h + c * e,
        d * g + a * f - b * e + c * h,
        d * h - a * e - b * f - c * g,
    )


def turn(axis, angle):
    """Return the quaternion of a turn about x (0), y (1) or z (2)."""
    q = [0.0, 0.0, 0.0, math.cos(angle / 2.0)]
    q[axis] = math.sin(angle / 2.0)
    return tuple(q)


def integrated(pose, v, omega, dt, steps=200):
    """Return the pose after dt by the classical Runge-Kutta method, a slow reference for step."""
    x, y, theta = pose
    h = dt / steps
    for _ in range(steps):
        mid, end = theta + 0.5 * h * omega, theta + h * omega
        x += h * v * (math.cos(theta) + 4.0 * math.cos(mid) + math.cos(end)) / 6.0
        y += h * v * (math.sin(theta) + 4.0 * math.sin(mid) + math.sin(end)) / 6.0
        theta = end
    return Pose.at(x, y, theta)


@given(theta=ANGLES)
def test_heading_is_cosine_and_sine_of_the_yaw(theta):
    assert close(heading(*quaternion(theta)), (math.cos(theta), math.sin(theta)), 1e-14)


@given(theta=ANGLES, size=st.sampled_from([1e-3, 0.5, 3.0, 1e3]))
def test_heading_does_not_mind_an_unnormalised_quaternion(theta, size):
    q_z, q_w = quaternion(theta)
    assert close(heading(size * q_z, size * q_w), (math.cos(theta), math.sin(theta)), 1e-14)


@given(theta=ANGLES)
def test_q_and_minus_q_have_the_same_heading(theta):
    q_z, q_w = quaternion(theta)
    assert heading(q_z, q_w) == heading(-q_z, -q_w)


@given(yaw=ANGLES, tilt=st.floats(-1.5, 1.5), direction=ANGLES)
def test_heading_of_a_tilted_robot_is_the_twist_of_its_swing(yaw, tilt, direction):
    axis = product(product(turn(2, direction), turn(0, tilt)), turn(2, -direction))
    _, _, q_z, q_w = product(axis, turn(2, yaw))
    assert close(heading(q_z, q_w), (math.cos(yaw), math.sin(yaw)), 1e-9)


@given(yaw=ANGLES, angle=st.floats(-1.5, 1.5), axis=st.sampled_from([0, 1]))
def test_heading_is_the_yaw_whether_the_robot_only_rolls_or_only_pitches(yaw, angle, axis):
    _, _, q_z, q_w = product(turn(2, yaw), turn(axis, angle))
    assert close(heading(q_z, q_w), (math.cos(yaw), math.sin(yaw)), 1e-9)


@given(theta=ANGLES)
def test_theta_is_the_angle_the_pose_was_made_with(theta):
    assert close(wrapped(Pose.at(0.0, 0.0, theta).theta - theta), 0.0, 1e-12)


@given(a=POSES, b=POSES, c=POSES)
def test_composing_poses_is_associative(a, b, c):
    assert close(a.compose(b).compose(c), a.compose(b.compose(c)))


@given(a=POSES)
def test_the_origin_is_neutral(a):
    assert close(a.compose(ORIGIN), a)
    assert close(ORIGIN.compose(a), a)


@given(a=POSES)
def test_a_pose_composed_with_its_inverse_is_the_origin(a):
    assert close(a.compose(a.inverse()), ORIGIN)
    assert close(a.inverse().compose(a), ORIGIN)


@given(a=POSES, b=POSES)
def test_composing_poses_is_rotating_and_then_translating(a, b):
    composed = a.compose(b)
    position = complex(a.x, a.y) + complex(a.cos, a.sin) * complex(b.x, b.y)
    assert close(complex(composed.x, composed.y), position)
    assert close(wrapped(composed.theta - a.theta - b.theta), 0.0)


@given(
    x=METRES,
    y=METRES,
    theta=ANGLES,
    v=st.floats(-2.0, 2.0),
    omega=st.floats(-3.0, 3.0),
    dt=st.floats(0.0, 2.0),
)
def test_step_agrees_with_fine_integration(x, y, theta, v, omega, dt):
    moved = step(Pose.at(x, y, theta), Twist(v, omega), dt)
    assert close(moved, integrated((x, y, theta), v, omega, dt))


@given(start=POSES, v=st.floats(0.1, 2.0), omega=st.floats(0.1, 3.0))
def test_a_full_turn_comes_back_to_its_start(start, v, omega):
    assert close(step(start, Twist(v, omega), 2.0 * math.pi / omega), start)


@given(start=POSES, v=st.floats(-2.0, 2.0), omega=st.floats(-3.0, 3.0), dt=st.floats(0.0, 2.0))
def test_an_arc_may_be_driven_in_two_parts(start, v, omega, dt):
    twist = Twist(v, omega)
    assert close(step(step(start, twist, 0.3 * dt), twist, 0.7 * dt), step(start, twist, dt))


@given(start=POSES, v=st.floats(-2.0, 2.0), dt=st.floats(0.0, 10.0))
def test_without_turning_the_robot_drives_straight(start, v, dt):
    moved = step(start, Twist(v, 0.0), dt)
    straight = (start.x + v * dt * start.cos, start.y + v * dt * start.sin)
    assert close((moved.x, moved.y), straight, 1e-12)
    assert close((moved.cos, moved.sin), (start.cos, start.sin), 1e-12)


@pytest.mark.parametrize("omega", [5e-324, 1e-300, 1e-30, 1e-16, 1e-12, 1e-9])
def test_hardly_turning_is_next_to_straight(omega):
    start = Pose.at(1.0, 2.0, 0.7)
    for sign in (1.0, -1.0):
        moved = step(start, Twist(0.2, sign * omega), 1.0)
        assert close(moved, step(start, Twist(0.2, 0.0), 1.0), max(1e-15, omega))


def test_heading_stays_of_unit_length_through_100000_steps():
    rng = np.random.default_rng(0)
    pose = Pose.at(0.0, 0.0, 0.1)
    for omega in rng.uniform(-3.0, 3.0, 100_000):
        pose = step(pose, Twist(0.2, omega), 0.05)
    assert abs(math.hypot(pose.cos, pose.sin) - 1.0) < 1e-12


def test_a_heading_that_is_not_quite_of_unit_length_is_mended():
    pose = Pose(0.0, 0.0, 1.001 * math.cos(0.5), 1.001 * math.sin(0.5))
    for _ in range(10):
        pose = step(pose, Twist(0.0, 0.3), 0.05)
    assert math.hypot(pose.cos, pose.sin) == pytest.approx(1.0, abs=1e-12)


def test_many_robots_step_like_each_alone():
    rng = np.random.default_rng(1)
    x, y, theta, v, omega = rng.normal(size=(5, 50))
    moved = step(Pose.at(x, y, theta), Twist(v, omega), 0.05)
    for i in range(50):
        alone = step(Pose.at(x[i], y[i], theta[i]), Twist(v[i], omega[i]), 0.05)
        assert close([component[i] for component in moved], alone, 1e-14)

# SPDX-License-Identifier: Apache-2.0
"""The control laws, through the whole controller: symmetries, descent, limits, closed forms."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from arenas import (
    ATTRACTIVE_REPULSIVE,
    EMPTY,
    FREE,
    NAVIGATION_FUNCTION,
    controller,
    disc,
    obstacles,
    row,
    wrapped,
)
from hypothesis import assume, given
from hypothesis import strategies as st

from tbot_gradnav import closed_form
from tbot_gradnav.controller import Controller
from tbot_gradnav.limits import Limits
from tbot_gradnav.unicycle import Pose, step

LAWS = {  # gains that each law allows
    "position": {"law": "position", "k_v": 0.5, "k_omega": 3.0},
    "radial": {"law": "radial", "k_v": 0.5, "k_omega": 1.0},
    "heading": {"law": "heading", "k_v": 0.5, "k_omega": 3.0},
    "descent": {"law": "descent", "k_v": 0.5, "k_omega": 3.0},
}
POTENTIALS = (
    {"potential": "quadratic"},
    NAVIGATION_FUNCTION,
    ATTRACTIVE_REPULSIVE,
    {**ATTRACTIVE_REPULSIVE, "attractive_repulsive.goal_scaled": False},
)
LIMITS = st.builds(
    Limits,
    v=st.floats(0.01, 2.0),
    omega=st.floats(0.01, 5.0),
    wheel=st.floats(0.01, 2.0),
    wheel_floor=st.sampled_from([0.0, 0.005, 0.02, 10.0]),
)
SPEEDS = st.floats(-10.0, 10.0)
ONE_OBSTACLE = {"goal": [0.0, 0.0], **disc(4.5), **obstacles([(-2.5, 2.5, 0.5)])}
ANY_LAW = st.sampled_from(list(LAWS.values()))
every_law = pytest.mark.parametrize("gains", LAWS.values(), ids=LAWS.keys())


class Scene(NamedTuple):
    """A random world as parameters, and a robot in it."""

    world: dict
    pose: tuple  # x, y [m], theta [rad]


@st.composite
def scenes(draw):
    """Draw a world with up to five obstacles between goal and boundary, and a robot anywhere."""
    x, y = draw(st.floats(-10.0, 10.0)), draw(st.floats(-10.0, 10.0))
    circles = []
    for sector in range(draw(st.integers(0, 5))):
        r, radius = draw(st.floats(2.0, 3.0)), draw(st.floats(0.05, 0.5))
        angle = sector * 2.0 * math.pi / 5.0
        circles.append((x + r * math.cos(angle), y + r * math.sin(angle), radius))
    goal = [x + draw(st.floats(-0.8, 0.8)), y + draw(st.floats(-0.8, 0.8))]
    away = draw(st.floats(0.06, 3.8)), draw(st.floats(-4.0, 4.0))
    robot = (x + away[0] * math.cos(away[1]), y + away[0] * math.sin(away[1]))
    return Scene(
        {
            "goal": goal,
            "initial_pose": [*goal, 0.0],
            **disc(4.0, x, y),
            **obstacles(circles),
            **draw(st.sampled_from(POTENTIALS)),
            "speed_shaping": draw(st.sampled_from(["brake", "exponential", "none"])),
        },
        (*robot, draw(st.floats(-4.0, 4.0))),
    )


GEARS = st.sampled_from([1.0, -1.0])


def moved(scene, place):
    """Return a scene carried to another place: goal, obstacles, boundary and robot together."""
    return _mapped(scene, lambda x, y: place.compose(Pose.at(x, y, 0.0))[:2], place.theta, 1.0)


def mirrored(scene):
    """Return a scene mirrored at the x axis."""
    return _mapped(scene, lambda x, y: (x, -y), 0.0, -1.0)


def _mapped(scene, place, turn, side):
    world = dict(scene.world)
    world["goal"] = [float(value) for value in place(*world["goal"])]
    world["initial_pose"] = [*world["goal"], 0.0]
    for name in ("boundary", *(f"obstacles.{n}" for n in world["obstacles.names"])):
        x, y = place(world[f"{name}.x"], world[f"{name}.y"])
        world |= {f"{name}.x": float(x), f"{name}.y": float(y)}
    x, y, theta = scene.pose
    return Scene(world, (*place(x, y), side * theta + turn))


def command(scene, gains, gear):
    v, omega = controller(scene.world, gains).command(Pose.at(*scene.pose), gear)
    return float(v), float(omega)


def is_regular(scene, gains):
    """Whether the command is continuous here: not at the goal, nor facing exactly away."""
    control = controller(scene.world, gains)
    pose = Pose.at(*scene.pose)
    x, y = pose.x - control.settings.world.goal[0], pose.y - control.settings.world.goal[1]
    field = control.potential(pose.x, pose.y)
    norm = math.hypot(field.g_x, field.g_y)
    sines = (
        (pose.sin * field.g_x - pose.cos * field.g_y) / max(norm, 1e-100),
        (pose.sin * x - pose.cos * y) / max(math.hypot(x, y), 1e-100),
    )
    regular = min(map(abs, sines)) > 1e-2 and norm > 1e-3
    return regular and control.settings.world.clearance(pose.x, pose.y) > 1e-3


def with_limits(control, drive):
    """Return the same controller for another drive."""
    return Controller.of(replace(control.settings, limits=drive))


def slope(control, pose):
    """Return the cosine of the angle between heading and gradient."""
    _, cos, sin = control.potential(pose.x, pose.y).polar
    return cos * pose.cos + sin * pose.sin


# Symmetries


@given(
    gains=ANY_LAW,
    scene=scenes(),
    gear=GEARS,
    place=st.builds(Pose.at, st.floats(-10, 10), st.floats(-10, 10), st.floats(-4, 4)),
)
def test_the_command_is_the_same_wherever_world_and_robot_are_carried(gains, scene, gear, place):
    assume(is_regular(scene, gains))
    here, there = command(scene, gains, gear), command(moved(scene, place), gains, gear)
    assert there == pytest.approx(here, rel=1e-6, abs=1e-12)


@given(gains=ANY_LAW, scene=scenes(), gear=GEARS)
def test_mirroring_flips_the_turning_only(gains, scene, gear):
    assume(is_regular(scene, gains))
    v, omega = command(scene, gains, gear)
    assert command(mirrored(scene), gains, gear) == pytest.approx((v, -omega), rel=1e-9)


@given(gains=ANY_LAW, scene=scenes())
def test_the_backward_gear_is_the_forward_gear_of_a_robot_turned_round(gains, scene):
    assume(is_regular(scene, gains))
    x, y, theta = scene.pose
    v, omega = command(scene, gains, 1.0)
    turned = Scene(scene.world, (x, y, theta + math.pi))
    assert command(turned, gains, -1.0) == pytest.approx((-v, omega), rel=1e-6)


@given(gains=ANY_LAW, scene=scenes(), gear=GEARS, seed=st.integers(0, 1000))
def test_a_batch_is_what_each_robot_does_alone(gains, scene, gear, seed):
    control = controller(scene.world, gains)
    x, y, theta = np.random.default_rng(seed).uniform(-4.0, 4.0, (3, 10))
    x, y = x + scene.world["boundary.x"], y + scene.world["boundary.y"]
    batch = control.command(Pose.at(x, y, theta), gear)
    alone = [control.command(Pose.at(*pose), gear) for pose in zip(x, y, theta, strict=True)]
    assert np.allclose(np.array(batch).T, alone, rtol=1e-9, atol=1e-12)


@given(gains=ANY_LAW, scene=scenes(), gear=GEARS)
def test_a_full_turn_of_the_heading_changes_nothing(gains, scene, gear):
    assume(is_regular(scene, gains))
    x, y, theta = scene.pose
    turned = Scene(scene.world, (x, y, theta + 2.0 * math.pi))
    assert command(turned, gains, gear) == pytest.approx(command(scene, gains, gear), rel=1e-9)


@given(
    gains=ANY_LAW,
    scene=scenes(),
    gear=GEARS,
    distance=st.floats(0.0, 0.049),
    angle=st.floats(-4, 4),
)
def test_within_the_tolerance_of_the_goal_the_robot_stands(gains, scene, gear, distance, angle):
    x, y = scene.world["goal"]
    at_goal = (x + distance * math.cos(angle), y + distance * math.sin(angle), scene.pose[2])
    assert command(Scene(scene.world, at_goal), gains, gear) == (0.0, 0.0)


@given(scene=scenes())
def test_auto_reverse_starts_the_way_that_leads_downhill(scene):
    control = controller(scene.world, LAWS["descent"], {"auto_reverse": True})
    pose = Pose.at(*scene.pose)
    v = control.command(pose, control.gear(pose)).v
    assume(not control.arrived(pose))
    assert v * slope(control, pose) < 0.0 or abs(slope(control, pose)) < 1e-12


@given(scene=scenes())
def test_without_auto_reverse_the_gains_keep_their_signs(scene):
    control = controller(scene.world, LAWS["descent"], {"auto_reverse": False})
    assert control.gear(Pose.at(*scene.pose)) == 1.0


# Descent


@given(scene=scenes(), gear=GEARS, drive=LIMITS)
def test_under_the_descent_law_the_potential_never_rises(scene, gear, drive):
    control = controller(scene.world, LAWS["descent"])
    pose = Pose.at(*scene.pose)
    for some in (control, with_limits(control, drive)):
        assert some.command(pose, gear).v * slope(some, pose) <= 1e-15


@given(scene=scenes(), gear=GEARS)
def test_under_the_descent_law_the_robot_drives_in_its_gear_only(scene, gear):
    v, _ = command(scene, LAWS["descent"], gear)
    assert v * gear >= 0.0


@given(scene=scenes(), gear=GEARS)
def test_under_the_descent_law_the_robot_drives_or_turns(scene, gear):
    control = controller(scene.world, LAWS["descent"])
    pose = Pose.at(*scene.pose)
    assume(not control.arrived(pose))
    v, omega = control.command(pose, gear)
    mu = control.potential(pose.x, pose.y).polar[0]
    assert abs(v) + abs(omega) > 1e-3 or mu == 0.0


# Limits


@given(gains=ANY_LAW, scene=scenes(), gear=GEARS, drive=LIMITS)
def test_every_command_is_within_the_limits(gains, scene, gear, drive):
    control = with_limits(controller(scene.world, gains), drive)
    v, omega = map(abs, control.command(Pose.at(*scene.pose), gear))
    assert v <= drive.v * (1.0 + 1e-12)
    assert omega <= drive.omega * (1.0 + 1e-12)
    assert v + omega * drive.wheel_separation / 2.0 <= drive.wheel * (1.0 + 1e-12)


@given(drive=LIMITS, v=SPEEDS, omega=SPEEDS)
def test_limits_keep_the_curvature_and_the_direction(drive, v, omega):
    got = drive(v, omega)
    scale = max(abs(v), abs(omega))
    assert abs(got.omega * v - got.v * omega) <= 1e-12 * scale
    assert got.v * v >= 0.0
    assert got.omega * omega >= 0.0


@given(drive=LIMITS, v=SPEEDS, omega=SPEEDS)
def test_limits_leave_alone_what_the_drive_can_do(drive, v, omega):
    wheel = abs(v) + abs(omega) * drive.wheel_separation / 2.0
    assume(abs(v) <= drive.v and abs(omega) <= drive.omega)
    assume(drive.wheel_floor <= wheel <= drive.wheel)
    assert drive(v, omega) == pytest.approx((v, omega), rel=1e-12)


@given(drive=LIMITS, v=SPEEDS, omega=SPEEDS)
def test_limits_slow_down_no_more_than_needed(drive, v, omega):
    got = drive(v, omega)
    assume(abs(got.v) < abs(v))
    wheel = abs(got.v) + abs(got.omega) * drive.wheel_separation / 2.0
    use = abs(got.v) / drive.v, abs(got.omega) / drive.omega, wheel / drive.wheel
    assert max(use) == pytest.approx(1.0)


@given(v=SPEEDS, omega=SPEEDS)
def test_a_slow_command_is_raised_to_what_the_driver_can_resolve(v, omega):
    assume(abs(v) + abs(omega) > 1e-30)
    drive = Limits()
    got = drive(v, omega)
    assert abs(got.v) + abs(got.omega) * 0.08 >= drive.wheel_floor * (1.0 - 1e-12)


def test_no_command_stays_no_command():
    assert Limits()(0.0, 0.0) == (0.0, 0.0)


@given(gains=ANY_LAW, scene=scenes(), gear=GEARS)
def test_limits_do_not_bend_the_path_of_a_law(gains, scene, gear):
    unshaped = {"speed_shaping": "none"}
    pose = Pose.at(*scene.pose)
    free = controller(scene.world, gains, unshaped, FREE).command(pose, gear)
    limited = controller(scene.world, gains, unshaped).command(pose, gear)
    cross = free.omega * limited.v - free.v * limited.omega
    assert abs(cross) <= 1e-12 * math.hypot(*free) * math.hypot(*limited)


# The paper's closed forms


def derivative(control, state):
    """Return (dx/dt, dy/dt, dtheta/dt) of a robot under continuous control."""
    pose = Pose.at(*state)
    v, omega = control.command(pose, 1.0)
    return np.array([v * pose.cos, v * pose.sin, omega])


def integrated(control, state, duration, dt=0.02):
    """Return the state after `duration` [s] by the classical Runge-Kutta method."""
    for _ in range(round(duration / dt)):
        a = derivative(control, state)
        b = derivative(control, state + 0.5 * dt * a)
        c = derivative(control, state + 0.5 * dt * b)
        d = derivative(control, state + dt * c)
        state = state + dt * (a + 2.0 * b + 2.0 * c + d) / 6.0
    return state


def twelve_starts():
    """Return alpha, beta [rad] of twelve starts all round the goal, as in Fig. 3."""
    alpha = np.arange(12) * np.pi / 6.0
    beta = np.linspace(0.2, 2.9, 12) * np.where(np.arange(12) % 2, 1.0, -1.0)
    return alpha, beta


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forward", "backward"])
def test_the_position_law_follows_its_closed_form(sign):
    """Eqs. (14) and (20), the latter corrected, from twelve starts 2 m from the goal."""
    k_v, k_omega, rho_0 = 0.1 * sign, 0.5 * sign, 2.0
    gains = {"law": "position", "k_v": k_v, "k_omega": k_omega, "xy_goal_tolerance": 1e-9}
    control = controller(EMPTY, FREE, gains, {"speed_shaping": "none"})
    alpha, beta_0 = twelve_starts()
    state = np.array([rho_0 * np.cos(alpha), rho_0 * np.sin(alpha), alpha + beta_0])
    for t in (5.0, 10.0, 15.0, 20.0):
        state = integrated(control, state, 5.0)
        x, y, theta = state
        rho = closed_form.rho(t, rho_0, beta_0, k_v, k_omega)
        assert np.allclose(np.hypot(x, y), rho, rtol=1e-6, atol=0.0)
        beta = closed_form.beta(t, beta_0, k_v, k_omega)
        assert np.allclose(wrapped(theta - np.arctan2(y, x) - beta), 0.0, atol=1e-6)


@pytest.mark.parametrize("gains", [(0.1, 0.5), (-0.1, -0.5), (0.5, 3.0)])
def test_the_closed_form_starts_where_the_robot_starts(gains):
    for beta_0 in (-2.9, -1.0, 0.2, 1.5, 3.0):
        assert closed_form.beta(0.0, beta_0, *gains) == pytest.approx(beta_0)
        assert closed_form.rho(0.0, 2.0, beta_0, *gains) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("t", "printed", "corrected"),
    [
        (0.0, 1.642, 2.0),
        (5.0, 1.340, 1.6325),
        (10.0, 0.822, 1.0008),
        (15.0, 0.499, 0.6071),
        (20.0, 0.302, 0.3682),
    ],
)
def test_eq_20_as_printed_is_wrong_by_as_much_as_the_erratum_says(t, printed, corrected):
    case = {"rho_0": 2.0, "beta_0": 2.0, "k_v": -0.1, "k_omega": -0.5}
    assert closed_form.rho_as_printed(t, **case) == pytest.approx(printed, abs=5.1e-4)
    assert closed_form.rho(t, **case) == pytest.approx(corrected, abs=5.1e-5)


def circling(gains):
    """Drive under eq. (22) in the open half-way round; return x, y, theta of each robot and time.

    Each step is a set part of the distance to the goal, so that its length depends on the path
    alone and not on how fast the potential has it driven.
    """
    free = {**FREE, "speed_shaping": "none", "robot_radius": 0.0, "xy_goal_tolerance": 1e-9}
    control = controller(ONE_OBSTACLE, LAWS["radial"], free, gains)
    alpha, beta = twelve_starts()
    away = np.abs(np.sin(beta)) > 0.4  # their circles stay within the boundary
    alpha, beta = alpha[away], beta[away]
    pose, path = Pose.at(1.5 * np.cos(alpha), 1.5 * np.sin(alpha), alpha + beta), []
    for _ in range(500):
        path.append(np.array([pose.x, pose.y, pose.theta]))
        twist = control.command(pose, 1.0)
        pose = step(pose, twist, 0.005 * np.hypot(pose.x, pose.y) / np.abs(twist.v))
    return np.array(path)


@pytest.mark.parametrize("gains", POTENTIALS[:3], ids=lambda gains: gains["potential"])
def test_eq_22_drives_along_the_circle_of_eq_30_whatever_the_potential(gains):
    path = circling(gains)
    x, y, theta = np.moveaxis(path, 1, 0)
    constant = closed_form.circle_constant(np.hypot(x, y), np.sin(theta - np.arctan2(y, x)))
    assert np.allclose(constant, constant[0], rtol=1e-6, atol=0.0)
    assert np.hypot(x, y)[-1].max() < 0.9 * np.hypot(x, y).max()


def test_eq_22_takes_the_same_path_for_every_potential():
    quadratic, psi, u = (circling(gains) for gains in POTENTIALS[:3])
    assert np.allclose(psi[:, :2], quadratic[:, :2], rtol=0.0, atol=1e-9)
    assert np.allclose(u[:, :2], quadratic[:, :2], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("shaping", "speed"),
    [
        ("brake", lambda rho, mu: math.sqrt(2.0 * 0.3 * rho)),
        ("exponential", lambda rho, mu: 0.4 * rho),
        ("none", lambda rho, mu: 0.4 * mu),
    ],
)
def test_a_robot_facing_downhill_drives_at_the_speed_its_shaping_says(shaping, speed):
    shape = {"speed_shaping": shaping, "deceleration": 0.3, "k_v": 0.4, "k_omega": 3.0}
    control = controller(ONE_OBSTACLE, NAVIGATION_FUNCTION, FREE, shape)
    for x, y in ((1.0, 1.0), (-0.5, 2.0), (0.1, -0.2)):
        mu, cos, sin = control.potential(x, y).polar
        v, omega = control.command(Pose(x, y, -cos, -sin), 1.0)
        assert v == pytest.approx(speed(math.hypot(x, y), mu))
        assert omega == pytest.approx(0.0, abs=1e-12)


@every_law
@pytest.mark.parametrize("k_v", [0.5, -0.5])
def test_gains_of_either_sign_approach_a_goal_dead_ahead_or_dead_astern(gains, k_v):
    signed = {**gains, "k_v": k_v, "k_omega": math.copysign(gains["k_omega"], k_v)}
    control = controller(EMPTY, signed)
    alpha = np.arange(12) * np.pi / 6.0
    towards = row([(math.cos(a), math.sin(a), a + math.pi * (k_v > 0.0)) for a in alpha])
    twist = control.command(towards, np.ones(12))
    ahead = step(towards, twist, 0.05)
    assert (np.hypot(ahead.x, ahead.y) < 0.999).all()
    assert np.allclose(twist.omega, 0.0, atol=1e-12)

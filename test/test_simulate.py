# SPDX-License-Identifier: Apache-2.0
"""The closed loop: what arrives, what collides, and starts from which a robot must not be stuck."""

import math
import time

import numpy as np
import pytest
from arenas import (
    ATTRACTIVE_REPULSIVE,
    EMPTY,
    NAVIGATION_FUNCTION,
    NINE,
    controller,
    disc,
    obstacles,
    row,
)

from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.plant import driven
from tbot_gradnav.settings import Settings
from tbot_gradnav.shortest_path import shortest_paths
from tbot_gradnav.simulate import START_CLEARANCE, random_starts, simulate
from tbot_gradnav.unicycle import Pose, step

N = 1000
TOLERANCE = 0.05  # [m] of xy_goal_tolerance
SIGNS = {"forward": {"k_v": 0.5, "k_omega": 3.0}, "backward": {"k_v": -0.5, "k_omega": -3.0}}
AVOIDING = {"psi": NAVIGATION_FUNCTION, "U": ATTRACTIVE_REPULSIVE}
ARRIVING = ("position", "heading", "descent")  # radial may circle for ever, Remark IV.4
RADIAL = {"law": "radial", "k_v": 0.5, "k_omega": 1.0, "auto_reverse": False, "robot_radius": 0.0}


def nine(*parameters, seed=1):
    """Return a controller in the arena of nine, and 1000 random starts."""
    control = controller(NINE, *parameters)
    return control, random_starts(control.settings.world, N, seed)


# The descent law among obstacles


@pytest.mark.parametrize("field", AVOIDING.values(), ids=AVOIDING.keys())
@pytest.mark.parametrize("gains", SIGNS.values(), ids=SIGNS.keys())
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
def test_the_descent_law_brings_1000_robots_home_untouched(field, gains, auto_reverse):
    control, starts = nine(field, gains, {"auto_reverse": auto_reverse})
    began = time.perf_counter()
    runs = simulate(control, starts)
    assert time.perf_counter() - began < 10.0
    assert runs.arrived.sum() == N
    assert runs.collided.sum() == 0
    assert (runs.min_clearance >= 0.0).all()


@pytest.mark.parametrize("field", AVOIDING.values(), ids=AVOIDING.keys())
def test_the_potential_hardly_ever_rises_though_commands_are_held(field):
    """Between two commands the robot may climb by what it curves in 0.05 s, and no more."""
    control, starts = nine(field)
    runs = simulate(control, starts, record=True)
    x, y, _ = runs.path
    phi = control.potential(x, y).phi
    assert (np.diff(phi, axis=0) <= 1e-3 * phi[:-1]).all()
    assert (phi[-1] < phi[0])[runs.time > 0.0].all()


def test_backward_gains_drive_backward_and_forward_gains_forward():
    for gains, sign in ((SIGNS["forward"], 1.0), (SIGNS["backward"], -1.0)):
        control, starts = nine(NAVIGATION_FUNCTION, gains, {"auto_reverse": False})
        x, y, theta = simulate(control, starts, record=True).path
        along = np.diff(x, axis=0) * np.cos(theta[:-1]) + np.diff(y, axis=0) * np.sin(theta[:-1])
        assert (sign * along >= -1e-12).all()


# What a run reports


@pytest.fixture(scope="module")
def home():
    """Return a thousand runs that arrive, and their controller."""
    control, starts = nine(ATTRACTIVE_REPULSIVE)
    return control, simulate(control, starts, record=True)


def test_a_path_is_no_shorter_than_the_straight_line(home):
    _, runs = home
    straight = np.hypot(runs.start.x, runs.start.y)
    assert (runs.path_length >= straight - TOLERANCE).all()


def test_the_path_length_is_that_of_the_recorded_path(home):
    _, runs = home
    x, y, _ = runs.path
    chords = np.hypot(np.diff(x, axis=0), np.diff(y, axis=0)).sum(axis=0)
    assert np.allclose(runs.path_length, chords, rtol=2e-3, atol=1e-3)


def test_a_drive_takes_no_less_time_than_top_speed_allows(home):
    control, runs = home
    assert (runs.time >= runs.path_length / control.settings.limits.v - 1e-9).all()


def test_arrived_means_within_the_tolerance_of_the_goal(home):
    _, runs = home
    x, y, _ = runs.path[:, -1]
    assert np.allclose(runs.final_distance, np.hypot(x, y))
    assert (runs.final_distance <= TOLERANCE).all()


def test_the_smallest_clearance_is_that_of_the_recorded_path(home):
    control, runs = home
    x, y, _ = runs.path
    assert np.allclose(runs.min_clearance, control.settings.world.clearance(x, y).min(axis=0))


def test_the_recorded_path_begins_at_the_start_and_follows_the_commands(home):
    control, runs = home
    assert np.allclose(runs.path[:, 0], [runs.start.x, runs.start.y, runs.start.theta])
    pose = Pose.at(*runs.path[:, 0])
    ahead = step(pose, control.command(pose, control.gear(pose)), 0.05)
    assert np.allclose(runs.path[:, 1], [ahead.x, ahead.y, ahead.theta])


def test_one_robot_fares_alone_as_it_does_among_others(home):
    control, runs = home
    for i in range(3):
        alone = simulate(control, Pose(*(component[i : i + 1] for component in runs.start)))
        assert alone.arrived[0] == runs.arrived[i]
        assert alone.time[0] == pytest.approx(runs.time[i])
        assert alone.path_length[0] == pytest.approx(runs.path_length[i], rel=1e-6)


def test_a_robot_that_starts_at_the_goal_has_arrived():
    runs = simulate(controller(EMPTY), row([(0.03, 0.0, 1.0)]))
    assert runs.arrived.all()
    assert (runs.time[0], runs.path_length[0]) == (0.0, 0.0)


def test_a_robot_that_starts_in_an_obstacle_has_collided():
    control = controller(NINE, NAVIGATION_FUNCTION)
    runs = simulate(control, row([(1.6, 0.2, 0.0), (0.0, 4.45, 0.0)]))
    assert runs.collided.all()
    assert not runs.arrived.any()
    assert (runs.min_clearance < 0.0).all()


def test_a_robot_out_of_time_has_neither_arrived_nor_collided():
    runs = simulate(controller(EMPTY), row([(2.0, 0.0, 0.0)]), time_limit=1.0)
    assert not runs.arrived.any()
    assert not runs.collided.any()
    assert runs.time[0] == pytest.approx(1.0)


# Starts that must not trap a robot

ALPHAS = np.arange(0.0, 2.0 * np.pi, np.pi / 4.0)
FACING = {"away": 0.0, "towards": math.pi, "abeam left": math.pi / 2, "abeam right": -math.pi / 2}


def on_a_circle(facing):
    """Return robots 2 m from the goal, all round, whose heading differs from alpha by `facing`."""
    return row([(2.0 * math.cos(a), 2.0 * math.sin(a), a + facing) for a in ALPHAS])


@pytest.mark.parametrize("law", ARRIVING)
@pytest.mark.parametrize("gains", SIGNS.values(), ids=SIGNS.keys())
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
@pytest.mark.parametrize("facing", FACING.values(), ids=FACING.keys())
def test_a_robot_arrives_whichever_way_it_faces_at_first(law, gains, auto_reverse, facing):
    control = controller(EMPTY, gains, {"law": law, "auto_reverse": auto_reverse})
    assert simulate(control, on_a_circle(facing)).arrived.all()


@pytest.mark.parametrize("law", ARRIVING)
@pytest.mark.parametrize("gains", SIGNS.values(), ids=SIGNS.keys())
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
@pytest.mark.parametrize("facing", FACING.values(), ids=FACING.keys())
def test_after_one_control_period_a_robot_has_turned_or_come_nearer(
    law, gains, auto_reverse, facing
):
    control = controller(EMPTY, gains, {"law": law, "auto_reverse": auto_reverse})
    start = on_a_circle(facing)
    after = simulate(control, start, time_limit=0.05, record=True).path[:, -1]
    turned = np.abs(start.cos * np.sin(after[2]) - start.sin * np.cos(after[2]))
    assert ((np.hypot(*after[:2]) < 1.999) | (turned > 1e-5)).all()


EXACTLY_AWAY = [Pose(x, y, x / 2.0, y / 2.0) for x, y in ((2, 0), (0, 2), (-2, 0), (0, -2))]


@pytest.mark.parametrize("law", ARRIVING)
def test_a_robot_that_faces_away_to_the_last_bit_turns(law):
    control = controller(EMPTY, {"law": law, "auto_reverse": False})
    assert min(abs(control.command(pose, 1.0).omega) for pose in EXACTLY_AWAY) > 1e-4


@pytest.mark.parametrize("law", ARRIVING)
def test_that_turning_survives_the_driver_which_cuts_to_hundredths(law):
    control = controller(EMPTY, {"law": law, "auto_reverse": False})
    assert all(driven(control.command(pose, 1.0)).omega != 0.0 for pose in EXACTLY_AWAY)


@pytest.mark.parametrize("field", AVOIDING.values(), ids=AVOIDING.keys())
@pytest.mark.parametrize("auto_reverse", [True, False], ids=["either_way", "one_way"])
def test_robots_that_face_straight_uphill_among_obstacles_arrive(field, auto_reverse):
    control, starts = nine(field, {"auto_reverse": auto_reverse})
    _, cos, sin = control.potential(starts.x, starts.y).polar
    runs = simulate(control, Pose(starts.x, starts.y, cos, sin))
    assert runs.arrived.all()


# Eq. (22) as printed


def circle_clearance(world, start):
    """Return the clearance of the forward arc from each start to the goal at the origin, eq. (30).

    The circle is tangent to the heading and goes through the goal: its radius is
    rho / (2 sin beta), and as beta grows to pi the heading turns by twice as much.
    """
    beta = np.arctan2(
        start.sin * start.x - start.cos * start.y, start.cos * start.x + start.sin * start.y
    )
    turn = 2.0 * (np.sign(beta) * np.pi - beta)  # [rad] signed, whole arc
    radius = np.hypot(start.x, start.y) / (2.0 * np.sin(beta))
    clearance = np.full(np.shape(beta), np.inf)
    for part in np.linspace(0.0, 1.0, 2001):
        angle = turn * part
        x = start.x + radius * (_sin(start, angle) - start.sin)
        y = start.y - radius * (_cos(start, angle) - start.cos)
        clearance = np.minimum(clearance, world.clearance(x, y))
    return clearance


def _cos(start, angle):
    return start.cos * np.cos(angle) - start.sin * np.sin(angle)


def _sin(start, angle):
    return start.sin * np.cos(angle) + start.cos * np.sin(angle)


@pytest.fixture(scope="module")
def circling():
    """Return the controller, 1000 runs under eq. (22), and the clearances of their circles."""
    control, starts = nine(NAVIGATION_FUNCTION, RADIAL)
    return control, simulate(control, starts), circle_clearance(control.settings.world, starts)


def test_eq_22_collides_just_where_its_circle_meets_an_obstacle_or_the_boundary(circling):
    _, runs, clearance = circling
    clear_cut = np.abs(clearance) > 2e-3
    assert clear_cut.sum() > 0.95 * N
    assert (runs.collided == (clearance < 0.0))[clear_cut].all()
    assert (runs.arrived | runs.collided).all()


def test_eq_22_collides_in_more_than_half_of_the_starts_as_was_measured(circling):
    """435 of 1000 arrived; the difference of two such counts has a 95 % interval of +-43."""
    _, runs, _ = circling
    p = 0.435
    half_width = 1.96 * math.sqrt(2.0 * p * (1.0 - p) / N)
    assert runs.arrived.mean() == pytest.approx(p, abs=half_width)


def test_eq_22_fares_no_better_with_another_potential_or_shaping(circling):
    _, runs, clearance = circling
    clear_cut = np.abs(clearance) > 2e-3
    for other in (ATTRACTIVE_REPULSIVE, {"speed_shaping": "exponential"}):
        control, starts = nine(NAVIGATION_FUNCTION, RADIAL, other)
        assert (simulate(control, starts).collided == runs.collided)[clear_cut].all()


# Random starts


def test_random_starts_are_clear_and_all_over_the_arena():
    control, starts = nine(NAVIGATION_FUNCTION)
    world = control.settings.world
    assert np.shape(starts.x) == (N,)
    assert (world.clearance(starts.x, starts.y) >= START_CLEARANCE).all()
    quadrants = (starts.x > 0.0) + 2 * (starts.y > 0.0)
    assert np.bincount(quadrants).min() > 0.2 * N
    assert np.abs([starts.cos.mean(), starts.sin.mean()]).max() < 4.0 / math.sqrt(2.0 * N)


def test_random_starts_are_repeatable():
    again = [np.array(nine(NAVIGATION_FUNCTION, seed=seed)[1]) for seed in (1, 1, 2)]
    assert (again[0] == again[1]).all()
    assert (again[0] != again[2]).any()


def test_a_world_without_room_for_a_start_is_refused():
    control = controller({"goal": [0.0, 0.0], "robot_radius": 0.105}, disc(0.2))
    with pytest.raises(GradnavError, match="no room"):
        random_starts(control.settings.world, 10, seed=0)


def test_without_a_boundary_starts_surround_the_goal_and_the_obstacles():
    world = controller({"goal": [5.0, 5.0]}, obstacles([(7.0, 5.0, 0.3)])).settings.world
    starts = random_starts(world, N, seed=0)
    assert np.hypot(starts.x - 5.0, starts.y - 5.0).max() > 2.3


def test_the_attractive_repulsive_way_takes_hardly_longer_than_the_shortest_at_top_speed():
    settings = Settings.of(NINE | ATTRACTIVE_REPULSIVE | {"robot_radius": 0.105})
    start = random_starts(settings.world, 1000, 0)
    runs = simulate(Controller.of(settings), start)
    fastest = shortest_paths(settings.world, start.x, start.y) / settings.limits.v
    assert runs.arrived.all()
    assert np.median(runs.time / fastest) <= 1.10

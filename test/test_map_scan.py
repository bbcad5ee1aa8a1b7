# SPDX-License-Identifier: Apache-2.0
"""Potential map_scan: walls from a map, surprises from the lidar."""

import importlib.util
import time
from dataclasses import replace

import numpy as np
import pytest
from driving import drive

from tbot_gradnav.navigation import State
from tbot_gradnav.potentials import Points
from tbot_gradnav.shapes import Circle
from tbot_gradnav.shipped import configuration
from tbot_gradnav.world import World

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("skfmm") is None, reason="scikit-fmm is not installed"
)


@pytest.fixture(scope="module")
def office():
    return configuration("map_scan.yaml")


def among(office, obstacles, **more):
    """Return the office with other surprises, and what else is different."""
    return replace(office, settings=replace(office.settings, obstacles=obstacles, **more))


def test_the_gradient_is_that_of_the_value(office):
    potential = office.settings.chosen_potential.seeing(
        Points(np.array([5.0, 5.1, 8.3]), np.array([4.0, 4.05, 4.4]))
    )
    rng = np.random.default_rng(2)
    x, y = rng.uniform((0.3, 3.6), (11.5, 4.5), (300, 2)).T
    free = potential.room(x, y) > 0.05
    x, y, h = x[free], y[free], 1e-7
    g_x, g_y = potential(x, y).gradient
    by_x = (potential(x + h, y).phi - potential(x - h, y).phi) / (2 * h)
    by_y = (potential(x, y + h).phi - potential(x, y - h).phi) / (2 * h)
    wrong = np.hypot(by_x - g_x, by_y - g_y) / (1.0 + np.hypot(g_x, g_y)) > 1e-4
    assert np.mean(wrong) < 0.01  # where a difference spans two squares of the lattice


def test_walls_of_the_map_are_no_surprise(office):
    potential = office.settings.chosen_potential
    on_wall, off_wall = (5.0, 4.85), (5.0, 4.0)
    seen = potential.seeing(Points(*np.transpose([on_wall, off_wall]))).seen
    np.testing.assert_array_equal(np.transpose(seen), [off_wall])


def test_nothing_of_the_file_is_known_beforehand(office):
    blind = among(office, {}).settings.chosen_potential
    told = office.settings.chosen_potential
    x, y = np.array([5.2, 6.0, 8.0]), np.array([4.2, 4.1, 1.0])
    np.testing.assert_array_equal(told(x, y)[:3], blind(x, y)[:3])


def test_a_new_way_is_found_in_the_background(office):
    """The old one counts until it is there, so nobody waits for it."""
    beside_the_bin = Points(9.2 + 0.2 * np.cos(np.arange(24)), 2.7 + 0.2 * np.sin(np.arange(24)))
    potential, start = office.settings.chosen_potential, (8.2, 2.6)
    before = potential(*start).phi
    potential.prepare()
    potential = potential.seeing(beside_the_bin)
    assert potential(*start).phi == before
    deadline = time.monotonic() + 20.0
    while potential(*start).phi < 1.5 * before:  # the way round the table
        assert time.monotonic() < deadline
        time.sleep(0.02)
        potential = potential.seeing(beside_the_bin)


def test_it_goes_round_what_the_map_does_not_hold(office):
    goal = (10.5, 4.0)
    done = drive(among(office, office.settings.obstacles, goal=goal))
    direct = drive(among(office, {}, goal=goal))
    assert (done.state, direct.state) == (State.ARRIVED, State.ARRIVED), done.notices[-1:]
    assert done.clearance > 0.0
    length = [float(np.sum(np.hypot(*np.diff(d.path)))) for d in (done, direct)]
    assert length[0] > length[1] + 1.0  # the bin has cost it a way


def test_it_keeps_off_what_walks_in_its_way(office):
    """Somebody comes up the corridor at 0.1 m/s, on the other side than the robot's."""
    alone = among(office, {}, initial_pose=(6.5, 4.4, 3.1), goal=(2.0, 4.0))
    world = alone.settings.world

    def worlds(now):
        walker = Circle(2.5 + 0.1 * now, 3.75, 0.15)
        return World(world.goal, {"walker": walker}, robot_radius=0.105, walls=world.walls)

    done = drive(alone, worlds=worlds)
    assert done.state is State.ARRIVED, done.notices[-1:]
    assert done.clearance > 0.0


def test_a_way_that_is_closed_ends_in_a_word(office):
    door = {f"d{i}": Circle(10.35 + 0.24 * i, 3.25, 0.11) for i in range(3)}
    start = {"initial_pose": (9.5, 2.7, 0.0), "goal": (10.0, 4.2)}
    done = drive(among(office, door, **start))
    assert done.state is State.STUCK
    assert done.clearance > 0.0

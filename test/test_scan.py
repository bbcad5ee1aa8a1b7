# SPDX-License-Identifier: Apache-2.0
"""Potential scan: its field, and drives among what nobody told the robot."""

import math
import os
from dataclasses import replace

import numpy as np
import pytest
from driving import drive

from tbot_gradnav.controller import Controller
from tbot_gradnav.fake_lidar import LIDARS, FakeLidar
from tbot_gradnav.navigation import BLIND, Navigation, State
from tbot_gradnav.odometry import Reading
from tbot_gradnav.options import Configuration
from tbot_gradnav.potentials import Points, Scan
from tbot_gradnav.settings import Settings
from tbot_gradnav.shapes import Circle
from tbot_gradnav.simulate import simulate
from tbot_gradnav.unicycle import Pose
from tbot_gradnav.world import World

WORLDS = int(os.environ.get("GRADNAV_SCANS", "16"))  # 200 in make test-long
CROSSINGS = int(os.environ.get("GRADNAV_CROSSINGS", "10"))  # 100 in make test-long
ROBOT = 0.105
TYPICAL = {"potential": "scan", "driver_quirks": True, "range_noise": 0.01, "range_dropout": 0.05}


def arc(x, y, radius, n=200):
    """Return points seen all around a circle."""
    angle = np.linspace(0.0, 2.0 * math.pi, n, endpoint=False)
    return Points(x + radius * np.cos(angle), y + radius * np.sin(angle))


def scan(points, goal=(0.0, 0.0)):
    return Scan(World(goal, robot_radius=ROBOT)).seeing(points)


def test_the_gradient_is_that_of_the_value():
    potential = scan(Points(np.array([1.0, 1.05, -0.4]), np.array([0.3, 0.33, 0.9])))
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.5, 1.5, (2, 400))
    free = (potential.room(x, y) > 0.02) & (np.abs(potential.room(x, y) - 0.5) > 1e-4)
    x, y, h = x[free], y[free], 1e-6
    g_x, g_y = potential(x, y).gradient
    by_x = (potential(x + h, y).phi - potential(x - h, y).phi) / (2 * h)
    by_y = (potential(x, y + h).phi - potential(x, y - h).phi) / (2 * h)
    size = 1.0 + np.hypot(g_x, g_y)
    assert np.max(np.hypot(by_x - g_x, by_y - g_y) / size) < 1e-5


def test_with_nothing_seen_it_is_quadratic():
    x, y = np.array([1.0, -2.0]), np.array([0.5, 0.3])
    phi, g_x, g_y, _ = scan(Points(np.empty(0), np.empty(0)))(x, y)
    np.testing.assert_allclose((phi, g_x, g_y), (0.5 * (x * x + y * y), x, y))


def test_one_point_repels_as_khatib_says():
    potential = scan(Points(np.array([1.0]), np.array([0.0])))
    d = 0.2
    x = 1.0 - ROBOT - d
    k, d_0 = potential.k_repulsive, potential.influence_distance
    khatib = 0.5 * k * (1 / d - 1 / d_0) ** 2
    assert potential(x, 0.0).phi == pytest.approx(x * x * (0.5 + khatib), rel=1e-12)


def test_how_densely_a_wall_is_sampled_hardly_matters():
    x, y = np.linspace(-2.0, -0.6, 50), np.full(50, 0.2)
    coarse, fine = (scan(arc(0.0, 0.0, 0.3, n), (1.0, 0.0))(x, y).phi for n in (40, 640))
    assert np.all((fine > 0.99 * coarse) & (fine < 1.35 * coarse))  # 16 times as many points


def test_no_potential_is_lower_at_what_is_seen():
    potential = scan(arc(0.0, 0.0, 0.3), (1.0, 0.0))
    angle = np.linspace(0.0, 2.0 * math.pi, 300)
    r = 0.3 + ROBOT + 1e-4
    assert np.all(potential(r * np.cos(angle), r * np.sin(angle)).phi > 1e4)


def test_robots_simulated_together_see_each_their_own():
    settings = configuration((0.0, 0.0, 0.0), (2.0, 0.0), [(1.0, 0.1, 0.3)]).settings
    control, x = Controller.of(settings), np.array([0.0, -0.5])
    together = simulate(control, Pose.at(x, 0.2 * x, 0.0 * x), record=True)
    assert np.all(together.arrived & ~together.collided)
    for i in range(2):
        alone = simulate(
            control, Pose.at(x[i : i + 1], 0.2 * x[i : i + 1], np.zeros(1)), record=True
        )
        assert together.time[i] == alone.time[0]
        steps = alone.recorded.shape[1]
        np.testing.assert_array_equal(together.recorded[:, :steps, i], alone.recorded[:, :, 0])


def test_a_robot_without_its_lidar_stands_and_says_so():
    navigation = Navigation(Settings(potential="scan", goal=(2.0, 0.0)))
    for i in range(100):
        _, twist, notices = navigation.update(Reading(0.05 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        assert twist == (0.0, 0.0)
        assert "blind" in {notice.kind for notice in notices}
    assert navigation.state is State.WAITING  # not stuck
    assert BLIND <= 1.0


def test_a_lidar_that_shows_nothing_is_none_and_takes_nothing_away():
    """It may be covered: the circle ahead is still there."""
    settings = configuration((0.0, 0.0, 0.0), (2.0, 0.0), [(0.8, 0.0, 0.2)]).settings
    navigation = Navigation(settings)
    sensor = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_01"], 0.0, 0.0, 0)
    sweep = sensor.sweep(0.0, settings.start)
    for i in range(60):
        now = 0.05 * i
        covered = sweep._replace(stamp=now, ranges=0.0 * sweep.ranges)
        navigation.see(sweep if i == 0 else covered)
        _, twist, _ = navigation.update(Reading(now, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        assert navigation.potential.room(0.0, 0.0) == pytest.approx(0.6 - ROBOT, abs=0.03)
    assert twist == (0.0, 0.0)
    assert navigation.state is State.WAITING


def test_scans_a_little_ahead_of_odometry_are_placed():
    settings = configuration((0.0, 0.0, 0.0), (2.0, 0.0), [(3.0, 0.5, 0.2)]).settings
    navigation = Navigation(settings)
    sensor = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_01"], 0.0, 0.0, 0)
    for i in range(60):
        now = 0.05 * i
        if i % 4 == 0:
            navigation.see(sensor.sweep(now + 0.45, settings.start))
        _, twist, _ = navigation.update(Reading(now, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    assert twist.v > 0.0


def test_scans_too_late_to_be_placed_are_said_to_be():
    settings = configuration((0.0, 0.0, 0.0), (2.0, 0.0), [(3.0, 0.5, 0.2)]).settings
    navigation = Navigation(settings)
    sensor = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_01"], 0.0, 0.0, 0)
    for i in range(100):
        navigation.see(sensor.sweep(0.05 * i - 3.0, settings.start))
        _, twist, notices = navigation.update(Reading(0.05 * i, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        assert twist == (0.0, 0.0)
    assert "3 s older than the odometry" in notices[-1].text


def test_a_change_of_gains_keeps_what_has_been_seen():
    settings = configuration((0.0, 0.0, 0.0), (2.0, 0.0), [(0.8, 0.1, 0.2)]).settings
    navigation = Navigation(settings)
    sensor = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_01"], 0.0, 0.0, 0)
    navigation.see(sensor.sweep(0.0, settings.start))
    navigation.update(Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    before = navigation.potential
    navigation.change(replace(settings, k_omega=2.0))
    assert navigation.potential is before


def configuration(start, goal=(0.0, 0.0), circles=(), **more):
    """Return a robot with a lidar among circles (x, y, radius)."""
    values = TYPICAL | {"initial_pose": list(start), "goal": list(goal)} | more
    names = [f"o{i}" for i in range(len(circles))]
    for name, circle in zip(names, circles, strict=True):
        keys = (f"obstacles.{name}.{key}" for key in ("x", "y", "radius"))
        values |= dict(zip(keys, map(float, circle), strict=True))
    return Configuration.of(values | {"obstacles.names": names})


def random_world(seed):
    """Return 6 to 12 circles half a metre apart, and a start among them, 2 m from the goal."""
    rng = np.random.default_rng(seed)
    circles = []
    while len(circles) < 6 + seed % 7:
        x, y, radius = rng.uniform((-3.0, -3.0, 0.15), (3.0, 3.0, 0.4))
        apart = all(math.hypot(x - a, y - b) >= radius + r + 0.5 for a, b, r in circles)
        if apart and math.hypot(x, y) > radius + 0.5:
            circles.append((x, y, radius))
    while True:
        x, y, yaw = rng.uniform((-3.5, -3.5, -math.pi), (3.5, 3.5, math.pi))
        if math.hypot(x, y) > 2.0 and all(
            math.hypot(x - a, y - b) > r + 0.25 for a, b, r in circles
        ):
            return (x, y, yaw), circles


def test_random_worlds_that_nobody_told_it():
    states = []
    for seed in range(WORLDS):
        start, circles = random_world(seed)
        done = drive(configuration(start, circles=circles, seed=seed))
        assert done.clearance > 0.0, (seed, done.clearance)
        assert done.state in (State.ARRIVED, State.STUCK), seed
        assert (done.state is State.STUCK) == any(n.kind == "stuck" for n in done.notices)
        states.append(done.state)
    assert states.count(State.ARRIVED) >= 0.99 * WORLDS


def crossing(seed):
    """Return a start, and a circle that crosses the straight way at 0.1 m/s as the robot comes."""
    rng = np.random.default_rng(seed)
    radius, direction = rng.uniform(0.15, 0.35), rng.uniform(0.0, 2.0 * math.pi)
    meeting = rng.uniform(-2.2, -0.8)
    when = (meeting + 3.0) / 0.2 + rng.uniform(-4.0, 4.0)
    v_x, v_y = 0.1 * math.cos(direction), 0.1 * math.sin(direction)

    def world(now):
        where = meeting + v_x * (now - when), v_y * (now - when)
        return World((0.0, 0.0), {"walker": Circle(*where, radius)}, robot_radius=ROBOT)

    return (-3.0, 0.0, rng.uniform(-0.5, 0.5)), world


def test_what_crosses_its_way_is_avoided():
    """Walkers a metre from the robot when it sets out leave it time; those nearer are left out."""
    driven, seed = 0, 0
    while driven < CROSSINGS:
        seed += 1
        start, world = crossing(seed)
        if world(0.0).clearance(*start[:2]) < 0.5:
            continue
        done = drive(configuration(start, seed=seed), worlds=world)
        assert done.clearance > 0.0, seed
        assert done.state is State.ARRIVED, seed
        driven += 1


def test_the_ball_of_a_goal_with_an_orientation_is_what_is_seen_free():
    start, goal = (-2.0, 0.2, 0.0), (0.0, 0.0, 1.5)
    for circles in ([(3.0, 0.0, 0.3)], [(0.55, 0.0, 0.15)]):
        done = drive(configuration(start, goal, circles))
        assert done.state is State.ARRIVED
        assert done.clearance > 0.0


def test_a_new_goal_keeps_what_has_been_seen():
    settings = configuration(
        (-2.0, 0.0, 0.0), (2.0, 0.1), [(-1.6, 0.15, 0.25)], auto_reverse=False
    ).settings
    navigation = Navigation(settings)
    sensor = FakeLidar(settings.world, settings.lidar_x, LIDARS["lds_02"], 0.0, 0.0, 0)
    sweep = sensor.sweep(0.0, settings.start)
    reading = Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    navigation.see(sweep)
    _, before, _ = navigation.update(reading)
    navigation.change(replace(settings, goal=(2.0, 0.0)))
    _, after, _ = navigation.update(reading._replace(stamp=0.05))
    assert before.omega < 0.0  # the circle is ahead, to the left
    assert after.omega < 0.0  # the new goal is straight ahead

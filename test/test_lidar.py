# SPDX-License-Identifier: Apache-2.0
"""Sweeps as lidars publish them, rays against closed forms, and what is remembered of them."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbot_gradnav.fake_lidar import LIDARS, FakeLidar, cast
from tbot_gradnav.lidar import BadScanError, Sweep
from tbot_gradnav.shapes import Box, Circle, Ellipse
from tbot_gradnav.sightings import CELL, MEMORY, MISSES, TOO_NEAR, Sightings
from tbot_gradnav.unicycle import Pose
from tbot_gradnav.world import Boundary, World

ORIGIN = Pose(0.0, 0.0, 1.0, 0.0)
BURGER = -0.032  # [m] the lidar is behind the centre


def message(ranges, angle_min=0.0, increment=math.pi / 180, limits=(0.12, 3.5), sec=5):
    """Return what has the fields of a LaserScan."""
    stamp = SimpleNamespace(sec=sec, nanosec=500_000_000)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp), angle_min=angle_min, angle_increment=increment,
        range_min=limits[0], range_max=limits[1], ranges=ranges,
    )  # fmt: skip


def around(*obstacles, boundary=None):
    """Return a world of obstacles as a lidar sees it."""
    named = {str(i): obstacle for i, obstacle in enumerate(obstacles)}
    return World((0.0, 0.0), named, boundary or Boundary(), 0.105)


def lidar(world, model="lds_01", noise=0.0, dropout=0.0, seed=0):
    return FakeLidar(world, BURGER, LIDARS[model], noise, dropout, seed)


@pytest.mark.parametrize("nothing", [0.0, math.nan, math.inf, -math.inf, -1.0, 0.05, 100.0])
def test_what_is_no_measurement_is_no_point(nothing):
    for limits in ((0.12, 3.5), (0.0, 100.0)):  # LDS-01, LDS-02
        sweep = Sweep.of(message([1.0, nothing, 2.0], limits=limits))
        x, y = sweep.points(ORIGIN)
        np.testing.assert_allclose(np.hypot(x, y), [1.0, 2.0])
        np.testing.assert_allclose(np.arctan2(y, x), [0.0, 2 * math.pi / 180])


def test_the_lds_02_measures_less_than_it_publishes():
    assert Sweep.of(message([1.0], limits=(0.0, 100.0))).reach == (0.16, 8.0)
    assert Sweep.of(message([1.0], limits=(0.0, math.inf))).reach == (0.16, 8.0)
    assert Sweep.of(message([1.0], limits=(0.12, 3.5))).reach == (0.12, 3.5)


@pytest.mark.parametrize(
    "fields",
    [{"increment": 0.0}, {"increment": 1e-300}, {"increment": math.nan}, {"angle_min": math.inf}],
)
def test_a_sweep_that_cannot_be_placed_is_refused(fields):
    with pytest.raises(BadScanError, match="angle"):
        Sweep.of(message([1.0, 2.0], **fields))


@pytest.mark.parametrize(
    ("ranges", "limits"),
    [([], (0.12, 3.5)), ([1.0], (math.nan, 3.5)), ([1.0], (0.0, 0.0)), ([1.0], (0.0, math.nan))],
)
def test_a_sweep_that_cannot_measure_is_refused(ranges, limits):
    with pytest.raises(BadScanError, match="measures nothing"):
        Sweep.of(message(ranges, limits=limits))


def test_a_sweep_may_turn_either_way():
    x, y = Sweep.of(message([1.0, 1.0], increment=-math.pi / 2)).points(ORIGIN)
    np.testing.assert_allclose((x, y), [[1.0, 0.0], [0.0, -1.0]], atol=1e-12)


@given(
    st.lists(st.floats(width=32), min_size=1, max_size=400),
    st.floats(-7.0, 7.0),
    st.floats(-1.0, 1.0),
)
def test_no_sweep_brings_a_point_that_was_not_measured(ranges, angle_min, increment):
    if abs(increment) < 1e-5:
        return
    sweep = Sweep.of(message(ranges, angle_min, increment))
    x, y = sweep.points(Pose.at(1.0, 2.0, 0.5))
    distance = np.hypot(x - 1.0, y - 2.0)
    assert np.all((distance >= 0.12 - 1e-9) & (distance <= 3.5 + 1e-9))
    sightings = Sightings()
    for _ in range(2):
        sightings.update(sweep, Pose.at(1.0, 2.0, 0.5))
    assert np.all(np.isfinite(sightings.points))


@given(st.floats(0.0, 2.0 * math.pi), st.floats(0.5, 3.0), st.floats(0.1, 0.4))
def test_a_ray_at_a_circle_agrees_with_the_closed_form(direction, distance, radius):
    world = around(Circle(distance, 0.0, radius))
    found = float(cast(replaced(world), Pose.at(0.0, 0.0, direction), 8.0)[0])
    across = distance * math.sin(direction)
    if math.cos(direction) < 0.0 or abs(across) > radius:
        assert found == math.inf or abs(across) < radius + 0.002
    elif abs(across) < 0.99 * radius:
        expected = distance * math.cos(direction) - math.sqrt(radius**2 - across**2)
        assert found == pytest.approx(expected, abs=0.01)


def replaced(world):
    """Return a world for a robot without a size."""
    return World(world.goal, world.obstacles, world.boundary, 0.0)


def test_every_return_lies_on_something():
    shapes = Circle(1.0, 0.5, 0.3), Box(-1.0, 0.0, 0.5, 0.3, 0.4), Ellipse(0.0, -1.2, 0.5, 0.2, 1.0)
    room = Boundary(shape="polygon", points=(-2.0, -2.0, 2.0, -2.0, 2.0, 2.0, -2.0, 2.0))
    world = around(*shapes, boundary=room)
    for model in LIDARS:
        robot = Pose.at(0.2, 0.1, 0.7)
        sweep = lidar(world, model).sweep(0.0, robot)
        x, y = sweep.points(robot.compose(Pose(BURGER, 0.0, 1.0, 0.0)))
        assert x.size == sweep.ranges.size  # a room: every beam comes back
        np.testing.assert_allclose(replaced(world).clearance(x, y), 0.0, atol=2e-3)


def test_the_lidars_publish_as_the_real_ones_do():
    world, robot = around(Circle(1.0, 0.0, 0.2)), ORIGIN
    first, second = (lidar(world, "lds_01", dropout=0.5, seed=s).sweep(1.0, robot) for s in (1, 2))
    assert (first.range_min, first.range_max, first.ranges.size) == (0.12, 3.5, 360)
    assert np.count_nonzero(first.ranges == 0.0) > 300
    assert not np.array_equal(first.ranges, second.ranges)
    of_two = lidar(world, "lds_02")
    sweeps = [of_two.sweep(1.0, robot) for _ in range(20)]
    assert len({s.ranges.size for s in sweeps}) > 3
    assert all(np.isnan(s.ranges).sum() > 400 for s in sweeps)
    assert (sweeps[0].range_min, sweeps[0].range_max) == (0.0, 100.0)


def test_noise_and_dropout_are_what_they_are_said_to_be():
    room = around(boundary=Boundary(radius=2.0))
    exact = lidar(room).sweep(0.0, ORIGIN).ranges
    sensor = lidar(room, noise=0.01, dropout=0.05)
    noisy = np.array([sensor.sweep(0.0, ORIGIN).ranges for _ in range(50)])
    kept = noisy > 0.0
    assert np.mean(kept) == pytest.approx(0.95, abs=0.01)
    assert np.std((noisy - exact)[kept]) == pytest.approx(0.01, rel=0.05)


def test_what_is_seen_is_remembered_where_it_is():
    world = around(Circle(1.0, 0.0, 0.3))
    sightings, sensor = Sightings(), lidar(world, noise=0.01, dropout=0.05)
    for i in range(20):
        robot = Pose.at(0.0, 0.01 * i, 0.1 * i)
        sightings.update(sensor.sweep(0.2 * i, robot), robot.compose(Pose(BURGER, 0.0, 1.0, 0.0)))
    x, y = sightings.points
    assert x.size > 5
    assert np.all(np.abs(np.hypot(x - 1.0, y) - 0.3) < 0.03 + CELL / 2)


def test_what_has_gone_is_forgotten_and_the_rest_is_not():
    there, gone = Circle(1.0, 0.0, 0.3), Circle(-1.0, 0.0, 0.3)
    sightings = Sightings()
    sightings.update(lidar(around(there, gone)).sweep(0.0, ORIGIN), ORIGIN)
    assert np.any(sightings.points.x < 0.0)
    for i in range(1, MISSES + 1):
        sightings.update(lidar(around(there), seed=i).sweep(0.2 * i, ORIGIN), ORIGIN)
        assert np.any(sightings.points.x < 0.0) == (i < MISSES)
        assert np.any(sightings.points.x > 0.0)


def test_what_is_hidden_is_remembered_for_a_while():
    far, near = Circle(2.0, 0.0, 0.2), Circle(1.0, 0.0, 0.5)
    sightings = Sightings()
    sightings.update(lidar(around(far)).sweep(0.0, ORIGIN), ORIGIN)
    seen = sightings.points.x.max()
    for i in range(1, 200):
        stamp = 0.2 * i
        sightings.update(lidar(around(near)).sweep(stamp, ORIGIN), ORIGIN)
        assert (sightings.points.x.max() >= seen) == (stamp <= MEMORY)


def test_what_is_too_near_to_be_seen_is_remembered_for_less():
    room, near = Boundary(radius=2.0), Circle(0.3, 0.0, 0.1)
    beside = Pose(0.14, 0.0, 1.0, 0.0)  # 0.06 m from it: nearer than an LDS-02 measures
    for world, until in ((around(near), TOO_NEAR), (around(boundary=room), 0.2 * (MISSES - 1))):
        sightings = Sightings()
        sightings.update(lidar(around(near), "lds_02").sweep(0.0, ORIGIN), ORIGIN)
        for i in range(1, 80):
            stamp = 0.2 * i
            sightings.update(lidar(world, "lds_02").sweep(stamp, beside), beside)
            x, y = sightings.points
            assert np.any(np.hypot(x - 0.3, y) < 0.15) == (stamp <= until + 1e-9), stamp


def test_before_a_robot_that_waits_nothing_is_forgotten_for_its_age():
    near, beside = Circle(0.3, 0.0, 0.1), Pose(0.14, 0.0, 1.0, 0.0)
    sensor, sightings = lidar(around(near), "lds_02"), Sightings()
    sightings.update(sensor.sweep(0.0, ORIGIN), ORIGIN)
    for i in range(1, 200):
        sightings.update(sensor.sweep(0.2 * i, beside), beside, driving=False)
    assert np.any(np.hypot(sightings.points.x - 0.3, sightings.points.y) < 0.15)


def test_a_lost_sweep_forgets_nothing():
    sensor = lidar(around(Circle(1.0, 0.0, 0.3)))
    sightings = Sightings()
    sightings.update(sensor.sweep(0.0, ORIGIN), ORIGIN)
    before = sightings.points.x.size
    blind = lidar(around(Circle(1.0, 0.0, 0.3)), dropout=1.0)
    for i in range(1, MISSES):
        sightings.update(blind.sweep(0.2 * i, ORIGIN), ORIGIN)
    sightings.update(sensor.sweep(0.2 * MISSES, ORIGIN), ORIGIN)
    assert sightings.points.x.size == before

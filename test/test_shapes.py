# SPDX-License-Identifier: Apache-2.0
"""Convex obstacles and rooms: exact distances, and potentials built on them."""

import math
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbot_gradnav.certify import landscape
from tbot_gradnav.commands.check import judge
from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import ParameterError
from tbot_gradnav.settings import Settings
from tbot_gradnav.shapes import Box, Circle, Ellipse, Polygon
from tbot_gradnav.simulate import random_starts, simulate

ROOMS = int(os.environ.get("GRADNAV_ROOMS", "3"))  # random rooms; 100 in `make test-long`
SHAPES = {
    "circle": Circle(0.3, -0.2, 0.5),
    "box": Box(0.3, -0.2, 1.2, 0.5, 0.7),
    "square": Box(0.0, 0.0, 1.0, 1.0, 0.0),
    "ellipse": Ellipse(0.3, -0.2, 0.9, 0.3, 1.1),
    "tall ellipse": Ellipse(0.0, 0.0, 0.2, 1.1, 0.0),
    "round ellipse": Ellipse(0.1, 0.2, 0.5, 0.5, 0.4),
    "triangle": Polygon((0.0, 0.0, 1.0, 0.1, 0.3, 0.9)),
    "clockwise pentagon": Polygon((0.0, 0.9, 0.8, 0.3, 0.5, -0.6, -0.5, -0.6, -0.8, 0.3)),
}
POINTS = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
quick = settings(deadline=None, derandomize=True, max_examples=60)


def is_inside(shape, x, y):
    """Whether the outline winds round a point."""
    outline_x, outline_y = shape.outline
    angles = np.unwrap(np.arctan2(np.append(outline_y, outline_y[0]) - y,
                                  np.append(outline_x, outline_x[0]) - x))  # fmt: skip
    return abs(angles[-1] - angles[0]) > math.pi


@pytest.mark.parametrize("name", SHAPES)
@quick
@given(point=POINTS)
def test_the_distance_is_that_of_the_nearest_point_of_the_outline(name, point):
    shape = SHAPES[name]
    outline_x, outline_y = shape.outline
    nearest = np.min(np.hypot(outline_x - point[0], outline_y - point[1]))
    d = float(shape.distance(*point).d)
    assert abs(abs(d) - nearest) < 0.01  # the spacing of the outline
    if nearest > 0.01:
        assert (d < 0.0) == is_inside(shape, *point)


@pytest.mark.parametrize("name", SHAPES)
@quick
@given(point=POINTS)
def test_outside_the_gradient_is_that_of_the_distance(name, point):
    shape, (x, y), h = SHAPES[name], point, 1e-6
    d, n_x, n_y = shape.distance(x, y)
    if d < 1e-3:
        return
    by_x = (shape.distance(x + h, y).d - shape.distance(x - h, y).d) / (2.0 * h)
    by_y = (shape.distance(x, y + h).d - shape.distance(x, y - h).d) / (2.0 * h)
    assert math.hypot(n_x - by_x, n_y - by_y) < 1e-5
    assert math.hypot(n_x, n_y) == pytest.approx(1.0)


@pytest.mark.parametrize("name", SHAPES)
def test_a_batch_is_what_each_point_is_alone(name):
    x, y = np.random.default_rng(0).uniform(-2, 2, (2, 50))
    batch = SHAPES[name].distance(x, y)
    for i in range(50):
        assert [float(v[i]) for v in batch] == pytest.approx(
            [float(v) for v in SHAPES[name].distance(x[i], y[i])], abs=1e-12
        )


@quick
@given(point=POINTS, yaw=st.floats(-3.0, 3.0), turn=st.floats(-3.0, 3.0))
def test_turning_shape_and_point_together_changes_nothing(point, yaw, turn):
    cos, sin = math.cos(turn), math.sin(turn)
    x, y = cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]
    for make in (
        lambda angle: Box(0, 0, 1.0, 0.4, angle),
        lambda angle: Ellipse(0, 0, 0.8, 0.3, angle),
    ):
        before, after = make(yaw).distance(*point), make(yaw + turn).distance(x, y)
        assert float(after.d) == pytest.approx(float(before.d), abs=1e-9)


@pytest.mark.parametrize(
    "points",
    [(), (0, 0, 1, 0), (0, 0, 1, 0, 2, 0), (0, 0, 2, 0, 0.5, 0.5, 0, 2), (0, 0, 1, 1, 1, 0, 0, 1)],
)
def test_a_polygon_must_be_convex(points):
    with pytest.raises(ParameterError, match="convex polygon"):
        Polygon(points)


@pytest.mark.parametrize(
    ("shape", "sizes"),
    [
        (Circle, {"radius": 1e-320}),
        (Box, {"width": 1e-17, "height": 1.0}),
        (Ellipse, {"semi_x": 1.0, "semi_y": 1e-200}),
        (Polygon, {"points": (0, 0, 1e-160, -1e-160, 0, 1e-160)}),
    ],
)
def test_a_shape_so_thin_that_its_sides_vanish_in_rounding_is_refused(shape, sizes):
    with pytest.raises(ParameterError):
        shape(**sizes)


ROOM = {
    "goal": [0.3, 0.2], "initial_pose": [-2.5, 2.3, 0.5], "navigation_function.k": 12,
    "attractive_repulsive.influence_distance": 0.3,
    "boundary.shape": "polygon", "boundary.points": [-3, -3, 3, -3, 3, 3, -3, 3],
    "obstacles.names": ["a", "b", "c", "d"],
    "obstacles.a.x": -1.5, "obstacles.a.y": -1.2, "obstacles.a.radius": 0.3,
    "obstacles.b.shape": "box", "obstacles.b.x": -1.2, "obstacles.b.y": 1.2,
    "obstacles.b.width": 0.6, "obstacles.b.height": 0.3, "obstacles.b.yaw": 0.2,
    "obstacles.c.shape": "ellipse", "obstacles.c.x": 1.7, "obstacles.c.y": -1.2,
    "obstacles.c.semi_x": 0.5, "obstacles.c.semi_y": 0.3, "obstacles.c.yaw": 0.9,
    "obstacles.d.shape": "polygon", "obstacles.d.points": [1.2, 1.4, 1.8, 1.4, 1.4, 2.0],
}  # fmt: skip


@pytest.mark.parametrize("potential", ["navigation_function", "attractive_repulsive"])
@quick
@given(point=POINTS)
def test_the_gradient_in_a_room_is_that_of_the_potential(potential, point):
    made = Settings.of(ROOM | {"potential": potential}).chosen_potential
    x, y, h = *point, 1e-6
    if made.world.clearance(x, y) < 0.02:
        return
    field = made(x, y)
    by_x = (made(x + h, y).phi - made(x - h, y).phi) / (2.0 * h)
    by_y = (made(x, y + h).phi - made(x, y - h).phi) / (2.0 * h)
    scale = 1.0 + math.hypot(*field.gradient)
    assert np.hypot(field.gradient[0] - by_x, field.gradient[1] - by_y) < 1e-5 * scale


def test_a_wall_square_to_the_goal_is_found_to_trap():
    wall = {
        "goal": [0, 0], "obstacles.names": ["wall"], "obstacles.wall.shape": "box",
        "obstacles.wall.x": 1.0, "obstacles.wall.y": 0.0, "obstacles.wall.width": 0.2,
        "obstacles.wall.height": 1.5, "initial_pose": [2.0, 0.3, 3.0],
    }  # fmt: skip
    verdict = judge(Settings.of(wall))
    assert not verdict.sound
    (trap,) = verdict.found.spurious
    assert trap.x > 1.2
    assert trap.y == pytest.approx(0.0, abs=1e-6)


def random_room(seed):
    """Five to twelve mixed shapes in a room of 6 by 6 m, at least 0.45 m apart."""
    rng = np.random.default_rng(seed)
    n, values, placed = rng.integers(5, 13), {}, []
    while len(placed) < n:
        x, y = rng.uniform(-2.4, 2.4, 2)
        reach = rng.uniform(0.15, 0.3)
        clear = [math.hypot(x - a, y - b) - reach - r for a, b, r in placed]
        if min([*clear, math.hypot(x, y) - reach]) < 0.45:
            continue
        yaw, prefix = float(rng.uniform(-3, 3)), f"obstacles.o{len(placed)}."
        placed.append((x, y, reach))
        kind = ("circle", "box", "ellipse", "polygon")[rng.integers(4)]
        entry = {"shape": kind, "x": float(x), "y": float(y)}
        if kind == "circle":
            entry |= {"radius": float(reach)}
        elif kind == "box":
            entry |= {"width": 1.6 * reach, "height": 1.1 * reach, "yaw": yaw}
        elif kind == "ellipse":
            entry |= {"semi_x": float(reach), "semi_y": 0.7 * reach, "yaw": yaw}
        else:
            turns = yaw + np.array([0.0, 1.3, 2.4, 3.9, 5.1])
            corners = np.stack([x + reach * np.cos(turns), y + reach * np.sin(turns)], axis=1)
            entry = {"shape": kind, "points": corners.ravel().tolist()}
        values |= {prefix + key: value for key, value in entry.items()}
    names = [f"o{i}" for i in range(n)]
    corners = [-3, -3, 3, -3, 3, 3, -3, 3]
    return values | {
        "obstacles.names": names, "goal": [0, 0], "boundary.shape": "polygon",
        "boundary.points": corners, "attractive_repulsive.influence_distance": 0.2,
        "attractive_repulsive.k_repulsive": 0.002,
    }  # fmt: skip


def test_in_certified_rooms_every_robot_arrives_and_none_collides():
    certified, seed = 0, 0
    while certified < ROOMS:
        seed += 1
        made = Settings.of(random_room(seed))
        found = landscape(made.chosen_potential, made.xy_goal_tolerance)
        if found.spurious or not found.agrees:
            continue
        certified += 1
        runs = simulate(Controller.of(made), random_starts(made.world, 100, seed))
        assert runs.arrived.all(), seed
        assert not runs.collided.any(), seed


@pytest.mark.parametrize("name", [name for name in SHAPES if "ellipse" in name])
def test_from_its_centre_there_is_a_way_out_of_an_ellipse(name):
    shape = SHAPES[name]
    d, n_x, n_y = shape.distance(*shape.centre)
    assert d == pytest.approx(-min(shape.semi_x, shape.semi_y))
    assert math.hypot(n_x, n_y) == pytest.approx(1.0)

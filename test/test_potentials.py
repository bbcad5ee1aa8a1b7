# SPDX-License-Identifier: Apache-2.0
"""Potentials against slow, obvious references in decimal arithmetic of 60 digits.

The references write each potential as its textbook does, with plain products and powers, and
difference it numerically. In 60 digits that is exact where floats would round psi to 1, overflow,
or lose the difference: 1e-3 m from an obstacle, next to the goal, and at k = 20.
"""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from arenas import NINE, controller, disc, obstacles
from hypothesis import given
from hypothesis import strategies as st

DIGITS = 60
H = Decimal("1e-20")  # [m] of the difference quotients, whose error is of order H^2
CLOSING_IN = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # [m]
SMALL = {  # a small world off the origin, with an obstacle close to the goal
    "goal": [0.3, -0.2],
    "initial_pose": [0.3, -0.2, 0.0],
    "robot_radius": 0.105,
    **disc(3.0, 0.1, 0.2),
    **obstacles([(1.1, 0.1, 0.4), (-0.9, 1.0, 0.3), (-0.4, -1.3, 0.5)]),
}
QUADRATIC = {"potential": "quadratic"}
PSI = {
    f"psi{k}": {"potential": "navigation_function", "navigation_function.k": k}
    for k in (1.5, 8, 20)
}
U = {
    f"U{name}": {
        "potential": "attractive_repulsive",
        "attractive_repulsive.k_attractive": 0.7,
        "attractive_repulsive.k_repulsive": 0.02,
        "attractive_repulsive.influence_distance": 0.5,
        "attractive_repulsive.goal_scaled": scaled,
    }
    for name, scaled in (("_scaled", True), ("_plain", False))
}
ALL = {"quadratic": QUADRATIC, **PSI, **U}
AVOIDING = {**PSI, **U}


def by_name(potentials):
    return pytest.mark.parametrize("gains", potentials.values(), ids=potentials.keys())


def potential(gains, world=SMALL):
    return controller(world, gains).potential


def reference(field, x, y):
    """Return the value of a potential at a point given as Decimals."""
    gamma = (x - Decimal(field.world.goal[0])) ** 2 + (y - Decimal(field.world.goal[1])) ** 2
    return {
        "Quadratic": lambda: gamma / 2,
        "NavigationFunction": lambda: _psi(field, gamma, x, y),
        "AttractiveRepulsive": lambda: _u(field, gamma, x, y),
    }[type(field).__name__]()


def _psi(field, gamma, x, y):
    """Psi = gamma / (gamma^k + B)^(1/k), B the product of all beta_i."""
    world, k = field.world, Decimal(field.k)
    product = (Decimal(world.boundary.radius) - Decimal(world.robot_radius)) ** 2
    product -= _squared(x, y, world.boundary)
    for circle in world.obstacles.values():
        radius = Decimal(circle.radius) + Decimal(world.robot_radius)
        product *= _squared(x, y, circle) - radius**2
    return gamma / (gamma**k + product) ** (1 / k)


def _u(field, gamma, x, y):
    """U = k_a rho^2 / 2 + (rho^2 or 1) * sum of k_r (1/d_i - 1/d_0)^2 / 2 where d_i < d_0."""
    world, d_0 = field.world, Decimal(field.influence_distance)
    radius = Decimal(world.robot_radius)
    d = [
        _squared(x, y, circle).sqrt() - Decimal(circle.radius) - radius
        for circle in world.obstacles.values()
    ]
    d.append(Decimal(world.boundary.radius) - radius - _squared(x, y, world.boundary).sqrt())
    repulsion = sum(((1 / d_i - 1 / d_0) ** 2 for d_i in d if d_i < d_0), Decimal(0)) / 2
    weight = gamma if field.goal_scaled else 1
    attraction = Decimal(field.k_attractive) * gamma / 2
    return attraction + weight * Decimal(field.k_repulsive) * repulsion


def _squared(x, y, circle):
    return (x - Decimal(circle.x)) ** 2 + (y - Decimal(circle.y)) ** 2


def differenced(field, x, y):
    """Return the value and the gradient of the reference at a point given as floats."""
    with localcontext() as context:
        context.prec = DIGITS
        x, y = Decimal(x), Decimal(y)
        return (
            float(reference(field, x, y)),
            float((reference(field, x + H, y) - reference(field, x - H, y)) / (2 * H)),
            float((reference(field, x, y + H) - reference(field, x, y - H)) / (2 * H)),
        )


def anywhere(world, n, clearance, seed=0):
    """Return n points of a bounded world that are so far [m] clear of everything."""
    rng = np.random.default_rng(seed)
    boundary = world.boundary
    x, y = rng.uniform(-boundary.radius, boundary.radius, (2, 100 * n))
    x, y = x + boundary.x, y + boundary.y
    free = world.clearance(x, y) >= clearance
    return list(zip(x[free][:n].tolist(), y[free][:n].tolist(), strict=True))


def around(circle, distance, n=8):
    """Return n points all around a circle, this far [m] outside it; negative: inside."""
    angles = 0.1 + 2.0 * np.pi * np.arange(n) / n
    reach = circle.radius + distance
    return [(circle.x + reach * math.cos(a), circle.y + reach * math.sin(a)) for a in angles]


def near_obstacles(world, clearance):
    circles = world.obstacles.values()
    return [p for c in circles for p in around(c, world.robot_radius + clearance)]


def near_boundary(world, clearance):
    return around(world.boundary, -world.robot_radius - clearance)


def near_goal(world, distance):
    x, y = world.goal
    return [(x + distance * math.cos(a), y + distance * math.sin(a)) for a in range(6)]


def assert_like_reference(field, points, tolerance):
    for x, y in points:
        phi, g_x, g_y = differenced(field, x, y)
        got = field(x, y)
        assert got.phi == pytest.approx(phi, rel=tolerance, abs=1e-300), (x, y)
        error = math.hypot(got.gradient[0] - g_x, got.gradient[1] - g_y)
        assert error <= tolerance * math.hypot(g_x, g_y), (x, y)


@by_name(ALL)
def test_value_and_gradient_agree_with_differences_anywhere(gains):
    field = potential(gains)
    assert_like_reference(field, anywhere(field.world, 30, clearance=0.01), 1e-9)


@by_name(ALL)
@pytest.mark.parametrize("clearance", [1e-2, 1e-3, 1e-5])
def test_value_and_gradient_agree_with_differences_near_obstacles_and_boundary(gains, clearance):
    field = potential(gains)
    points = near_obstacles(field.world, clearance) + near_boundary(field.world, clearance)
    assert_like_reference(field, points, 1e-6)


@by_name(ALL)
@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6])
def test_value_and_gradient_agree_with_differences_near_the_goal(gains, distance):
    field = potential(gains)
    assert_like_reference(field, near_goal(field.world, distance), 1e-6)


@by_name({"psi8": PSI["psi8"], "U": U["U_scaled"]})
def test_value_and_gradient_agree_with_differences_in_the_arena_of_nine(gains):
    field = potential(gains, NINE)
    assert_like_reference(field, anywhere(field.world, 20, clearance=0.01), 1e-6)


@by_name(AVOIDING)
@pytest.mark.parametrize("depth", [0.0, 1e-12, 1e-3, 0.05, 0.3])
def test_at_and_inside_an_obstacle_the_field_leads_out(gains, depth):
    field = potential(gains)
    for circle in field.world.obstacles.values():
        for x, y in around(circle, field.world.robot_radius - depth):
            _, cos, sin = field(x, y).polar
            outward = np.array([x - circle.x, y - circle.y])
            assert -np.dot([cos, sin], outward) > 0.9 * np.linalg.norm(outward)


@by_name(AVOIDING)
@pytest.mark.parametrize("depth", [0.0, 1e-12, 1e-3, 0.5, 100.0])
def test_at_and_outside_the_boundary_the_field_leads_in(gains, depth):
    field = potential(gains)
    boundary = field.world.boundary
    for x, y in around(boundary, depth - field.world.robot_radius):
        _, cos, sin = field(x, y).polar
        inward = np.array([boundary.x - x, boundary.y - y])
        assert -np.dot([cos, sin], inward) > 0.9 * np.linalg.norm(inward)


@by_name(AVOIDING)
def test_the_centre_of_an_obstacle_has_a_finite_gradient(gains):
    field = potential(gains)
    for circle in field.world.obstacles.values():
        assert np.isfinite([*field(circle.x, circle.y), *field(circle.x, circle.y).polar]).all()


@by_name({"quadratic": QUADRATIC, **PSI, "U_scaled": U["U_scaled"]})
def test_the_value_is_zero_at_the_goal_and_positive_elsewhere(gains):
    field = potential(gains)
    assert 0.0 <= field(*field.world.goal).phi < 1e-200
    assert field(*field.world.goal).polar[0] == 0.0
    elsewhere = anywhere(field.world, 100, clearance=0.0) + near_goal(field.world, 1e-6)
    assert min(field(x, y).phi for x, y in elsewhere) > 0.0


def test_goal_scaling_puts_the_minimum_back_that_an_obstacle_by_the_goal_pushed_away():
    x, y = potential(U["U_plain"]).world.goal
    assert math.hypot(*potential(U["U_plain"])(x, y).gradient) > 1e-3
    assert potential(U["U_scaled"])(x, y).gradient == (0.0, 0.0)


@by_name(AVOIDING)
def test_the_value_rises_all_the_way_to_every_obstacle_and_the_boundary(gains):
    field = potential(gains)
    nearer = [near_obstacles(field.world, d) + near_boundary(field.world, d) for d in CLOSING_IN]
    values = np.array([[field(x, y).phi for x, y in points] for points in nearer])
    rises, rounds_to_one = np.diff(values, axis=0) > 0.0, values[1:] == 1.0
    assert (rises | rounds_to_one).all()


def a_hundred_obstacles():
    """Return a grid of 100 obstacles about the goal in a disc of 12 m."""
    at = np.arange(-9.0, 10.0, 2.0)
    return {
        "goal": [0.0, 0.0],
        **disc(15.0),
        **obstacles([(float(x), float(y), 0.3) for x in at for y in at]),
    }


def test_k_100_with_100_obstacles_neither_overflows_nor_loses_the_direction():
    world = a_hundred_obstacles()
    field = potential({"potential": "navigation_function", "navigation_function.k": 100}, world)
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        phi, g_x, g_y, _ = field(*np.array(anywhere(field.world, 500, clearance=0.0)).T)
    assert (phi >= 0.0).all()
    assert (phi <= 1.0).all()
    assert np.isfinite(g_x + g_y).all()
    assert (np.hypot(g_x, g_y) > 1e-6).all()


def test_k_100_with_100_obstacles_has_the_direction_of_the_textbook_formula():
    """The direction of grad psi is that of grad chi, chi = log gamma - (1/k) sum log beta_i."""
    k = 100
    field = potential(
        {"potential": "navigation_function", "navigation_function.k": k}, a_hundred_obstacles()
    )
    centres = [(c.x, c.y) for c in field.world.obstacles.values()] + [(0.0, 0.0)]
    for x, y in anywhere(field.world, 50, clearance=0.01):
        p, r2 = np.array([x, y]), field.world.size**2
        away = p - np.array(centres)
        beta = (away**2).sum(axis=1) - r2  # that of the boundary comes out negative, twice
        chi = 2.0 * p / (p @ p) - (2.0 * away / beta[:, None]).sum(axis=0) / k
        assert np.allclose(field(x, y).polar[1:], chi / np.linalg.norm(chi), atol=1e-9)


@by_name(ALL)
def test_a_batch_is_what_each_of_its_points_is_alone(gains):
    field = potential(gains)
    points = [*anywhere(field.world, 40, clearance=-0.1), field.world.goal]
    batch = np.array([field(*np.array(points).T).phi, *field(*np.array(points).T).gradient])
    alone = np.array([[field(x, y).phi, *field(x, y).gradient] for x, y in points]).T
    assert np.allclose(batch, alone, rtol=1e-12, atol=0.0)


@by_name(ALL)
def test_points_may_come_in_any_shape(gains):
    field = potential(gains)
    x, y = np.array(anywhere(field.world, 12, clearance=0.01)).T
    flat, grid = field(x, y), field(x.reshape(3, 4), y.reshape(3, 4))
    for one, other in zip([flat.phi, *flat.polar], [grid.phi, *grid.polar], strict=True):
        assert other.shape == (3, 4)
        assert np.allclose(one, np.ravel(other), rtol=1e-12)


@by_name(ALL)
@given(x=st.floats(-1e6, 1e6), y=st.floats(-1e6, 1e6))
def test_wherever_the_robot_is_the_direction_is_a_unit_vector_or_zero(gains, x, y):
    mu, cos, sin = potential(gains)(x, y).polar
    assert mu >= 0.0
    assert math.hypot(cos, sin) == pytest.approx(1.0, abs=1e-9) or (cos, sin) == (0.0, 0.0)


@by_name(ALL)
def test_the_field_turns_with_the_world(gains):
    angle = 1.234
    cos, sin = math.cos(angle), math.sin(angle)
    turned = dict(SMALL)
    turned["goal"] = _turned(*SMALL["goal"], cos, sin)
    turned["initial_pose"] = [*turned["goal"], 0.0]
    for name in ("boundary", *(f"obstacles.{n}" for n in SMALL["obstacles.names"])):
        x, y = _turned(SMALL[f"{name}.x"], SMALL[f"{name}.y"], cos, sin)
        turned |= {f"{name}.x": x, f"{name}.y": y}
    before, after = potential(gains), potential(gains, turned)
    for x, y in anywhere(before.world, 20, clearance=0.01):
        mu, *direction = before(x, y).polar
        mu_turned, *direction_turned = after(*_turned(x, y, cos, sin)).polar
        assert mu_turned == pytest.approx(mu, rel=1e-9)
        assert np.allclose(direction_turned, _turned(*direction, cos, sin), atol=1e-9)


def _turned(x, y, cos, sin):
    return [cos * x - sin * y, sin * x + cos * y]


@pytest.mark.parametrize("name", [*PSI, *U])
def test_points_broadcast(name):
    potential = controller({**NINE, **(PSI | U)[name]}).potential
    x, y = np.linspace(-3.0, 3.0, 3), np.linspace(-2.0, 2.0, 4)
    expected = potential(*np.meshgrid(x, y, indexing="ij")).gradient
    for found, each in zip(potential(x[:, None], y[None]).gradient, expected, strict=True):
        np.testing.assert_array_equal(found, each)
    for found, each in zip(potential(x, 2.0).gradient, expected, strict=True):
        np.testing.assert_allclose(found, each[:, -1], rtol=1e-12)
    assert potential.world.clearance(x[:, None], y[None]).shape == (3, 4)

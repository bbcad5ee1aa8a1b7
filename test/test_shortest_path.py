# SPDX-License-Identifier: Apache-2.0
"""The shortest path against geometry by hand, slow and obvious searches, and driven paths."""

import heapq
from dataclasses import replace

import numpy as np
import pytest
from arenas import OBSTACLES_OF_NINE
from hypothesis import given, settings
from hypothesis import strategies as st

from tbot_gradnav.controller import Controller
from tbot_gradnav.settings import Settings
from tbot_gradnav.shortest_path import shortest_paths
from tbot_gradnav.simulate import random_starts, simulate
from tbot_gradnav.world import Boundary, Circle, World

ROUNDING = 1e-6  # [m]
slowly = settings(deadline=None, derandomize=True, max_examples=60)


def world_of(circles, boundary=0.0, robot_radius=0.0, goal=(0.0, 0.0)):
    obstacles = {f"o{i}": Circle(*circle) for i, circle in enumerate(circles)}
    return World(goal, obstacles, Boundary(0.0, 0.0, boundary), robot_radius)


ARENA = world_of(OBSTACLES_OF_NINE, boundary=4.5, robot_radius=0.105)


@st.composite
def worlds(draw):
    """Give worlds whose obstacles are apart, but mostly not when inflated, nor from the boundary.

    All is on a lattice, so that there is much that just touches, is in line or parallel.
    """
    circles = []
    for (x, y), r in draw(st.lists(st.tuples(PLACES, lattice(0.05, 0.5)), min_size=2, max_size=9)):
        inside = np.hypot(x, y) < 2.4 + r - ROUNDING
        if inside and all(np.hypot(x - a, y - b) > r + c + ROUNDING for a, b, c in circles):
            circles.append((x, y, r))
    boundary, robot_radius = draw(st.sampled_from([0.0, 2.4])), draw(lattice(0.0, 0.2))
    return world_of(circles, boundary, robot_radius, draw(PLACES))


def lattice(low, high):
    return st.integers(round(low / 0.05), round(high / 0.05)).map(lambda i: 0.05 * i)


PLACES = st.tuples(lattice(-2.0, 2.0), lattice(-2.0, 2.0))
STARTS = st.lists(PLACES, min_size=9, max_size=9)


# By hand


def past(r, a, b, angle):
    """Tangent, arc, tangent: past a disc of radius r from distance a of its centre to distance b.

    The ends are `angle` [rad] apart seen from the centre.
    """
    arc = r * (angle - np.arccos(r / a) - np.arccos(r / b))
    return np.sqrt(a * a - r * r) + arc + np.sqrt(b * b - r * r)


def test_straight_home_in_an_empty_world():
    x, y = np.random.default_rng(1).normal(size=(2, 3, 5))
    for boundary in (0.0, 9.0):
        world = world_of([], boundary, 0.1, (1.0, -2.0))
        assert shortest_paths(world, x, y) == pytest.approx(np.hypot(x - 1.0, y + 2.0))


def test_shape_follows_the_starts():
    assert shortest_paths(ARENA, 1.0, 1.0).shape == ()
    assert shortest_paths(ARENA, np.zeros((3, 1)), np.zeros((1, 2))).shape == (3, 2)
    assert shortest_paths(ARENA, np.empty((0, 2)), 0.0).shape == (0, 2)


@pytest.mark.parametrize("angle", [0.7 * np.pi, 0.9 * np.pi, np.pi, 1.2 * np.pi, 1.3 * np.pi])
def test_past_one_disc(angle):
    world = world_of([(0.0, 0.0, 0.4)], robot_radius=0.1, goal=(1.2, 0.0))
    length = shortest_paths(world, 0.9 * np.cos(angle), 0.9 * np.sin(angle))
    assert length == pytest.approx(past(0.5, 0.9, 1.2, min(angle, 2.0 * np.pi - angle)))


@pytest.mark.parametrize("x", [0.0, 0.1, 1.7])
def test_may_touch_disc_and_boundary(x):
    world = world_of([(x, 0.0, 0.5)], goal=(x + 0.5, 0.0))
    angle = np.linspace(-3.1, 3.1, 63)
    length = shortest_paths(world, x + 0.5 * np.cos(angle), 0.5 * np.sin(angle))
    assert length == pytest.approx(0.5 * np.abs(angle), abs=1e-7)
    round_world = World(boundary=Boundary(radius=1.0), robot_radius=0.1)
    assert shortest_paths(round_world, 0.9 * np.cos(angle), 0.9 * np.sin(angle)) == pytest.approx(
        0.9
    )


def test_along_two_discs_in_line():
    world = world_of([(-1.0, 0.0, 0.5), (1.0, 0.0, 0.5)], goal=(3.0, 0.0))
    top_of_the_disc = past(0.5, 2.0, 0.5, np.pi / 2.0)
    assert shortest_paths(world, -3.0, 0.0) == pytest.approx(2.0 * top_of_the_disc + 2.0)


@pytest.mark.parametrize("n", [2, 3, 6])
def test_slalom(n):
    c, h = 0.8, 0.3  # point symmetry: each tangent crosses the axis half-way between two discs
    gates = [(2.0 * c * i, h * (-1.0) ** i, 0.5) for i in range(n)]
    length = shortest_paths(world_of(gates, goal=(2.0 * c * n - c, 0.0)), -c, 0.0)
    away = np.hypot(c, h)
    assert length == pytest.approx(n * past(0.5, away, away, 2.0 * np.arctan2(c, h)))


def test_gap_narrower_than_the_robot_is_shut():
    circles, goal = [(0.0, 0.6, 0.5), (0.0, -0.6, 0.5)], (2.0, 0.0)
    through = shortest_paths(world_of(circles, robot_radius=0.099, goal=goal), -2.0, 0.0)
    around = shortest_paths(world_of(circles, robot_radius=0.101, goal=goal), -2.0, 0.0)
    quarter = past(0.601, np.hypot(2.0, 0.6), 0.601, np.arctan2(2.0, -0.6))
    assert through == pytest.approx(4.0)
    assert around == pytest.approx(2.0 * quarter, abs=1e-9)


def test_not_between_disc_and_boundary_where_the_robot_does_not_fit():
    start, goal, disc = (-1.4, 0.8), (1.4, 0.8), [(0.0, 0.7, 0.9)]  # inflated, up to y = 1.7
    away, angle = np.hypot(1.4, 0.1), 2.0 * np.arctan2(1.4, 0.1)
    over, under = past(1.0, away, away, angle), past(1.0, away, away, 2.0 * np.pi - angle)
    assert shortest_paths(world_of(disc, 1.81, 0.1, goal), *start) == pytest.approx(over)
    assert shortest_paths(world_of(disc, 1.79, 0.1, goal), *start) == pytest.approx(under)


def test_no_way_into_a_ring_nor_from_occupied_places():
    ring = [(np.cos(a), np.sin(a), 0.3) for a in np.arange(8) * np.pi / 4.0]
    shut = world_of(ring, boundary=3.0, robot_radius=0.1)
    starts = np.array([[0.3, 2.0, 1.0, 3.5, 2.95, np.nan], [0.3, 0.0, 0.1, 0.0, 0.0, 0.0]])
    free = [True, False, False, False, False, False]
    assert np.isfinite(shortest_paths(shut, *starts)).tolist() == free
    assert np.isfinite(shortest_paths(replace(shut, robot_radius=0.05), *starts[:, :2])).all()
    assert np.isinf(shortest_paths(replace(shut, goal=(1.0, 0.0)), *starts)).all()


# Against searches


def clear(world, p, q):
    """Whether the segments from p to q, complex positions, are clear of all there is."""
    free = np.ones(np.broadcast(p, q).shape, dtype=bool)
    for circle in world.obstacles.values():
        c, along = circle.x + 1j * circle.y, q - p
        t = ((c - p) * np.conj(along)).real / np.maximum(np.abs(along) ** 2, 1e-300)
        nearest = p + np.clip(t, 0.0, 1.0) * along
        free &= np.abs(nearest - c) >= circle.radius + world.robot_radius
    if world.bounded:
        free &= np.maximum(np.abs(p), np.abs(q)) <= world.boundary.radius - world.robot_radius
    return free


def dijkstra(neighbours, start, n):
    """Return the length from node `start` to each of n; neighbours(i) gives nodes and lengths."""
    length = np.full(n, np.inf)
    queue = [(0.0, start)]
    while queue:
        so_far, i = heapq.heappop(queue)
        if so_far < length[i]:
            length[i] = so_far
            for j, more in zip(*neighbours(i), strict=True):
                if so_far + more < length[j]:
                    heapq.heappush(queue, (so_far + more, j))
    return length


CORNERS = 32
WIDER = 0.8 * (1.0 / np.cos(np.pi / CORNERS) - 1.0) + 2e-7  # [m] at corners of inflated obstacles


def among_polygons(world, starts):
    """Return the shortest ways from corner to corner of polygons drawn around the obstacles."""
    turn = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS) / np.cos(np.pi / CORNERS)
    corners = [
        c.x + 1j * c.y + (c.radius + world.robot_radius + 1e-7) * turn
        for c in world.obstacles.values()
    ]
    nodes = np.concatenate([[complex(*world.goal)], starts, *corners])
    links = clear(world, nodes[:, None], nodes)

    def neighbours(i):
        near = np.flatnonzero(links[i])
        return near.tolist(), np.abs(nodes[near] - nodes[i]).tolist()

    return dijkstra(neighbours, 0, nodes.size)[1 : 1 + len(starts)]


@slowly
@given(worlds(), STARTS)
def test_between_ways_among_polygons_around_the_obstacles_and_ways_around_those(world, starts):
    x, y = np.transpose(starts)
    among = among_polygons(world, x + 1j * y)
    assert np.all(shortest_paths(world, x, y) <= among + ROUNDING)
    wide = replace(world, robot_radius=world.robot_radius + WIDER)
    assert np.all(among <= shortest_paths(wide, x, y) + ROUNDING)


def test_against_dijkstra_on_a_grid():
    h, n = 0.1, 91
    moves = [1, 1 + 1j, 2 + 1j, 3 + 1j, 3 + 2j, 1 + 2j, 1 + 3j, 2 + 3j]
    moves = np.array([move * quarter for move in moves for quarter in (1, 1j, -1, -1j)])
    gap = np.diff(np.sort(np.angle(moves))).max()
    metrication = 1.0 / np.cos(0.5 * gap)  # at worst: half-way between two directions
    row, col = np.divmod(np.arange(n * n), n)
    nodes = h * (col - n // 2) + 1j * h * (row - n // 2)
    links = clear(ARENA, nodes[:, None], nodes[:, None] + h * moves)
    steps = (moves.real + n * moves.imag).astype(int)

    def neighbours(i):
        return (i + steps[links[i]]).tolist(), (h * np.abs(moves[links[i]])).tolist()

    grid = dijkstra(neighbours, nodes.size // 2, nodes.size)
    length = shortest_paths(ARENA, nodes.real, nodes.imag)
    assert np.all(length <= grid + ROUNDING)
    assert np.all(grid <= metrication * length + 2.0 * h)  # corners are on nodes, too


# Whatever the world


@slowly
@given(worlds(), STARTS)
def test_never_shorter_than_straight_and_never_gaining_on_the_way(world, starts):
    x, y = np.transpose(starts)
    length = shortest_paths(world, x, y)
    assert np.all(length >= np.hypot(x - world.goal[0], y - world.goal[1]) - ROUNDING)
    p, q = (x + 1j * y)[:, None], x + 1j * y
    a, b = np.broadcast_arrays(length[:, None], length)
    linked = clear(world, p, q)
    assert np.all(a[linked] <= (b + np.abs(p - q))[linked] + ROUNDING)


@slowly
@given(worlds(), STARTS, st.floats(-np.pi, np.pi), st.booleans())
def test_turned_mirrored_and_moved_worlds_are_the_same(world, starts, angle, mirror):
    def moved(x, y):
        z = np.exp(1j * angle) * (x + 1j * (-y if mirror else y)) + 0.7 - 3.1j
        return z.real, z.imag

    obstacles = {name: Circle(*moved(c.x, c.y), c.radius) for name, c in world.obstacles.items()}
    edge = Boundary(*moved(0.0, 0.0), world.boundary.radius)
    there = World(moved(*world.goal), obstacles, edge, world.robot_radius)
    x, y = np.transpose(starts)
    length, length_there = shortest_paths(world, x, y), shortest_paths(there, *moved(x, y))
    sure = ~touching(world, x, y)
    assert length_there[sure] == pytest.approx(length[sure], abs=ROUNDING)


def touching(world, x, y):
    """Whether free or not, open or shut, is for rounding to say."""
    wide = replace(world, robot_radius=world.robot_radius + 1e-6)
    length, more = shortest_paths(world, x, y), shortest_paths(wide, x, y)
    return ~np.isclose(length, more, rtol=0.0, atol=1e-4)


def test_no_robot_drives_a_shorter_way():
    gains = {"attractive_repulsive": {"k_repulsive": 0.01, "influence_distance": 0.3}}
    nine = Settings(
        goal=ARENA.goal,
        obstacles=ARENA.obstacles,
        boundary=ARENA.boundary,
        robot_radius=ARENA.robot_radius,
        potential_gains=gains,
    )
    starts = random_starts(ARENA, 200, seed=5)
    runs = simulate(Controller.of(nine), starts)
    length = shortest_paths(ARENA, starts.x, starts.y)
    assert runs.arrived.all()
    assert np.all(length <= runs.path_length + runs.final_distance + ROUNDING)
    assert np.all(length <= runs.path_length + nine.xy_goal_tolerance + ROUNDING)
    assert np.median(runs.path_length / length) < 1.2

# SPDX-License-Identifier: Apache-2.0
"""The potential map: where it leads, how far round, and that it never leads astray."""

import json
import math

import numpy as np
import pytest

pytest.importorskip("skfmm", reason="needs scikit-fmm: pip install tbot_gradnav[map]")

import plans
import yardstick
from arenas import FREE
from conftest import CONFIG
from hypothesis import given, settings
from hypothesis import strategies as st

from tbot_gradnav import marching_process
from tbot_gradnav.cli import main
from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import random_starts, simulate
from tbot_gradnav.unicycle import Pose

STRICT = 20.0  # of the yardstick: by how much a metre at no clearance costs more than in the open


def price(wanted):
    """Return what a metre costs a path that keeps its clearance where it can, nearly at any cost.

    It has nothing of the potential's own idea of speed but the clearance from which on all is open.
    """
    return lambda c: np.where(c > 0.0, 1.0 + STRICT * np.maximum(0.0, 1.0 - c / wanted), np.inf)


@pytest.mark.parametrize("plan", plans.PLANS)
def test_all_arrive_none_collides_and_hardly_a_way_is_longer_than_it_must_be(plan):
    controller = Controller.of(plans.PLANS[plan]())
    world, potential = controller.settings.world, controller.potential
    start = random_starts(world, 200, 0, potential)
    runs = simulate(controller, start)
    assert runs.arrived.all()
    assert not runs.collided.any()
    shortest = yardstick.lengths(world, price(potential.clearance), start.x, start.y)
    far = shortest > 1.0  # nearer, the turn at the start is all
    ratio = runs.path_length[far] / (shortest[far] - controller.settings.xy_goal_tolerance)
    assert np.median(ratio) <= 1.05
    assert np.quantile(ratio, 0.95) <= 1.15
    assert np.median(ratio) > 0.98  # or the yardstick is no yardstick


def test_the_yardstick_knows_the_way_round_a_corner():
    world = plans.settings(plans.trap(), (5.0, 2.0), (2.0, 2.0)).world

    def flat(clearance):
        return np.where(clearance > 0.0, 1.0, np.inf)

    # straight along the wall; and out of the U, round the corner of a wall 0.2 m thick
    r, ends = 0.105, [(1.0, 0.6), (3.4, 2.0)]
    out = math.hypot(3.4 - 1.5 + r, 1.0 - r - 2.0)
    straight, round_about = yardstick.lengths(world, flat, *np.array(ends).T)
    assert straight == pytest.approx(math.hypot(5.0 - 1.0, 2.0 - 0.6), rel=0.08)
    assert straight >= math.hypot(4.0, 1.4)
    assert round_about > out + 3.0


def descend(potential, x, y, steps, size):
    """Return where points get that go down the gradient in steps of some size [m]."""
    for _ in range(steps):
        _, u_x, u_y = potential(x, y).polar
        x, y = x - size * u_x, y - size * u_y
    return x, y


def cluttered(seed):
    """Return settings in a random plan, half a maze and half what stands around in it."""
    rng = np.random.default_rng(seed)
    occupancy, rooms = plans.maze(seed, size=4, way=int(rng.integers(9, 16)))
    walls = ~occupancy.free
    for _ in range(rng.integers(0, 12)):
        i, j = rng.integers(0, walls.shape[0], 2)
        walls[i : i + rng.integers(1, 5), j : j + rng.integers(1, 5)] = True
    goal = rooms[rng.integers(len(rooms))]
    i, j = np.rint(goal / plans.RESOLUTION).astype(int)[::-1]
    walls[i - 4 : i + 5, j - 4 : j + 5] = False
    goal = goal + rng.uniform(-0.03, 0.03, 2)
    return plans.settings(plans.grid(walls), goal.tolist(), goal.tolist())


@given(st.integers(0, 10**6))
@settings(max_examples=10)
def test_from_every_free_cell_that_has_a_way_the_field_leads_to_the_goal(seed):
    potential = cluttered(seed).chosen_potential
    world = potential.world
    free = potential._marching.task.free
    x, y = (values[free] for values in world.walls.lattice.nodes)
    for _ in range(20):  # 1.2 m at a time; the mazes are of 16 rooms a metre apart
        x, y = descend(potential, x, y, 120, 0.01)
        under_way = np.hypot(x - world.goal[0], y - world.goal[1]) > 0.05
        x, y = x[under_way], y[under_way]
    assert x.size == 0
    assert potential.pits[0].size == 0


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_no_place_where_the_robot_touches_is_as_low_as_one_with_a_way(seed):
    potential = cluttered(seed).chosen_potential
    space = potential._space
    rng = np.random.default_rng(seed)
    (left, low), (right, high) = (f(space.lattice.nodes, axis=(1, 2)) for f in (np.min, np.max))
    x, y = rng.uniform(left - 0.5, right + 0.5, 5000), rng.uniform(low - 0.5, high + 0.5, 5000)
    touching = np.less_equal(potential.world.clearance(x, y), 0.0)
    free = potential._marching.phi[potential._marching.task.free]
    assert potential(x[touching], y[touching]).phi.min() > free.max()


def test_the_gradient_is_that_of_phi():
    potential = plans.PLANS["office"]().chosen_potential
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-2.0, 14.0, 2000), rng.uniform(-2.0, 10.0, 2000)
    e = 1e-7
    by_x = (potential(x + e, y).phi - potential(x - e, y).phi) / (2.0 * e)
    by_y = (potential(x, y + e).phi - potential(x, y - e).phi) / (2.0 * e)
    g_x, g_y = potential(x, y).gradient
    error = np.hypot(by_x - g_x, by_y - g_y) / np.maximum(np.hypot(g_x, g_y), 0.1)
    assert np.quantile(error, 0.99) < 1e-5  # but for those whose differences cross a line


def test_one_robot_and_thousands_have_the_same_field():
    potential = plans.PLANS["office"]().chosen_potential
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.0, 13.0, 100), rng.uniform(-1.0, 9.0, 100)
    each = [potential(*point)[:3] for point in zip(x.tolist(), y.tolist(), strict=True)]
    np.testing.assert_allclose(np.array(each).T, potential(x, y)[:3], rtol=1e-12)


@pytest.mark.parametrize("turn", [0.3, 2.5])
def test_a_turned_map_turns_the_drive(turn):
    def driven(yaw):
        occupancy, pose = plans.trap(), Pose.at(0.7, -0.4, yaw)
        turned = type(occupancy)(occupancy.cells, occupancy.resolution, 0.7, -0.4, yaw)
        start = pose.compose(Pose.at(2.0, 1.5, 0.4))
        goal = pose.compose(Pose.at(5.0, 2.0, 0.0))
        drive = plans.settings(turned, (float(goal.x), float(goal.y)), (start.x, start.y))
        runs = simulate(Controller.of(drive), Pose(*(np.array([c]) for c in start)))
        assert runs.arrived.all()
        return runs.path_length[0], runs.time[0]

    assert driven(turn) == pytest.approx(driven(0.0), rel=0.01)


@pytest.mark.parametrize("depth", [0.005, 0.03, 0.09])
def test_a_robot_pushed_into_a_wall_is_led_out_and_on_to_the_goal(depth):
    drive = plans.PLANS["office"]()
    potential, world = drive.chosen_potential, drive.world
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0.0, 12.0, 20000), rng.uniform(0.0, 8.0, 20000)
    c = np.asarray(world.clearance(x, y))
    pushed = (c < 0.0) & (c > -depth)
    x, y = x[pushed][:300], y[pushed][:300]
    out_x, out_y = descend(potential, x, y, 60, 0.005)
    assert np.all(np.asarray(world.clearance(out_x, out_y)) > 0.0)
    end_x, end_y = descend(potential, out_x, out_y, 2500, 0.01)
    assert np.max(np.hypot(end_x - world.goal[0], end_y - world.goal[1])) <= 0.05


def test_a_robot_beyond_the_map_is_led_back():
    potential = plans.PLANS["trap"]().chosen_potential
    x, y = descend(potential, np.array([-1.0, 7.5, 3.0]), np.array([2.0, -1.5, 5.0]), 400, 0.01)
    assert np.all(np.asarray(potential.world.clearance(x, y)) > 0.0)


def test_arrives_in_the_open_like_a_robot_without_a_map():
    walls = np.zeros((100, 100), dtype=bool)
    drive = plans.settings(plans.grid(walls), (3.713, 3.689), (1.0, 1.0), **FREE)
    potential = drive.chosen_potential
    rng = np.random.default_rng(0)
    x, y = rng.uniform(1.0, 4.0, (2, 500))
    dx, dy = x - 3.713, y - 3.689
    rho = np.hypot(dx, dy)
    g_x, g_y = potential(x, y).gradient
    off = np.abs(g_x * dy - g_y * dx) / (np.hypot(g_x, g_y) * rho)
    assert np.all(off[rho <= 0.1] < 1e-9)  # straight home
    assert np.median(off) < 0.05
    assert np.all(off < 0.3)  # in the squares of the lattice next to the goal
    np.testing.assert_allclose(potential(x, y).phi, rho, atol=1.2 * plans.RESOLUTION)


def test_obstacles_of_the_file_count_as_walls():
    free = plans.PLANS["trap"]()
    box = {"obstacles.names": ["b"], "obstacles.b.x": 5.0, "obstacles.b.y": 3.2}
    drive = plans.settings(
        plans.trap(), (5.4, 3.6), (5.4, 0.5), **box, **{"obstacles.b.radius": 0.4}
    )
    controller = Controller.of(drive)
    start = random_starts(drive.world, 100, 0, controller.potential)
    runs = simulate(controller, start)
    assert runs.arrived.all()
    assert free.world.clearance(5.0, 3.2) > 0.3
    assert drive.world.clearance(5.0, 3.2) < 0.0


def closed_room():
    """Return a map of two rooms without a door between them."""
    walls = np.zeros((60, 120), dtype=bool)
    walls[:, 60:63] = True
    return plans.grid(walls)


def test_a_goal_that_no_way_leads_to_is_refused_with_a_word():
    with pytest.raises(GradnavError, match=r"^goal: .* no way to it from \(1, 1\)"):
        plans.settings(closed_room(), (5.0, 1.0), (1.0, 1.0))
    plans.settings(closed_room(), (2.0, 1.0), (1.0, 1.0))
    with pytest.raises(GradnavError, match=r"^waypoints: .* no way"):
        plans.settings(closed_room(), (2.0, 1.0), (1.0, 1.0), waypoints=[5.0, 1.0])


def test_a_door_too_narrow_for_the_robot_is_no_way():
    def room(door):
        occupancy = closed_room()
        walls = ~occupancy.free
        walls[20 : 20 + door, 60:63] = False
        return plans.grid(walls)

    plans.settings(room(7), (5.0, 1.0), (1.0, 1.0))  # 0.35 m
    with pytest.raises(GradnavError, match="no way"):
        plans.settings(room(4), (5.0, 1.0), (1.0, 1.0))  # 0.2 m, the robot has 0.21


def test_a_goal_or_start_in_a_wall_is_refused_with_a_word():
    for goal, start in (((3.05, 1.0), (1.0, 1.0)), ((1.0, 1.0), (3.05, 1.0))):
        with pytest.raises(
            GradnavError, match="inside a wall of the map, or what is unknown or beyond it"
        ):
            plans.settings(closed_room(), goal, start)


def test_a_map_without_a_free_cell_and_a_missing_map_are_refused_in_one_line():
    with pytest.raises(GradnavError, match="no cell of the map is free"):
        plans.settings(plans.grid(np.ones((5, 5), dtype=bool)), (0.1, 0.1), (0.1, 0.1))
    unmapped = Settings.of({"potential": "map", "goal": [1.0, 0.0]})
    assert not unmapped.chosen_potential.ready
    with pytest.raises(GradnavError, match="no map"):
        unmapped.chosen_potential(0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("map: {file: none.yaml}", "map.file: none.yaml: No such file or directory"),
        ("", "map.file is missing; a map by a topic is for the navigator"),
        (f"map: {{file: {CONFIG}/maps/office.yaml, clearance: 0}}", "map.clearance: 0"),
        (f"map: {{file: {CONFIG}/maps/office.yaml}}\ninitial_pose: [4.0, 4.2, 0]", "no way to it"),
    ],
)
def test_commands_say_in_one_line_what_is_wrong_with_a_map(parameter_file, capsys, text, words):
    lines = "potential: map\ngoal: [10.0, 6.0]\nrobot_radius: 0.4\n"
    file = parameter_file(lines + text)
    assert main(["simulate", str(file)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_check_says_how_much_of_a_map_has_a_way_to_the_goal(parameter_file, capsys, tmp_path):
    walls = ~closed_room().free
    (tmp_path / "rooms.pgm").write_bytes(
        b"P5 120 60 255\n" + np.where(walls, 0, 254).astype(np.uint8).tobytes()
    )
    (tmp_path / "rooms.yaml").write_text("image: rooms.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    text = "potential: map\nmap: {file: rooms.yaml}\ngoal: [2.0, 1.0]\ninitial_pose: [1, 1, 0]"
    out = tmp_path / "check.json"
    picture = tmp_path / "check.png"
    assert (
        main(["check", str(parameter_file(text)), "--json", str(out), "--plot", str(picture)]) == 0
    )
    said = capsys.readouterr().out
    assert "sound" in said
    # 56 rows of 56 and of 53 columns are 0.11 m from the walls of either room
    assert "3136 of 6104 free nodes of the map's lattice have a way to the goal" in said
    assert json.loads(out.read_text())["spurious_minima"] == []
    assert picture.exists()


def test_a_field_made_in_the_background_is_the_same_even_if_its_process_dies():
    drive = plans.PLANS["trap"]()
    for i in range(3):
        goal = (5.0 + 0.1 * i, 2.0)
        there = plans.settings(plans.trap(), goal, (2.0, 2.0)).chosen_potential
        here = plans.settings(plans.trap(), goal, (2.0, 2.0)).chosen_potential
        there.prepare()
        waited = there(3.0, 1.0)  # a call waits
        assert there.ready
        assert waited == here(3.0, 1.0)
        marching_process._worker._process.kill()
        marching_process._worker._process.wait()
    assert drive.chosen_potential.ready

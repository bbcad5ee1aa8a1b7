# SPDX-License-Identifier: Apache-2.0
"""gradnav check: the critical points it finds, and the verdicts it gives."""

import json
import os
import re

import numpy as np
import pytest
from conftest import CONFIG

from tbot_gradnav.certify import landscape, smallest_k
from tbot_gradnav.cli import main
from tbot_gradnav.commands.check import judge
from tbot_gradnav.controller import Controller
from tbot_gradnav.options import Configuration
from tbot_gradnav.parameter_file import read
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import random_starts, simulate
from tbot_gradnav.unicycle import Pose

NINE = read(CONFIG / "nine_navigation_function.yaml")
WORLDS = int(os.environ.get("GRADNAV_WORLDS", "30"))  # random worlds; 200 in `make test-long`


def nine(k):
    return Settings.of(NINE | {"navigation_function.k": k})


def is_minimum(potential, point):
    """Whether the potential is higher all around, 1 cm away, as a user would look."""
    around = np.linspace(0.0, 2.0 * np.pi, 64)
    rim = potential(point.x + 0.01 * np.cos(around), point.y + 0.01 * np.sin(around)).phi
    return bool(np.all(rim > potential(point.x, point.y).phi))


@pytest.mark.parametrize(("k", "minima"), [(2, 5), (3, 5), (4, 5), (5, 5), (6, 5), (7, 2), (8, 1)])
def test_finds_every_critical_point_of_the_nine_obstacle_arena(k, minima):
    potential = nine(k).chosen_potential
    found = landscape(potential)
    assert found.agrees  # minima + maxima - saddles = 1 - 9, by theory
    assert len(found.minima) == minima
    assert found.goal_is_minimum
    for point in found.points:
        assert potential(point.x, point.y).polar[0] < 1e-6
        assert is_minimum(potential, point) == (point.kind == "minimum")


def test_each_spurious_minimum_catches_a_robot_beside_it():
    settings = nine(5)
    for point in landscape(settings.chosen_potential).spurious:
        start = Pose.at(np.array([point.x + 0.1]), np.array([point.y]), np.zeros(1))
        runs = simulate(Controller.of(settings), start, time_limit=60.0, record=True)
        assert not runs.arrived[0]
        assert np.hypot(*(runs.path[:2, -1, 0] - (point.x, point.y))) < 0.1


def test_the_smallest_k_is_eight_and_is_used_for_zero():
    assert smallest_k(nine(2).world) == 8
    assert nine(0).chosen_potential == nine(8).chosen_potential


def ring(open_towards):
    """A C of obstacles about (2, 0), wide open towards one side, the goal at the origin."""
    angles = open_towards + np.linspace(0.9, 2.0 * np.pi - 0.9, 9)
    return {
        f"obstacles.o{i}.{key}": value
        for i, angle in enumerate(angles)
        for key, value in (
            ("x", 2.0 + 0.9 * float(np.cos(angle))),
            ("y", 0.9 * float(np.sin(angle))),
            ("radius", 0.2),
        )
    } | {"obstacles.names": [f"o{i}" for i in range(9)]}


def test_a_minimum_behind_a_ring_is_found_to_a_centimetre():
    values = {"goal": [0.0, 0.0], "initial_pose": [4.0, 0.0, 3.0], "robot_radius": 0.1}
    settings = Settings.of(values | ring(open_towards=0.0))
    verdict = judge(settings)
    assert not verdict.sound
    inside = [p for p in verdict.found.spurious if np.hypot(p.x - 2.0, p.y) < 0.9]
    assert len(inside) == 1
    # the oracle: the lowest point of a fine grid inside the ring
    x, y = np.meshgrid(np.arange(1.2, 2.8, 0.002), np.arange(-0.8, 0.8, 0.002))
    phi = np.where(
        settings.world.clearance(x, y) > 0.0, settings.chosen_potential(x, y).phi, np.inf
    )
    phi[np.hypot(x - 2.0, y) > 0.7] = np.inf
    lowest = np.unravel_index(np.argmin(phi), phi.shape)
    assert np.hypot(inside[0].x - x[lowest], inside[0].y - y[lowest]) < 0.01


def sparse_world(seed):
    """Three to six obstacles in a disc of 4.5 m, at least 1 m from each other and the goal."""
    rng = np.random.default_rng(seed)
    circles = []
    while len(circles) < 3 + seed % 4:
        radius, r, phi = rng.uniform(0.15, 0.35), 3.5 * rng.random() ** 0.5, rng.uniform(0, 6.3)
        x, y = r * np.cos(phi), r * np.sin(phi)
        gaps = [np.hypot(x - a, y - b) - radius - c for a, b, c in [*circles, (0.0, 0.0, 0.0)]]
        if min(gaps) > 1.0:
            circles.append((float(x), float(y), float(radius)))
    names = [f"o{i}" for i in range(len(circles))]
    return {
        f"obstacles.{name}.{key}": value
        for name, circle in zip(names, circles, strict=True)
        for key, value in zip(("x", "y", "radius"), circle, strict=True)
    } | {"obstacles.names": names, "goal": [0.0, 0.0], "boundary.radius": 4.5}


@pytest.mark.parametrize("potential", ["navigation_function", "attractive_repulsive"])
def test_a_world_in_which_every_robot_arrives_is_sound(potential):
    all_home = 0
    for seed in range(WORLDS):
        values = sparse_world(seed) | {"potential": potential, "navigation_function.k": 12}
        settings = Settings.of(values)
        runs = simulate(Controller.of(settings), random_starts(settings.world, 100, seed))
        all_home += bool(runs.arrived.all())
        verdict = judge(settings)
        assert verdict.found.agrees
        if runs.arrived.all():
            assert verdict.sound, verdict.problems
    assert all_home > 0.9 * WORLDS


def test_overlap_after_inflation_and_the_wrong_law_are_problems():
    narrow = {
        "goal": [2.0, 0.0], "obstacles.names": ["a", "b"],
        "obstacles.a.x": 1.0, "obstacles.a.y": 0.25, "obstacles.a.radius": 0.2,
        "obstacles.b.x": 1.0, "obstacles.b.y": -0.25, "obstacles.b.radius": 0.2,
    }  # fmt: skip
    problems = judge(Settings.of(narrow | {"law": "heading"})).problems
    assert any("a and b are 0.100 m apart" in problem for problem in problems)
    assert any("law heading" in problem for problem in problems)


ROOM = {
    "goal": [1.0, 1.0],
    "boundary.shape": "polygon",
    "boundary.points": [-3.0, -3.0, 3.0, -3.0, 3.0, 3.0, -3.0, 3.0],
    "obstacles.names": ["thing"],
    "obstacles.thing.shape": "box",
}


def with_box(x, y, width, height):
    sides = {"x": x, "y": y, "width": width, "height": height}
    return Settings.of(ROOM | {f"obstacles.thing.{key}": value for key, value in sides.items()})


def test_furniture_at_a_wall_is_no_problem_unless_it_divides_the_room():
    sofa = judge(with_box(-2.5, -2.6, 1.0, 0.8))
    assert sofa.sound, sofa.problems
    assert sofa.notes == ["thing stands at the boundary"]
    assert simulate(
        Controller.of(sofa.settings), random_starts(sofa.settings.world, 50, 0)
    ).arrived.all()
    divided = judge(with_box(-1.0, 0.0, 0.2, 6.0)).problems
    (share,) = (
        re.match(r"from ([\d.]+)% of the free area there is no way", p) for p in divided[:1]
    )
    assert float(share[1]) == pytest.approx(100.0 * 1.69 / (1.69 + 3.69), abs=0.3)
    narrow = judge(with_box(-2.4, 0.0, 1.0, 1.0)).problems
    assert any("boundary and thing are 0.100 m apart" in problem for problem in narrow)


def test_an_unscaled_repulsion_at_the_goal_is_told_apart():
    near = {
        "goal": [2.0, 0.0], "obstacles.names": ["a"], "obstacles.a.x": 2.0, "obstacles.a.y": 0.5,
        "obstacles.a.radius": 0.2, "attractive_repulsive.goal_scaled": False,
    }  # fmt: skip
    verdict = judge(Settings.of(near))
    assert any("goal_scaled: true" in problem for problem in verdict.problems)
    assert judge(Settings.of(near | {"attractive_repulsive.goal_scaled": True})).sound


def test_answers_and_advice_on_the_command_line(tmp_path, capsys):
    out, picture = tmp_path / "verdict.json", tmp_path / "verdict.png"
    file = tmp_path / "k5.yaml"
    text = (CONFIG / "nine_navigation_function.yaml").read_text()
    file.write_text(text.replace("{k: 8.0}", "{k: 5}"))
    assert main(["check", str(file), "--json", str(out), "--plot", str(picture)]) == 1
    assert "navigation_function.k: 8 is the smallest" in capsys.readouterr().out
    verdict = json.loads(out.read_text())
    assert not verdict["sound"]
    assert len(verdict["problems"]) == 1
    assert len(verdict["spurious_minima"]) == 4
    assert verdict["smallest_k"] == 8
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["check", "nine_navigation_function.yaml"]) == 0
    assert "smallest integer k without a minimum but the goal: 8" in capsys.readouterr().out


@pytest.mark.parametrize("file", sorted(CONFIG.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_shipped_file_is_sound(file):
    settings = Configuration.of(read(file)).settings
    assert judge(settings).sound


def test_bad_input_is_one_line(parameter_file, capsys):
    for text in ("k_v: nan", "goal: [1, 1]\nnavigation_function: {k: -1}", "k_v: 1"):
        assert main(["check", str(parameter_file(text))]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1

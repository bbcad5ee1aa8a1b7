# SPDX-License-Identifier: Apache-2.0
"""Parameters that change while the robot drives."""

import random

import pytest
from arenas import NINE
from hypothesis import given
from hypothesis import strategies as st

from tbot_gradnav.changes import merged
from tbot_gradnav.errors import ParameterError
from tbot_gradnav.options import known_parameters
from tbot_gradnav.settings import Settings

pytest.importorskip("rclpy", reason="needs ROS 2")

from remote import Remote
from robot import Robot

BOX = {
    "obstacles.c.shape": "box",
    "obstacles.c.x": 2.0,
    "obstacles.c.y": -2.9,
    "obstacles.c.width": 0.3,
    "obstacles.c.height": 0.2,
    "obstacles.c.yaw": 0.5,
}
WITH_C = [*NINE["obstacles.names"], "c"]


@given(order=st.permutations(list(BOX)))
def test_an_obstacle_is_added_by_its_numbers_in_any_order_and_its_name_last(order):
    values = dict(NINE)
    for name in order:
        after = merged(values, {name: BOX[name]})
        assert Settings.of(after).obstacles == Settings.of(NINE).obstacles
        values[name] = BOX[name]
    settings = Settings.of(merged(values, {"obstacles.names": WITH_C}))
    assert settings.obstacles["c"].width == 0.3
    values["obstacles.names"] = WITH_C
    removed = merged(values, {"obstacles.names": NINE["obstacles.names"]})
    assert Settings.of(removed).obstacles == Settings.of(NINE).obstacles


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("obstacles.c.x", "far"),
        ("obstacles.c.x", float("nan")),
        ("obstacles.c.width", -1.0),
        ("obstacles.c.radios", 0.3),
        ("obstacles.c.shape", "star"),
        ("obstacles.c", 1.0),
        ("obstacles.c.x.y", 1.0),
    ],
)
def test_what_waits_for_its_obstacle_is_checked_by_itself(name, value):
    with pytest.raises(ParameterError) as caught:
        Settings.of(merged(NINE, {name: value}))
    assert caught.value.name == name


def test_an_obstacle_that_lacks_something_is_refused_when_it_is_named():
    values = NINE | BOX
    del values["obstacles.c.width"]
    with pytest.raises(ParameterError, match=r"obstacles\.c\.width is missing"):
        Settings.of(merged(values, {"obstacles.names": WITH_C}))


def test_a_shape_changes_in_one_request_and_forgets_what_it_had():
    change = {"obstacles.o0.shape": "box", "obstacles.o0.width": 0.3, "obstacles.o0.height": 0.2}
    assert Settings.of(merged(NINE, change)).obstacles["o0"].height == 0.2
    with pytest.raises(ParameterError, match=r"obstacles\.o0\.width"):
        Settings.of(merged(NINE, {"obstacles.o0.width": 0.3}))


def navigator(graph, file):
    return graph.start("navigator", "--ros-args", "--params-file", file)


def test_obstacles_come_move_and_go_while_the_robot_drives(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    text = "goal: [1.2, 0]\nobstacles: {names: [a], a: {x: 0, y: -1, radius: 0.2}}"
    drive = navigator(graph, parameter_file(text))
    graph.until(lambda: robot.moving, "motion")
    wall = {"obstacles.b.x": 0.6, "obstacles.b.y": 0, "obstacles.b.radius": 0.2}
    assert [remote.set_one(*item) for item in wall.items()] == [""] * 3
    assert "kept until it is in obstacles.names" in drive.words
    (about,) = remote.describe(["obstacles.b.radius"])
    assert "radius [m]" in about.description
    assert remote.set_one("obstacles.names", ["a", "b"]) == ""  # where the robot must pass
    assert "is missing" in remote.set_one("obstacles.names", ["a", "b", "c"])
    assert "overlaps" in remote.set_one("obstacles.a.x", 0.6) + remote.set_one(
        "obstacles.a.y", -0.1
    )
    assert "inside obstacles.b" in remote.set_together({"obstacles.b.x": 1.1})
    nearest = []
    graph.node.create_timer(0.02, lambda: nearest.append(robot.distance(0.6, 0.0)))
    remote.until("arrived", patience=30.0)
    assert min(nearest) > 0.2 + 0.105

    away = {"obstacles.b.x": 1.2, "obstacles.b.y": 0.5}
    assert remote.set_together(away) == ""
    assert remote.set_one("obstacles.names", ["a"]) == ""
    assert remote.set_together({"goal": [1.2, 0.35]}) == ""  # where b was
    remote.until("driving")
    assert remote.set_one("obstacles.names", ["a", "b"]) != ""  # the goal is inside
    remote.until("arrived", patience=30.0)
    assert robot.distance(1.2, 0.35) <= 0.05


def test_every_parameter_is_described_with_unit_and_range(graph, parameter_file):
    remote = Remote(graph)
    navigator(graph, parameter_file("obstacles: {names: [a], a: {x: 1, y: 1, radius: 0.2}}"))
    remote.until("no odometry")
    names = ["k_v", "goal", "waypoints", "obstacles.a.radius", "rate", "seed", "law", "publish_tf"]
    found = dict(zip(names, remote.describe(names), strict=True))
    assert all(about.description and about.additional_constraints for about in found.values())
    assert "[1/s]" in found["k_v"].description
    assert "at least 1e-06 [m]" in found["obstacles.a.radius"].additional_constraints
    assert found["rate"].floating_point_range[0].to_value == 1000.0
    assert found["seed"].integer_range[0].from_value == 0
    assert "position, radial" in found["law"].additional_constraints
    assert found["publish_tf"].read_only
    assert not found["k_v"].read_only


JUNK = [None, True, -1, 0, 7, 1e308, -0.5, "", "descent", "b", [1.0], [1, 2, 3], ["a"], [True]]
VALID = {
    "k_v": [0.3, 0.5, 1],
    "k_omega": [3.0, 6.0, 2],
    "law": ["descent", "heading", "position"],
    "speed_shaping": ["brake", "exponential"],
    "limits.v": [0.1, 0.2, 0.15],
    "limits.omega": [1.0, 2.6],
    "potential": ["quadratic", "attractive_repulsive", "navigation_function"],
    "obstacles.b.x": [-0.5, 0.3, 0.7],
    "obstacles.b.y": [-0.5, 0.4, 0.9],
    "obstacles.b.radius": [0.1, 0.3],
    "obstacles.names": [["a"], ["a", "b"]],
    "waypoints": [[0.2, 0.3], [0.0, -0.3, 0.4, -0.3]],
}
AFTERWARDS = {
    "k_v": 0.5,
    "k_omega": 3.0,
    "law": "descent",
    "speed_shaping": "brake",
    "limits.v": 0.2,
    "limits.omega": 2.6,
    "limits.wheel": 0.2,
    "limits.wheel_floor": 0.02,
    "limits.wheel_separation": 0.16,
    "potential": "attractive_repulsive",
    "obstacles.names": ["a"],
    "xy_goal_tolerance": 0.05,
    "goal": [1.0, 0.0],
}
WORLD = """
goal: [1, 0]
boundary: {radius: 5}
obstacles: {names: [a], a: {x: -1, y: 1, radius: 0.2}}
limits: {v: 0.2, omega: 2.6, wheel: 0.2}
"""
KEPT = ("limits.wheel", "limits.v", "limits.omega", "odometry_timeout", "use_sim_time")


def storm(seed, names):
    """Yield requests of one to three parameters, sensible or not, for ever."""
    rng = random.Random(seed)
    while True:
        changes = {}
        for _ in range(rng.choice([1, 1, 2, 3])):
            if rng.random() < 0.6:
                name = rng.choice(list(VALID))
                changes[name] = rng.choice(VALID[name])
            else:  # nonsense, but not a higher limit, which is valid
                name = rng.choice([*names, "k_w", "obstacles.z.x", "obstacles.q"])
                junk = [j for j in JUNK if name not in KEPT or not isinstance(j, (int, float))]
                changes[name] = rng.choice([j for j in junk if name not in KEPT or j is not None])
        yield changes


def test_a_storm_of_changes_moves_the_robot_never_beyond_its_limits(graph, parameter_file):
    robot, remote = Robot(graph, 0.0, 0.0, 0.0), Remote(graph)
    drive = navigator(graph, parameter_file(WORLD))
    graph.until(lambda: robot.moving, "motion")
    names = sorted(known_parameters({}))
    refusals = []
    for i, changes in zip(range(250), storm(6, names), strict=False):
        if i % 2:
            refusals.append(remote.set_together(changes))
        else:
            refusals += remote.set_each(**changes)
    assert 50 < sum(map(bool, refusals)) < len(refusals) - 50
    assert all(len(refusal.splitlines()) <= 1 for refusal in refusals)
    assert remote.set_together(AFTERWARDS) == ""
    remote.set_one("waypoints", [0.5, 0.3])
    remote.until("arrived", patience=40.0)
    assert robot.distance(1.0, 0.0) <= 0.05
    assert max(abs(v) for _, v, _ in robot.commands) <= 0.2 + 1e-12
    assert max(abs(omega) for *_, omega in robot.commands) <= 2.6 + 1e-12
    assert "Traceback" not in drive.words
    assert "Error:" not in drive.words

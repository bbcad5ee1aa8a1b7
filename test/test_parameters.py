# SPDX-License-Identifier: Apache-2.0
"""Parameters and parameter files: what is welcome, and that all else is refused in one line."""

import math
import os
from dataclasses import replace
from pathlib import Path

import pytest
from arenas import NINE
from hypothesis import example, given
from hypothesis import strategies as st

from tbot_gradnav import parameter_file
from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.options import Configuration, known_parameters
from tbot_gradnav.settings import Settings

CONFIG = Path(__file__).parents[1] / "config"
ONE = {
    "goal": [0.0, 0.0],
    "initial_pose": [-2.0, 0.0, 0.0],
    "obstacles.names": ["a"],
    "obstacles.a.x": 1.0,
    "obstacles.a.y": 0.0,
    "obstacles.a.radius": 0.3,
}
TWO = {
    **ONE,
    "obstacles.names": ["a", "b"],
    "obstacles.b.x": 1.5,
    "obstacles.b.y": 0.0,
    "obstacles.b.radius": 0.3,
}


def is_one_line(error):
    return len(str(error).splitlines()) == 1


def refusal_of(make, *arguments):
    """Return the error, which must be one line for the user, that a call ends with."""
    with pytest.raises(GradnavError) as caught:
        make(*arguments)
    assert is_one_line(caught.value)
    return str(caught.value)


# Values that are welcome


def test_no_parameters_at_all_are_enough():
    assert not Settings.of({}).has_goal


def test_integers_are_welcome_where_a_number_is_meant():
    settings = Settings.of({**NINE, "k_v": 1, "k_omega": 4, "boundary.radius": 5, "goal": [0, 0]})
    assert (settings.k_v, settings.k_omega, settings.boundary.radius) == (1.0, 4.0, 5.0)
    assert isinstance(settings.k_v, float)
    assert all(isinstance(value, float) for value in settings.goal)


def test_lists_may_mix_integers_and_floats():
    assert Settings.of({"initial_pose": [1, 2.5, -3]}).initial_pose == (1.0, 2.5, -3.0)


def test_every_parameter_reaches_its_place():
    settings = Settings.of({**ONE, "limits.v": 0.1, "attractive_repulsive.k_repulsive": 0.5})
    obstacle = settings.obstacles["a"]
    assert (obstacle.x, obstacle.y, obstacle.radius) == (1.0, 0.0, 0.3)
    assert settings.limits.v == 0.1
    assert settings.chosen_potential.k_repulsive == 0.5


def test_limits_may_be_infinite():
    assert Settings.of({"limits.v": math.inf}).limits.v == math.inf


def test_every_default_is_a_value_that_is_allowed():
    for name, (parameter, default) in known_parameters({}).items():
        assert parameter.check(name, default) == default


def test_every_default_may_be_given_explicitly():
    defaults = {name: default for name, (_, default) in known_parameters({}).items()}
    explicit, implicit = Configuration.of(defaults), Configuration.of({})
    assert explicit.settings.chosen_potential == implicit.settings.chosen_potential
    assert (explicit.navigator, explicit.fake_robot) == (implicit.navigator, implicit.fake_robot)
    gains = {"potential_gains": {}}
    assert replace(explicit.settings, **gains) == replace(implicit.settings, **gains)


def test_ros_parameters_that_every_node_has_are_let_through():
    Configuration.of({"use_sim_time": True, "qos_overrides./odom.subscription.depth": 5})


@pytest.mark.parametrize(
    ("law", "k_v", "k_omega"),
    [("descent", 0.5, 0.1), ("position", 0.1, 0.5), ("heading", -0.1, -0.5), ("radial", -1, -2)],
)
def test_gains_for_which_convergence_is_proved_are_allowed(law, k_v, k_omega):
    assert Settings.of({"law": law, "k_v": k_v, "k_omega": k_omega}).law == law


# Values that are refused: parameters, then what the message must say

REFUSED = {
    "misspelt": ({"k_omga": 1.0}, ["k_omga", "1.0", "did you mean k_omega?"]),
    "misspelt choice": ({"law": "descend"}, ["law", "'descend'", "did you mean descent?"]),
    "misspelt limit": ({"limits.omeg": 1.0}, ["limits.omeg", "did you mean limits.omega?"]),
    "misspelt obstacle key": (
        {**ONE, "obstacles.a.radios": 0.1},
        ["obstacles.a.radios", "0.1", "did you mean obstacles.a.radius?"],
    ),
    "degrees": ({"initial_pose": [0, 0, 90]}, ["initial_pose", "[0, 0, 90]", "at most 12.57"]),
    "degrees of a later start": (
        {"starts": [0, 0, 1, 0, 1, -45]},
        ["starts", "-45", "any yaw at most 12.57"],
    ),
    "misspelt beside what is missing": (
        {**ONE, "obstacles.names": ["a", "b"], "k_omga": 1.0},
        ["k_omga", "did you mean k_omega?"],
    ),
    "text for a number": ({"k_v": "fast"}, ["k_v", "'fast'", "number"]),
    "bool for a number": ({"k_v": True}, ["k_v", "True", "number"]),
    "list for a number": ({"k_v": [0.5]}, ["k_v", "[0.5]", "number"]),
    "nothing for a number": ({"k_v": None}, ["k_v", "None", "number"]),
    "number for a bool": ({"auto_reverse": 1}, ["auto_reverse", "1", "true or false"]),
    "number for a choice": ({"potential": 3}, ["potential", "3", "quadratic"]),
    "number for a list": ({"goal": 3.0}, ["goal", "3.0", "list"]),
    "text in a list": ({"goal": [0.0, "x"]}, ["goal", "[0.0, 'x']", "numbers"]),
    "list too short": ({"goal": [0.0]}, ["goal", "[0.0]", "2"]),
    "list too long": ({"initial_pose": [0, 0, 0, 0]}, ["initial_pose", "[0, 0, 0, 0]", "3"]),
    "NaN": ({"k_v": math.nan}, ["k_v", "nan", "finite"]),
    "infinity": ({"k_v": math.inf}, ["k_v", "inf", "finite"]),
    "NaN limit": ({"limits.v": math.nan}, ["limits.v", "nan"]),
    "NaN in a list": ({"goal": [0.0, math.nan]}, ["goal", "[0.0, nan]", "finite"]),
    "huge integer": ({"k_v": 10**400}, ["k_v", "1000", "finite"]),
    "k_v zero": ({"k_v": 0.0}, ["k_v", "0.0", "must not be 0"]),
    "k_omega zero": ({"k_omega": 0.0}, ["k_omega", "0.0", "sign"]),
    "opposite signs": ({"k_v": 0.5, "k_omega": -3.0}, ["k_omega", "-3.0", "sign", "0.5"]),
    "k_omega below k_v": (
        {"law": "position", "k_v": 0.5, "k_omega": 0.4},
        ["k_omega", "0.4", "position", "k_v < k_omega", "0.5"],
    ),
    "k_omega equal k_v": (
        {"law": "heading", "k_v": -0.5, "k_omega": -0.5},
        ["k_omega", "-0.5", "heading", "k_omega < k_v < 0"],
    ),
    "radial with other gains": (
        {"law": "radial", "k_v": 0.5, "k_omega": 3.0},
        ["k_omega", "3.0", "radial", "2 k_v", "1"],
    ),
    "no deceleration": ({"deceleration": 0.0}, ["deceleration", "0.0", "above 0"]),
    "no tolerance": ({"xy_goal_tolerance": 0.0}, ["xy_goal_tolerance", "0.0", "above 0"]),
    "negative limit": ({"limits.wheel": -0.1}, ["limits.wheel", "-0.1", "above 0"]),
    "negative robot": ({"robot_radius": -0.1}, ["robot_radius", "-0.1", "at least 0"]),
    "negative boundary": ({"boundary.radius": -1}, ["boundary.radius", "-1", "at least 0"]),
    "boundary smaller than the robot": (
        {"boundary.radius": 0.1, "goal": [0.0, 0.0]},
        ["boundary.radius", "0.1", "robot_radius 0.105"],
    ),
    "gain of a potential": (
        {"attractive_repulsive.k_repulsive": -1.0},
        ["attractive_repulsive.k_repulsive", "-1.0", "above 0"],
    ),
    "gain of a potential that is not chosen": (
        {"potential": "quadratic", "navigation_function.k": -1.0},
        ["navigation_function.k", "-1.0", "at least 0"],
    ),
    "navigation function without a boundary": (
        {"potential": "navigation_function"},
        ["boundary.radius", "0.0", "navigation_function"],
    ),
    "radius zero": ({**ONE, "obstacles.a.radius": 0.0}, ["obstacles.a.radius", "0.0", "at least"]),
    "radius negative": (
        {**ONE, "obstacles.a.radius": -1},
        ["obstacles.a.radius", "-1", "at least"],
    ),
    "centre NaN": ({**ONE, "obstacles.a.x": math.nan}, ["obstacles.a.x", "nan", "finite"]),
    "overlap": (TWO, ["obstacles.b", "1.5", "overlaps obstacles.a", "0.1 m"]),
    "obstacle outside": (
        {**ONE, "boundary.radius": 2.5, "obstacles.a.x": 3.0},
        ["obstacles.a", "3.0", "outside the boundary"],
    ),
    "goal in an obstacle": (
        {**ONE, "goal": [1.2, 0.0]},
        ["goal", "[1.2, 0.0]", "inside obstacles.a"],
    ),
    "goal too near an obstacle for the robot": (
        {**ONE, "goal": [1.4, 0.0]},
        ["goal", "[1.4, 0.0]", "0.105", "inside obstacles.a", "0.005 m"],
    ),
    "goal outside": (
        {"goal": [3.0, 0.0], "boundary.radius": 2.0},
        ["goal", "[3.0, 0.0]", "outside the boundary"],
    ),
    "start in an obstacle": (
        {**ONE, "initial_pose": [1.1, 0.1, 0.0]},
        ["initial_pose", "[1.1, 0.1]", "inside obstacles.a"],
    ),
    "start outside": (
        {"initial_pose": [0.0, 2.0, 0.0], "boundary.radius": 2.0},
        ["initial_pose", "[0.0, 2.0]", "outside the boundary"],
    ),
    "half a start": ({"starts": [1.0, 2.0, 0.0, 4.0]}, ["starts", "4.0", "n times 3"]),
    "one of the starts in an obstacle": (
        {**ONE, "starts": [0.0, 2.0, 0.0, 1.1, 0.1, 0.0]},
        ["starts", "[1.1, 0.1]", "inside obstacles.a"],
    ),
    "obstacle without an entry": (
        {**ONE, "obstacles.names": ["a", "b"]},
        ["obstacles.names", "['a', 'b']", "obstacles.b.x is missing"],
    ),
    "obstacle without a radius": (
        {key: value for key, value in ONE.items() if key != "obstacles.a.radius"},
        ["obstacles.names", "obstacles.a.radius is missing"],
    ),
    "obstacle that is not named": (
        {**TWO, "obstacles.names": ["a"]},
        ["obstacles.b.x", "1.5", "obstacles.names"],
    ),
    "names twice": ({**ONE, "obstacles.names": ["a", "a"]}, ["obstacles.names", "different"]),
    "name with a dot": ({"obstacles.names": ["a.b"]}, ["obstacles.names", "a.b", "dots"]),
    "empty name": ({"obstacles.names": [""]}, ["obstacles.names", "['']"]),
    "names of numbers": ({"obstacles.names": [1, 2]}, ["obstacles.names", "[1, 2]"]),
    "names no list": ({"obstacles.names": "a"}, ["obstacles.names", "'a'", "list"]),
    "obstacle no mapping": ({**ONE, "obstacles.a": 3}, ["obstacles.a", "3"]),
}
REFUSED_OPTIONS = {
    "message type": ({"cmd_vel_type": "twost"}, ["cmd_vel_type", "'twost'", "mean twist?"]),
    "timeout": ({"odometry_timeout": 0}, ["odometry_timeout", "0", "above 0"]),
    "frame": ({"world_frame": 3}, ["world_frame", "3", "text"]),
    "rate": ({"rate": 0.0}, ["rate", "0.0", "at least 0.1"]),
    "noise": ({"position_noise": -0.1}, ["position_noise", "-0.1", "at least 0"]),
    "drift": ({"odometry_drift": 0.6}, ["odometry_drift", "0.6", "at most 0.5"]),
    "float seed": ({"seed": 1.5}, ["seed", "1.5", "integer"]),
    "negative seed": ({"seed": -1}, ["seed", "-1", "at least 0"]),
    "huge seed": ({"seed": 2**63}, ["seed", str(2**63), "64 bits"]),
}


@pytest.mark.parametrize(("values", "words"), REFUSED.values(), ids=REFUSED.keys())
def test_settings_refuse_in_one_line_that_names_parameter_and_value(values, words):
    text = refusal_of(Settings.of, values)
    assert text.startswith(words[0] + ":")
    assert [word for word in words if word not in text] == []


EVERYTHING_REFUSED = {**REFUSED, **REFUSED_OPTIONS}


@pytest.mark.parametrize(
    ("values", "words"), EVERYTHING_REFUSED.values(), ids=EVERYTHING_REFUSED.keys()
)
def test_a_whole_configuration_refuses_the_same(values, words):
    text = refusal_of(Configuration.of, values)
    assert text.startswith(words[0] + ":")
    assert [word for word in words if word not in text] == []


def test_a_refusal_of_a_long_value_stays_short():
    assert len(refusal_of(Settings.of, {"goal": list(range(10_000))})) < 200


def test_a_parameter_error_tells_its_parts():
    with pytest.raises(ParameterError) as caught:
        Settings.of({"limits.v": -1.0})
    assert (caught.value.name, caught.value.value) == ("limits.v", -1.0)


# Junk: accepted or refused in one line, and nothing else

NAMES = sorted(known_parameters(TWO))
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from([0, 1, -1, 0.1, 0.5, 3.0, 1e300, -1e300, 10**400, 2**63])
    | st.sampled_from(["descent", "radial", "none", "quadratic", "navigation_function", "a", "b"])
    | st.text(max_size=20)
    | st.binary(max_size=5)
)
JUNK = SCALARS | st.lists(SCALARS, max_size=4) | st.dictionaries(st.text(), SCALARS, max_size=2)


def accepts_or_refuses(make, values):
    refusal = None
    try:
        make(values)
    except GradnavError as error:
        refusal = error
    assert refusal is None or is_one_line(refusal)


@given(values=st.dictionaries(st.sampled_from(NAMES), JUNK, min_size=1, max_size=3))
def test_junk_for_known_parameters_is_accepted_or_refused_in_one_line(values):
    accepts_or_refuses(Settings.of, {**TWO, "obstacles.b.x": -1.0, **values})
    accepts_or_refuses(Configuration.of, values)


@given(values=st.dictionaries(st.text(), JUNK, min_size=1, max_size=3))
@example(values={"two\nlines": 1.0})
@example(values={"obstacles.two\nlines.x": 1.0})
@example(values={"obstacles.names": ["two\nlines"]})
def test_junk_for_a_name_is_refused_in_one_line(values):
    accepts_or_refuses(Settings.of, values)
    accepts_or_refuses(Configuration.of, values)


@pytest.mark.parametrize("name", ["k_v", "law", "seed", "goal", "obstacles.names", "auto_reverse"])
def test_an_integer_too_long_to_print_is_refused_in_one_line(name):
    """YAML holds such an integer in hexadecimal; Python declines to print it in decimal."""
    refusal_of(Configuration.of, {name: 16**5000})


# Parameter files


@pytest.fixture
def read(tmp_path):
    """Return what a parameter file with this text holds for /navigator, or another node."""

    def read(text, node="/navigator"):
        path = tmp_path / "file.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return parameter_file.read(path, node)

    return read


def section(name, *lines):
    return f"{name}:\n  ros__parameters:\n" + "".join(f"    {line}\n" for line in lines)


@pytest.mark.parametrize("path", sorted(CONFIG.glob("*.yaml")), ids=lambda path: path.name)
def test_every_file_that_is_shipped_is_valid(path):
    for node in ("/navigator", "/fake_robot"):
        assert Configuration.of(parameter_file.read(path, node)).settings.has_goal


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("0.5", 0.5),
        ("1e-3", 0.001),
        ("1E3", 1000.0),
        ("-2.5e+1", -25.0),
        (".5e1", 5.0),
        ("1.", 1.0),
        (".inf", math.inf),
    ],
)
def test_numbers_of_every_notation_are_numbers(read, text, value):
    got = read(section("/**", f"k_v: {text}"))["k_v"]
    assert got == value
    assert type(got) in (int, float)


@pytest.mark.parametrize("text", ["'1e-3'", "e3", "1e", "v1e3", "1e3m"])
def test_what_only_looks_like_a_number_is_text(read, text):
    assert read(section("/**", f"world_frame: {text}"))["world_frame"] == text.strip("'")


def test_nested_names_are_dotted_and_lists_kept(read):
    body = section("/**", "limits: {v: 0.1}", "obstacles:", "  a: {x: 1}", "goal: [1, 2.5]")
    assert read(body) == {"limits.v": 0.1, "obstacles.a.x": 1, "goal": [1, 2.5]}


def test_an_empty_list_leaves_the_default(read):
    settings = Settings.of(read(section("/**", "k_v: 1", "obstacles: {names: []}", "goal: []")))
    assert (settings.obstacles, settings.has_goal) == ({}, False)


@pytest.mark.parametrize(
    "name",
    ["/**", "/*", "navigator", "/navigator", "/**/navigator", "'*'", "'**'"],
)
def test_a_section_for_the_node_matches(read, name):
    assert read(section(name, "k_v: 1")) == {"k_v": 1}


@pytest.mark.parametrize(
    "name", ["/ns/navigator", "navigators", "/navigator/x", "/*/navigator", "/fake_robot", "nav*"]
)
def test_a_section_for_another_node_does_not_match(read, name):
    text = refusal_of(read, section(name, "k_v: 1"))
    assert "/navigator" in text
    assert name in text


@pytest.mark.parametrize("name", ["/**", "/ns/*", "/*/navigator", "/ns/navigator", "/ns/**"])
def test_a_section_for_a_node_in_a_namespace_matches(read, name):
    assert read(section(name, "k_v: 1"), "/ns/navigator") == {"k_v": 1}


def test_a_namespace_may_be_a_level_of_its_own(read):
    body = "/ns:\n  navigator:\n    ros__parameters:\n      k_v: 1\n"
    assert read(body, "/ns/navigator") == {"k_v": 1}
    refusal_of(read, body, "/navigator")


def test_sections_before_and_after_a_namespace_are_read_too(read):
    inside = "/ns:\n  navigator:\n    ros__parameters:\n      k_v: 1\n"
    body = section("/**", "k_omega: 5", "goal: [0, 0]") + inside + section("/*/*", "k_omega: 6")
    assert read(body, "/ns/navigator") == {"k_omega": 6, "goal": [0, 0], "k_v": 1}


def test_later_sections_override_earlier_ones(read):
    wide, narrow = section("/**", "k_v: 1", "k_omega: 5"), section("navigator", "k_v: 2")
    assert read(wide + narrow) == {"k_v": 2, "k_omega": 5}
    assert read(narrow + wide) == {"k_v": 1, "k_omega": 5}


REFUSED_FILES = {
    "anchor": (section("/**", "k_v: &x 1", "k_omega: *x"), ["anchors", "line 3"]),
    "alias": (section("/**", "k_v: *x"), ["line 3"]),
    "duplicate key": (section("/**", "k_v: 1", "k_v: 2"), ["k_v is given twice", "line 4"]),
    "duplicate section": (section("/**", "k_v: 1") + section("/**", "k_v: 2"), ["/**", "twice"]),
    "duplicate number": (section("/**", "1: 1", "1: 2"), ["1 is given twice"]),
    "duplicate of two lines": (section("/**", r'"a\nb": 1', r'"a\nb": 2'), ["twice"]),
    "broken": ("/**: {ros__parameters: [", ["not a YAML file", "line 1"]),
    "tab": ("/**:\n\tros__parameters: {}", ["not a YAML file", "line 2"]),
    "two documents": ("a: 1\n---\nb: 2\n", ["not a YAML file"]),
    "unknown tag": (section("/**", "k_v: !!python/object:os.system x"), ["line 3"]),
    "key no scalar": (section("/**", "? [a]", ": 1"), ["not a YAML file"]),
    "empty": ("", ["not a ROS 2 parameter file"]),
    "only a comment": ("# nothing\n", ["not a ROS 2 parameter file"]),
    "list": ("- 1\n- 2\n", ["not a ROS 2 parameter file"]),
    "text": ("hello", ["not a ROS 2 parameter file"]),
    "no ros__parameters": ("k_v: 0.5\n", ["k_v", "ros__parameters"]),
    "empty section": ("/**:\n", ["/**", "ros__parameters"]),
    "parameters no mapping": ("/**:\n  ros__parameters: 3\n", ["/**", "names and values"]),
    "section of two lines": ('"a\\nb": 3\n', ["ros__parameters"]),
    "binary": (bytes(range(256)), ["not a YAML file"]),
    "zeros": (bytes(1000), ["not a YAML file"]),
    "latin-1": ("/**: {ros__parameters: {a: ä}}".encode("latin-1"), ["not a YAML file"]),
    "deep lists": ("[" * 10_000, ["not a YAML file"]),
    "deep mappings": ("{a: " * 10_000 + "}" * 10_000, ["not a YAML file"]),
    "deep sections": ("".join(" " * i + "a:\n" for i in range(2_000)), ["not a YAML file"]),
    "date": (section("/**", "k_v: 2001-99-99"), ["not a YAML file"]),
    "tagged number": (section("/**", 'k_v: !!int ""'), []),
    "tagged float": (section("/**", 'k_v: !!float ""'), []),
    "tagged bool": (section("/**", "k_v: !!bool perhaps"), []),
    "tagged date": (section("/**", "k_v: !!timestamp never"), []),
}


@pytest.mark.parametrize(("text", "words"), REFUSED_FILES.values(), ids=REFUSED_FILES.keys())
def test_a_file_that_cannot_be_read_is_refused_in_one_line_with_its_name(read, text, words):
    message = refusal_of(read, text)
    assert "file.yaml: " in message
    assert [word for word in words if word not in message] == []


def test_a_missing_file_is_refused_in_one_line():
    assert "nowhere.yaml" in refusal_of(parameter_file.read, "nowhere.yaml")


def test_a_directory_is_refused_in_one_line(tmp_path):
    assert str(tmp_path) in refusal_of(parameter_file.read, tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_is_refused_in_one_line(tmp_path):
    path = tmp_path / "secret.yaml"
    path.write_text(section("/**", "k_v: 1"))
    path.chmod(0)
    assert "secret.yaml" in refusal_of(parameter_file.read, path)


@pytest.mark.parametrize("path", ["", "\0", "x" * 10_000], ids=["empty", "zero", "long"])
def test_a_path_that_cannot_be_is_refused_in_one_line(path):
    refusal_of(parameter_file.read, path)


@given(text=st.text(alphabet="{}[]:,-'\"#&*!|>%@ \nab1.e/_", max_size=60))
def test_any_text_is_a_parameter_file_or_refused_in_one_line(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    for content in (text, section("/**", *text.split("\n"))):
        path.write_text(content)
        accepts_or_refuses(parameter_file.read, path)


# Rewriting a file in the dialect of rcl


@pytest.mark.parametrize("path", sorted(CONFIG.glob("*.yaml")), ids=lambda path: path.name)
def test_rewriting_changes_no_value(tmp_path, path):
    again = tmp_path / "again.yaml"
    again.write_text(parameter_file.rewritten(path))
    for node in ("/navigator", "/fake_robot"):
        assert parameter_file.read(again, node) == parameter_file.read(path, node)


def test_rewriting_makes_a_mixed_list_a_list_of_floats(tmp_path):
    path = tmp_path / "mixed.yaml"
    path.write_text(section("/**", "goal: [1, 2.5]", "seed: 3", "names: ['1', 'true']"))
    path.write_text(parameter_file.rewritten(path))
    values = parameter_file.read(path)
    assert [type(value) for value in values["goal"]] == [float, float]
    assert (values["seed"], values["names"]) == (3, ["1", "true"])


@pytest.mark.parametrize("value", ["", "null", "~", "[]"])
def test_what_has_no_value_is_left_out(tmp_path, value):
    path = tmp_path / "unset.yaml"
    path.write_text(section("/**", f"goal: {value}", "seed: 3"))
    assert parameter_file.read(path) == {"seed": 3}
    path.write_text(parameter_file.rewritten(path))
    assert parameter_file.read(path) == {"seed": 3}


@pytest.mark.parametrize("value", ["!!binary aGk=", "!!set {a}"])
def test_rewriting_refuses_what_rcl_cannot_read(tmp_path, value):
    path = tmp_path / "none.yaml"
    path.write_text(section("/**", f"k_v: {value}"))
    assert "k_v" in refusal_of(parameter_file.rewritten, path)


@pytest.mark.parametrize(
    ("rule", "rewritten"),
    [
        ("goal:=[1, 2.5]", "goal:=[1.0, 2.5]"),
        ("k_v:=1", "k_v:=1"),
        ("law:=descent", "law:=descent"),
        ("goal:=[1, ", "goal:=[1, "),
        ("__ns:=/robot", "__ns:=/robot"),
    ],
)
def test_rewriting_a_rule_touches_mixed_lists_only(rule, rewritten):
    assert parameter_file.rewritten_rule(rule) == rewritten

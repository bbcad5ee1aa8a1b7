# SPDX-License-Identifier: Apache-2.0
"""The command gradnav as a user types it."""

import json
import os
import re
import signal
import subprocess
import sys
from importlib.metadata import version

import pytest
from conftest import CONFIG, ROOT, heed_signals, ros_domain

OK, NO, WRONG = 0, 1, 2


def gradnav(*arguments, env=None, **options):
    return subprocess.run(
        [sys.executable, "-m", "tbot_gradnav.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
        env=os.environ | (env or {}),
        **options,
    )


def assert_refused(result, *words):
    assert result.returncode == WRONG, result.stderr
    assert len(result.stderr.splitlines()) == 1
    for word in words:
        assert word in result.stderr


@pytest.mark.parametrize("file", sorted(CONFIG.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_shipped_file_brings_its_robots_home(file):
    result = gradnav("simulate", file)
    assert result.returncode == OK, result.stderr
    assert re.match(r"(\d+) of \1 arrived", result.stdout)


def test_a_shipped_file_is_found_by_its_name_from_anywhere(tmp_path):
    assert gradnav("simulate", "minimal.yaml", cwd=tmp_path).returncode == OK


def test_json_says_what_became_of_each_robot(tmp_path):
    out = tmp_path / "new" / "runs.json"
    file = CONFIG / "nine_navigation_function.yaml"
    result = gradnav("simulate", file, "--random", 7, "--seed", 3, "--json", out)
    assert result.returncode == OK
    report = json.loads(out.read_text())
    assert (report["law"], report["potential"]) == ("descent", "navigation_function")
    assert (report["seed"], len(report["runs"])) == (3, 7)
    for run in report["runs"]:
        assert run["arrived"]
        assert not run["collided"]
        assert len(run["start"]) == 3
        assert run["final_distance"] <= 0.05
        assert run["min_clearance"] > 0.0
        assert run["time"] * 0.21 >= run["path_length"] > 0.0
    again = gradnav("simulate", file, "--random", 7, "--seed", 3, "--json", out)
    assert again.returncode == OK
    assert json.loads(out.read_text()) == report


def test_starts_are_those_given(tmp_path):
    out = tmp_path / "runs.json"
    starts = ["--start", "1", "-1", "0.5", "--start", "-1", "-1e-1", "3"]
    assert gradnav("simulate", "position.yaml", *starts, "--json", out).returncode == OK
    found = [run["start"] for run in json.loads(out.read_text())["runs"]]
    assert found == [pytest.approx([1.0, -1.0, 0.5]), pytest.approx([-1.0, -0.1, 3.0])]


def test_simulate_says_that_it_passes_no_waypoints(parameter_file):
    result = gradnav("simulate", parameter_file("goal: [1, 0]\nwaypoints: [0.5, 0.5]"))
    assert result.returncode == 0
    assert "only the navigator passes them" in result.stderr


def test_answers_no_where_a_robot_collides(parameter_file):
    box = "obstacles: {names: [box], box: {x: 1, y: 0, radius: 0.2}}"
    file = parameter_file(f"law: position\ngoal: [2, 0]\n{box}")
    result = gradnav("simulate", file)
    assert result.returncode == NO
    assert "1 collided" in result.stdout


def test_every_law_can_be_asked_for(tmp_path):
    out = tmp_path / "runs.json"
    for law in ("position", "radial", "heading", "descent"):
        file = "nine_navigation_function.yaml"
        result = gradnav("simulate", file, "--law", law, "--json", out)
        assert result.returncode in (OK, NO), result.stderr
        assert json.loads(out.read_text())["law"] == law


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.yaml"], ["none.yaml", "minimal.yaml"]),
        (["position.yaml", "--law", "up"], ["law: 'up'", "descent"]),
        (["position.yaml", "--potential", "hill"], ["potential: 'hill'", "quadratic"]),
        (["position.yaml", "--random", "0"], ["--random: 0"]),
        (["position.yaml", "--seed", "-1", "--random", "1"], ["--seed: -1"]),
        (["position.yaml", "--start", "a", "0", "0"], ["--start"]),
        (["position.yaml", "--start", "nan", "0", "0"], ["--start"]),
        (["position.yaml", "--random", "99999999999999"], ["memory"]),
        (["nine_navigation_function.yaml", "--start", "1.6", "0.2", "0"], ["obstacles.a"]),
        (["nine_navigation_function.yaml", "--start", "5", "0", "0"], ["outside the boundary"]),
        (["position.yaml", "--json", "/proc/none/x.json"], ["/proc/none/x.json"]),
        (["position.yaml", "--plot", "/proc/none/x.png"], ["/proc/none/x.png"]),
        (["position.yaml", "--plot", "picture.xyz", "--random", "999999999"], ["picture.xyz"]),
        (["position.yaml", "--start", "0", "0", "90"], ["--start", "at most 12.57"]),
        (["."], ["directory"]),
    ],
)
def test_wrong_input_is_refused_in_one_line(arguments, words):
    assert_refused(gradnav("simulate", *arguments), *words)


def test_a_file_that_holds_something_else_is_left_alone(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text((CONFIG / "position.yaml").read_text())
    result = gradnav("simulate", file, "--json", file)
    assert_refused(result, "mine.yaml", "not called .json")
    assert file.read_text() == (CONFIG / "position.yaml").read_text()


def test_the_version_is_the_packages():
    assert gradnav("--version").stdout.strip() == version("tbot_gradnav")


def test_a_full_disk_leaves_no_half_a_file(tmp_path):
    out = tmp_path / "runs.json"
    out.write_text("before")
    result = gradnav("simulate", "position.yaml", "--json", out / "under_a_file.json")
    assert_refused(result, "under_a_file.json")
    assert out.read_text() == "before"
    assert list(tmp_path.iterdir()) == [out]


def test_only_files_are_replaced_and_links_stay(tmp_path):
    assert_refused(gradnav("simulate", "position.yaml", "--json", "/dev/null"), "/dev/null")
    assert_refused(gradnav("simulate", "position.yaml", "--json", tmp_path), "left alone")
    real, link = tmp_path / "real.json", tmp_path / "link.json"
    link.symlink_to(real)
    assert gradnav("simulate", "position.yaml", "--json", link).returncode == OK
    assert link.is_symlink()
    assert json.loads(real.read_text())["law"] == "position"


def test_help_and_no_command_and_a_closed_pipe_are_no_accident():
    assert gradnav("--help").returncode == OK
    assert_refused(gradnav(), "COMMAND")
    assert_refused(gradnav("dance"), "dance")
    assert_refused(gradnav("simulate"), "file")
    assert_refused(gradnav("simulate", "position.yaml", "--random", "many"), "many")
    assert gradnav("simulate", "--help").returncode == OK
    piped = f"{sys.executable} -m tbot_gradnav.cli simulate position.yaml | true"
    result = subprocess.run(piped, shell=True, capture_output=True, text=True, check=False)
    assert result.stderr == ""


def from_readme(name):
    """Return the code block of the README that begins with a comment of this file's name."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    return next(block for block in blocks if block.startswith(f"# {name}\n"))


@pytest.fixture(scope="module")
def installed_potential(tmp_path_factory):
    """Install the potential of the README; give the environment that sees it."""
    source, target = tmp_path_factory.mktemp("cone"), tmp_path_factory.mktemp("installed")
    for name in ("cone.py", "setup.py"):
        (source / name).write_text(from_readme(name))
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", target, source], check=True, timeout=100)
    return {"PYTHONPATH": str(target)}


def test_a_potential_of_the_users_own_drives(installed_potential, parameter_file):
    in_the_way = "obstacles: {names: [a], a: {x: 0.5, y: 0.45, radius: 0.2}}"
    file = parameter_file(f"potential: cone\ncone: {{steepness: 2}}\ngoal: [1, 1]\n{in_the_way}")
    result = gradnav("simulate", file, env=installed_potential)
    assert result.returncode == OK, result.stderr
    assert "1 of 1 arrived, 0 collided" in result.stdout
    assert gradnav("check", file, env=installed_potential).returncode == OK


def test_its_parameters_are_checked_like_ours(installed_potential, parameter_file):
    for text, words in (
        ("cone: {steepness: 0}", "cone.steepness: 0"),
        ("cone: {slope: 1}", "cone.slope"),
    ):
        file = parameter_file(f"potential: cone\ngoal: [1, 1]\n{text}")
        assert_refused(gradnav("simulate", file, env=installed_potential), words)


@pytest.fixture
def domain():
    """Give the demo a domain of its own."""
    with ros_domain() as domain:
        yield {"ROS_DOMAIN_ID": str(domain)}


def replayed(folder, bag, file):
    """Replay a demo's bag; return how many commands it holds.

    On a busy machine a command may come after more odometry than a replay looks back, but only a
    few do; one that misses a goal or a pause differs by as much as the robot drives.
    """
    verdict = folder / "verdict.json"
    assert gradnav("replay", bag, file, "--json", verdict).returncode in (OK, NO)
    found = json.loads(verdict.read_text())
    assert found["rms_v_difference"] < 0.05
    assert found["rms_omega_difference"] < 0.3
    return found["commands"]


def test_demo_drives_to_the_goal_and_leaves_a_picture_and_a_bag(tmp_path, domain):
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from rosbags.highlevel import AnyReader

    result = gradnav("demo", "--out", tmp_path / "out", env=domain)
    assert result.returncode == OK, result.stderr
    assert "arrived after" in result.stdout
    assert result.stdout.count("goal ") > 3  # progress while it drives
    assert (tmp_path / "out" / "demo.png").read_bytes().startswith(b"\x89PNG")
    with AnyReader([tmp_path / "out" / "bag"]) as bag:
        counts = {topic: info.msgcount for topic, info in bag.topics.items()}
    assert counts["/odom"] > 100
    assert counts["/cmd_vel"] > 100
    assert replayed(tmp_path, tmp_path / "out" / "bag", "demo.yaml") == counts["/cmd_vel"]


def test_a_demo_may_end_where_it_begins(tmp_path, domain, parameter_file):
    pytest.importorskip("rclpy", reason="needs ROS 2")
    file = parameter_file(
        "goal: [0, 0]\nwaypoints: [0.5, 0, 0.5, 0.5]\nreal_time_factor: 2.0\nuse_sim_time: true"
    )
    result = gradnav("demo", file, "--out", tmp_path, env=domain)
    assert result.returncode == OK, result.stderr
    assert float(re.search(r"arrived after ([\d.]+) s", result.stdout)[1]) > 3.0
    assert replayed(tmp_path, tmp_path / "bag", file) > 50


def test_demo_refuses_what_it_cannot_drive(tmp_path, parameter_file):
    assert_refused(gradnav("demo", parameter_file("k_v: 1.0")), "goal is missing")
    assert_refused(gradnav("demo", parameter_file("goal: [1, 1]\nlaw: up")), "law: 'up'")
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "diary.txt").write_text("dear diary")
    assert_refused(gradnav("demo", "--out", tmp_path), "left alone")
    (tmp_path / "file").write_text("")
    assert_refused(gradnav("demo", "--out", tmp_path / "file"), "no folder", "left alone")
    assert (tmp_path / "bag" / "diary.txt").read_text() == "dear diary"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupting_the_demo_ends_both_nodes(tmp_path, domain, number):
    pytest.importorskip("rclpy", reason="needs ROS 2")
    command = [sys.executable, "-m", "tbot_gradnav.cli", "demo", "--out", str(tmp_path)]
    demo = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True, preexec_fn=heed_signals, cwd=ROOT,
        env=os.environ | domain | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    try:
        for line in demo.stdout:
            if "goal " in line and "v +0.2" in line:
                break
        demo.send_signal(number)
        words = demo.stdout.read()
        assert demo.wait(20) == 130, words
    finally:
        demo.kill()
    assert "zero velocity" in words
    assert "Traceback" not in words
    assert not (tmp_path / "bag").exists()

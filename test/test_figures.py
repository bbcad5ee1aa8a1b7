# SPDX-License-Identifier: Apache-2.0
"""The paper's figures: that they are drawn, and that what is drawn is what the paper says."""

import importlib.util
import struct
from argparse import Namespace

import numpy as np
import pytest
from conftest import CONFIG, ros_domain
from test_commands import NO, OK, assert_refused, gradnav

from tbot_gradnav import closed_form, figures
from tbot_gradnav.commands import figures as command
from tbot_gradnav.errors import GradnavError

FIGURES = ("2", "3", "4a", "4b", "5", "6", "7a", "7b", "8")
OVER_ROS = ("7a_ros", "7b_ros", "8_ros")
ROS = importlib.util.find_spec("rclpy") is not None


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Run the command once; give its result and the folder of pictures."""
    out = tmp_path_factory.mktemp("figures") / "new"
    with ros_domain() as domain:
        environment = {"ROS_DOMAIN_ID": str(domain)}
        return gradnav("figures", "--out", out, *["--ros"] * ROS, env=environment), out


@pytest.fixture(scope="module")
def runs():
    """Give the groups of runs of every figure."""
    return {figure: figures.drive(figure) for figure in FIGURES}


def width(path):
    """Return the width of a PNG in pixels."""
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    return struct.unpack(">I", data[16:20])[0]


def test_every_figure_is_a_picture(drawn):
    result, out = drawn
    assert result.returncode == OK, result.stderr
    expected = FIGURES + OVER_ROS * ROS
    assert {path.name for path in out.iterdir()} == {f"figure_{name}.png" for name in expected}
    assert all(width(path) >= 600 for path in out.iterdir())
    assert result.stdout.count("all arrived") == len(expected)


def test_every_run_arrives_without_collision(runs):
    counts = {"2": 26, "3": 12, "4a": 7, "4b": 7, "5": 4, "6": 4, "7a": 1, "7b": 1, "8": 2}
    for figure, groups in runs.items():
        assert figures.failed(groups) == ""
        assert sum(map(len, groups)) == counts[figure]
        for run in (run for group in groups for run in group):
            world = run.settings.world
            assert np.min(world.clearance(run.path[0], run.path[1])) > 0.0
            assert run.polar[0][-1] <= run.settings.xy_goal_tolerance


def test_figure_2_has_a_run_to_every_stable_equilibrium_and_to_no_other(runs):
    ends = [{float(run.polar[1][-1] / np.pi) for run in group} for group in runs["2"]]
    for found, stable in zip(ends, ((-2, 0, 2), (-3, -1, 1, 3)), strict=True):
        assert {round(end) for end in found} == set(stable)
        assert all(abs(end - round(end)) < 0.05 for end in found)


def exact_path(run):
    """Return x, y of the position law in closed form; alpha from d alpha / d beta, eq. (9)."""
    k_v, k_omega = run.settings.k_v, run.settings.k_omega
    (rho_0, *_), (beta_0, *_) = run.polar
    if abs(np.sin(beta_0)) < 1e-9:  # straight there
        rho, beta = rho_0 * np.exp(-abs(k_v) * run.t), beta_0
    else:
        rho = closed_form.rho(run.t, rho_0, beta_0, k_v, k_omega)
        beta = closed_form.beta(run.t, beta_0, k_v, k_omega)
        beta = np.unwrap(beta) + 2.0 * np.pi * np.round((beta_0 - beta[0]) / (2.0 * np.pi))
    alpha = np.arctan2(run.path[1, 0], run.path[0, 0]) + k_v / (k_omega - k_v) * (beta - beta_0)
    return rho * np.cos(alpha), rho * np.sin(alpha)


def test_figure_3_is_the_closed_form(runs):
    for run in (run for group in runs["3"] for run in group):
        x, y = exact_path(run)
        assert np.hypot(run.path[0] - x, run.path[1] - y).max() < 1e-3


def test_figure_3_has_the_starts_of_remark_iv_4(runs):
    betas = [run.polar[1][0] for group in runs["3"] for run in group]
    for case, cosine in {4: 1.0, 6: 1.0, 7: -1.0, 10: -1.0}.items():
        assert np.cos(betas[case - 1]) == pytest.approx(cosine, abs=1e-12)
        assert np.sin(betas[case - 1]) == pytest.approx(0.0, abs=1e-12)


def test_figure_6_shows_the_runs_of_figure_5_and_figure_8_those_of_7():
    for node in figures.BOTH_SIGNS:
        assert figures.scenario("6", node) == figures.scenario("5", node)
    assert figures.scenario("8") == figures.scenario("7a")
    eight, seven = figures.scenario("8", "/attractive_repulsive"), figures.scenario("7b")
    for name in ("law", "potential", "chosen_potential", "initial_pose", "xy_goal_tolerance"):
        assert getattr(eight, name) == getattr(seven, name)


def test_the_limits_of_figure_5_bend_no_path(runs):
    for run in (run for group in runs["5"] for run in group):
        k_v, k_omega = run.settings.k_v, run.settings.k_omega
        rho, beta = run.polar
        far = rho > 0.1
        exact = rho[0] * (np.sin(beta) / np.sin(beta[0])) ** (k_v / (k_omega - k_v))
        assert np.abs(rho - exact)[far].max() < 0.02


def test_the_potential_of_figure_8_never_rises_and_ends_near_zero(runs):
    for (run,) in runs["8"]:
        phi, mu = run.potential
        assert np.all(np.diff(phi) <= 0.0)
        assert phi[-1] < 0.01 * phi[0]
        assert mu[-1] < 0.05 * mu.max()


def test_a_run_that_does_not_arrive_is_told_of(tmp_path, monkeypatch, capsys):
    text = (CONFIG / "figure_4a.yaml").read_text()
    (tmp_path / "figure_4a.yaml").write_text(text.replace("k: 8.0", "k: 2.0"))  # spurious minima
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figures, "PICTURES", {"4a": figures.PICTURES["4a"]})
    assert command.run(Namespace(out="out", ros=False)) == NO
    assert "not arrived: 1, 2, 3, 4, 5, 6, 7" in capsys.readouterr().out
    assert width(tmp_path / "out" / "figure_4a.png") >= 600


def test_wrong_input_is_refused_in_one_line(parameter_file, tmp_path):
    assert_refused(gradnav("figures", "--out", "/proc/none"), "/proc/none")
    file = parameter_file("law: up\ngoal: [0, 0]", "figure_2.yaml")
    assert_refused(gradnav("figures", cwd=tmp_path), "figure_2.yaml", "law: 'up'")
    file.write_text(file.read_text().replace("goal", "# goal").replace("up", "position"))
    assert_refused(gradnav("figures", cwd=tmp_path), "figure_2.yaml", "goal is missing")


def test_a_file_with_too_few_starts_is_refused(parameter_file, tmp_path, monkeypatch):
    parameter_file("goal: [0, 0]\ninitial_pose: [1, 1, 0]", "figure_5.yaml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(GradnavError, match="starts: there must be 2"):
        figures.drive("5")


def test_ros_is_refused_where_there_is_none(tmp_path):
    (tmp_path / "rclpy.py").write_text("raise ImportError")
    result = gradnav("figures", "--ros", cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)})
    assert_refused(result, "ROS 2")

# SPDX-License-Identifier: Apache-2.0
"""The laws compared: a smaller study, its statistics, and the command that prints it."""

import json
import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_commands import OK, assert_refused, gradnav

from tbot_gradnav import closed_form, study
from tbot_gradnav.commands import study as command
from tbot_gradnav.shortest_path import shortest_paths
from tbot_gradnav.simulate import START_CLEARANCE, simulate

N = 1000
SEED = 1
EQ_22 = "radial: eq. (22) as printed"
LAWS, PATHS, TIMES = study.TABLES
CASES = {case.name: case for case in LAWS.cases}
# Counts of arrived, collided and neither in 1000 starts of another simulation of these laws.
BEFORE = {
    (EQ_22, "psi"): (435, 565, 0),
    (EQ_22, "U"): (515, 453, 32),
    ("eq. (22) with gamma for alpha", "psi"): (441, 559, 0),
    ("eq. (22) with gamma for alpha", "U"): (596, 371, 33),
    ("heading, the bare formula", "psi"): (974, 26, 0),
    ("heading, the bare formula", "U"): (964, 36, 0),
    ("descent", "psi"): (1000, 0, 0),
    ("descent", "U"): (1000, 0, 0),
}
# Its median and 95th percentile of paths until arrival, from 300 starts.
PATHS_BEFORE = {
    "psi, k = 8": (1.084, 1.402),
    "psi, k = 15": (1.020, 1.117),
    "U, k_r = 0.05, d_0 = 0.6": (1.034, 1.122),
    "U, k_r = 0.002, d_0 = 0.3": (1.002, 1.066),
}


@pytest.fixture(scope="module")
def rows():
    """Return the rows of a study of 1000 starts each, by table and name."""
    return {(t.key, row.name): row for t, rows in study.study(N, SEED) for row in rows}


@pytest.fixture(scope="module")
def circling():
    """Return 1000 runs of eq. (22) over each potential."""
    start = LAWS.starts(N, SEED)
    return {
        field: simulate(LAWS.controller(CASES[EQ_22, field]), start, time_limit=study.TIME_LIMIT)
        for field in study.FIELDS
    }


# What the study finds


def test_descent_brings_every_robot_home_untouched(rows):
    found = [row for (key, name), row in rows.items() if key != "laws" or name[0] == "descent"]
    assert len(found) == 2 + len(PATHS.cases) + len(TIMES.cases)
    for row in found:
        assert row.arrived.value == 1.0
        assert row.collided.value == row.neither.value == 0.0
        assert row.min_clearance > 0.05


@pytest.mark.parametrize("name", BEFORE, ids=" over ".join)
def test_shares_are_those_of_another_simulation(rows, name):
    """Differences of two shares, within intervals that hold jointly with 99 %."""
    row = rows["laws", name]
    z = NormalDist().inv_cdf(1.0 - 0.01 / (2 * 3 * len(BEFORE)))
    for count, share in zip(BEFORE[name], (row.arrived, row.collided, row.neither), strict=True):
        pooled = (count + share.value * N) / (2 * N)
        half = z * math.sqrt(2.0 * pooled * (1.0 - pooled) / N)
        assert share.value == pytest.approx(count / N, abs=half + 1e-12)


@pytest.mark.parametrize("name", PATHS_BEFORE)
def test_paths_are_as_long_as_in_another_simulation(rows, name):
    """Within what 300 starts, and shortest paths measured on a grid, leave open."""
    median, p95 = PATHS_BEFORE[name]
    found = rows["paths", (name,)].driven
    assert median == pytest.approx(found.median.value, abs=0.02)
    assert p95 == pytest.approx(found.p95.value, abs=0.04)


def test_eq_22_fares_alike_over_both_potentials_up_to_the_outer_wall(circling):
    """Both have the same obstacles, but only psi has the wall; no obstacle is near it."""
    psi, u = circling["psi"], circling["U"]
    at_the_wall = psi.collided & (psi.final_distance > 4.45)
    assert at_the_wall.sum() > 0.05 * N
    assert u.arrived[at_the_wall].any()
    for seen in ("arrived", "collided", "path_length"):
        assert np.allclose(getattr(psi, seen)[~at_the_wall], getattr(u, seen)[~at_the_wall])


@pytest.mark.parametrize("field", study.FIELDS)
def test_the_paths_of_eq_22_are_circles_through_the_goal(field):
    start = LAWS.starts(50, SEED)
    controller = LAWS.controller(CASES[EQ_22, field])
    runs = simulate(controller, start, dt=0.005, time_limit=30.0, record=True)
    x, y, theta = runs.path
    rho = np.hypot(x, y)
    sin_beta = (np.sin(theta) * x - np.cos(theta) * y) / rho
    bent = np.abs(sin_beta[0]) > 0.1
    diameter = closed_form.circle_constant(rho, sin_beta)[:, bent]
    assert np.allclose(diameter, diameter[0], rtol=0.02)


def test_no_path_to_the_goal_is_shorter_than_the_shortest():
    for table in study.TABLES:
        start = table.starts(100, SEED)
        shortest = shortest_paths(table.settings().world, start.x, start.y)
        for case in table.cases:
            runs = simulate(table.controller(case), start, time_limit=40.0)
            whole = runs.path_length + runs.final_distance
            assert (whole >= shortest - 1e-9)[runs.arrived].all()


def test_turning_faster_takes_less_time_and_braking_late_too(rows):
    def median(*name):
        return rows["times", ("U, k_r = 0.002, d_0 = 0.2", *name)].time.median.value

    for gear in ("nearer", "forward"):
        times = [median("brake", k_omega, gear) for k_omega in ("6", "3", "1.5")]
        assert times == sorted(times)
        assert median("exponential", "1.5", gear) > times[-1]
    assert median("brake", "3", "nearer") < median("brake", "3", "forward")


# Starts and cases


@pytest.mark.parametrize("table", study.TABLES, ids=lambda table: table.key)
def test_starts_are_clear_far_enough_and_the_same_each_time(table):
    start, world = table.starts(N, SEED), table.settings().world
    assert np.shape(start.x) == (N,)
    assert (world.clearance(start.x, start.y) >= START_CLEARANCE).all()
    assert (np.hypot(start.x, start.y) >= table.beyond).all()
    assert np.array_equal(start, table.starts(N, SEED))
    assert not np.array_equal(start, table.starts(N, SEED + 1))


def test_the_laws_that_are_not_offered_are_what_they_are_called():
    """Where rho = mu, eq. (22) about gamma and the bare heading law are the same formula."""
    start = LAWS.starts(N, SEED)
    about_gamma = LAWS.controller(CASES["eq. (22) with gamma for alpha", "U"])
    bare = LAWS.controller(CASES["heading, the bare formula", "U"])
    at = bare._state(start)._replace(mu=np.hypot(start.x, start.y))
    assert np.allclose(about_gamma.law(0.5, 1.0, at), bare.law(0.5, 1.0, at))
    offered = LAWS.controller(CASES["heading", "U"])
    downhill = at.cos_theta * at.cos_gamma + at.sin_theta * at.sin_gamma < 0.0
    bare_twist, twist = np.array(bare.law(0.5, 1.5, at)), np.array(offered.law(0.5, 1.5, at))
    assert np.allclose(bare_twist[:, downhill], twist[:, downhill])


# Statistics


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.integers(1, 20_000), st.data())
def test_wilsons_interval_ends_at_the_roots_of_its_definition(n, data):
    successes = data.draw(st.integers(0, n))
    share, low, high = study.wilson(successes, n)
    assert share == successes / n
    assert 0.0 <= low <= share <= high <= 1.0
    z = NormalDist().inv_cdf(0.975)
    for p in (low, high):
        assert (share - p) ** 2 == pytest.approx(z * z * p * (1.0 - p) / n, rel=1e-6, abs=1e-14)
    assert low < high


def test_wilsons_interval_by_hand():
    """For 0 of n it is [0, z^2 / (n + z^2)]."""
    z2 = 1.959964**2
    assert study.wilson(0, 10_000) == pytest.approx((0.0, 0.0, z2 / (10_000 + z2)), abs=1e-9)
    assert study.wilson(10, 20) == pytest.approx((0.5, 0.299298, 0.700702), abs=1e-6)


@pytest.mark.parametrize("q", [0.5, 0.95])
def test_the_interval_of_a_quantile_holds_as_often_as_it_says(q):
    samples = np.random.default_rng(0).random((2000, 300))
    found = [study.quantile(sample, q) for sample in samples]
    holds = np.mean([low <= q <= high for _, low, high in found])
    assert 0.94 <= holds <= 0.985  # ranks are whole numbers, rounded outward
    assert all(low <= value <= high for value, low, high in found)


def test_a_row_of_runs_by_hand():
    table = replace(PATHS, cases=PATHS.cases[:1])
    (job,) = study.jobs(table, 20, SEED)
    runs = simulate(job.controller, job.start, time_limit=12.0)
    row = study.row(job.name, runs, job.shortest, 0.22)
    home = runs.arrived
    assert 0 < home.sum() < 20
    assert row.arrived.value == home.mean()
    assert row.neither.value == pytest.approx(1.0 - home.mean())
    driven = runs.path_length[home] / job.shortest[home]
    assert row.driven.median.value == pytest.approx(np.median(driven))
    assert row.driven.largest == driven.max()
    slowness = runs.time[home] / (job.shortest[home] / 0.22)
    assert row.time.p95.value == pytest.approx(np.quantile(slowness, 0.95))
    assert row.min_clearance == runs.min_clearance.min()


def test_eq_20_corrected_is_what_is_driven_and_as_printed_it_is_not():
    for rho in study.erratum():
        assert rho.corrected == pytest.approx(rho.simulated, abs=1e-4)
        assert rho.printed < 0.9 * rho.corrected


# The command


def test_the_command_prints_tables_and_writes_all_numbers(tmp_path):
    out, picture = tmp_path / "new" / "study.json", tmp_path / "eq22.png"
    result = gradnav("study", "--starts", 20, "--seed", 7, "--json", out, "--plot", picture)
    assert result.returncode == OK, result.stderr
    report = json.loads(out.read_text())
    assert (report["starts"], report["seed"], report["confidence"]) == (20, 7, 0.95)
    for table in study.TABLES:
        assert table.title in result.stdout
        assert [tuple(row[c] for c in table.columns) for row in report[table.key]] == [
            case.name for case in table.cases
        ]
        for row in report[table.key]:
            assert row["arrived"].keys() == {"value", "low", "high"}
            total = sum(row[key]["value"] for key in ("arrived", "collided", "neither"))
            assert total == pytest.approx(1.0)
            for key in ("driven", "to_goal", "time"):
                assert row[key].keys() == {"median", "p95", "largest"}
    assert [row["k"] for row in report["steepness"]] == [8.0, 20.0, 40.0]
    assert report["erratum"][0]["corrected"] == 2.0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_without_an_arrival_there_are_no_ratios():
    table = replace(PATHS, cases=PATHS.cases[:1])
    (job,) = study.jobs(table, 5, SEED)
    runs = simulate(job.controller, job.start, time_limit=1.0)
    entry = command.entry(table, study.row(job.name, runs, job.shortest, 0.22))
    assert entry["neither"]["value"] == 1.0
    assert entry["to_goal"]["median"]["value"] is entry["to_goal"]["largest"] is None
    assert json.dumps(entry, allow_nan=False)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--starts", "0"], ["--starts: 0"]),
        (["--seed", "-1"], ["--seed: -1"]),
        (["--json", "/proc/none/x.json"], ["/proc/none/x.json"]),
        (["--plot", "picture.xyz"], ["picture.xyz"]),
    ],
)
def test_wrong_input_is_refused_before_anything_is_driven(arguments, words):
    result = gradnav("study", *arguments)
    assert_refused(result, *words)
    assert result.stdout == ""

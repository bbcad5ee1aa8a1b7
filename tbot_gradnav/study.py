# SPDX-License-Identifier: Apache-2.0
"""The laws compared in the arena of nine obstacles, over thousands of seeded random starts.

Shares come with Wilson's confidence interval, quantiles with that of their order statistics.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from multiprocessing import get_context
from signal import SIG_IGN, SIGINT, signal
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav import closed_form, parameter_file, shipped
from tbot_gradnav.controller import Controller
from tbot_gradnav.laws import Law, State, radial
from tbot_gradnav.potentials import NavigationFunction
from tbot_gradnav.settings import Settings
from tbot_gradnav.shortest_path import shortest_paths
from tbot_gradnav.simulate import Runs, random_starts, simulate
from tbot_gradnav.unicycle import Floats, Pose, Twist

Array = NDArray[np.float64]

ARENA = "nine_navigation_function.yaml"  # psi in a disc of 4.5 m; U is studied without the disc
CONFIDENCE = 0.95
TIME_LIMIT = 400.0  # [s]

# Parameters over the arena's


def repulsive(k_r: float, d_0: float, goal_scaled: bool) -> dict[str, object]:
    """Return the parameters of U with these gains and no outer wall."""
    return {
        "potential": "attractive_repulsive",
        "attractive_repulsive.k_repulsive": k_r,
        "attractive_repulsive.influence_distance": d_0,
        "attractive_repulsive.goal_scaled": goal_scaled,
        "boundary.radius": 0.0,
    }


FREE: dict[str, object] = {"limits.wheel": math.inf, "limits.wheel_floor": 0.0}
POINT: dict[str, object] = {
    "robot_radius": 0.0,
    "auto_reverse": False,
    "speed_shaping": "exponential",
    "k_omega": 1.5,
    "limits.v": 0.22,
    "limits.omega": 2.84,
} | FREE


# Laws that are studied but not offered


def radial_by_gradient(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """Eq. (22) with the gradient's direction for alpha: omega = k_omega (mu/rho) sin beta."""
    return radial(k_v, k_omega, at._replace(cos_alpha=at.cos_gamma, sin_alpha=at.sin_gamma))


def bare_heading(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """`heading` as a formula, with nothing done about the unstable heading."""
    sin_beta = at.sin_theta * at.cos_gamma - at.cos_theta * at.sin_gamma
    return Twist(k_v * at.mu, k_omega * sin_beta)


# What is studied


class Case(NamedTuple):
    """A row: what to call it, parameters over its table's, and the law if it is not theirs."""

    name: tuple[str, ...]
    parameters: Mapping[str, object]
    law: Law | None = None


@dataclass(frozen=True)
class Table:
    """Rows driven from the same starts, which are `beyond` [m] from the goal.

    `columns` say what the words of a row's name are.
    """

    key: str
    title: str
    columns: tuple[str, ...]
    parameters: Mapping[str, object]
    cases: Sequence[Case]
    beyond: float = 0.0

    def settings(self, case: Case | None = None) -> Settings:
        """Return the settings of a case, or of the arena without any. Raises GradnavError."""
        values = parameter_file.read(shipped.parameter_path(ARENA))
        return Settings.of({**values, **self.parameters, **(case.parameters if case else {})})

    def controller(self, case: Case) -> Controller:
        """Return the controller of a case. Raises GradnavError."""
        controller = Controller.of(self.settings(case))
        return replace(controller, law=case.law) if case.law else controller

    def starts(self, n: int, seed: int) -> Pose:
        """Return the n starts of each row."""
        world = self.settings().world
        start = random_starts(world, 2 * n + 20, seed)
        away = np.hypot(start.x - world.goal[0], start.y - world.goal[1]) >= self.beyond
        return Pose(*(np.asarray(component)[away][:n] for component in start))


RADIAL: dict[str, object] = {"law": "radial", "k_omega": 1.0}
LAWS: Sequence[tuple[str, Mapping[str, object], Law | None]] = (
    ("radial: eq. (22) as printed", RADIAL, None),
    ("eq. (22) with gamma for alpha", RADIAL, radial_by_gradient),
    ("heading, the bare formula", {"law": "heading"}, bare_heading),
    ("heading", {"law": "heading"}, None),
    ("descent", {"law": "descent"}, None),
)
FIELDS: Mapping[str, Mapping[str, object]] = {"psi": {}, "U": repulsive(0.01, 0.3, True)}
PATHS: Mapping[str, Mapping[str, object]] = {
    "psi, k = 8": {},
    "psi, k = 15": {"navigation_function.k": 15.0},
    "U, k_r = 0.05, d_0 = 0.6": repulsive(0.05, 0.6, False),
    "U, k_r = 0.002, d_0 = 0.3": repulsive(0.002, 0.3, False),
}
SPEEDS = (
    (0.002, 0.2, "exponential", 1.5),
    (0.002, 0.2, "brake", 1.5),
    (0.002, 0.2, "brake", 3.0),
    (0.002, 0.2, "brake", 6.0),
    (0.01, 0.3, "brake", 3.0),
)

TABLES = (
    Table(
        "laws",
        "Five laws, two potentials (psi, k = 8; U, k_r = 0.01, d_0 = 0.3)",
        ("law", "field"),
        POINT,
        [
            Case((law, field), {**of_law, **of_field}, function)
            for law, of_law, function in LAWS
            for field, of_field in FIELDS.items()
        ],
    ),
    Table(
        "paths",
        "How long descent's paths are (U without the factor rho^2)",
        ("field",),
        POINT,
        [Case((field,), parameters) for field, parameters in PATHS.items()],
        beyond=1.0,
    ),
    Table(
        "times",
        "How long descent takes with a TurtleBot3 (radius 0.105 m)",
        ("field", "shaping", "k_omega", "gear"),
        {},
        [
            Case(
                (f"U, k_r = {k_r:g}, d_0 = {d_0:g}", shaping, f"{k_omega:g}", gear),
                repulsive(k_r, d_0, True)
                | {"speed_shaping": shaping, "k_omega": k_omega, "auto_reverse": auto_reverse},
            )
            for gear, auto_reverse in (("nearer", True), ("forward", False))
            for k_r, d_0, shaping, k_omega in SPEEDS
        ],
        beyond=1.0,
    ),
)


# What comes out


class Estimate(NamedTuple):
    """A value with the ends of its confidence interval; nan where nothing was measured."""

    value: float
    low: float
    high: float


class Spread(NamedTuple):
    """Median, 95th percentile and largest of some values."""

    median: Estimate
    p95: Estimate
    largest: float


@dataclass(frozen=True)
class Row:
    """How the robots of a case fared; ratios are of those that arrived.

    min_clearance [m] is the smallest of all. driven: path until arrival, within the tolerance,
    over the shortest path to the goal; to_goal: the same with the straight rest added, so never
    below 1; time: time until arrival over that of the shortest path at top speed.
    """

    name: tuple[str, ...]
    arrived: Estimate
    collided: Estimate
    neither: Estimate
    min_clearance: float
    driven: Spread
    to_goal: Spread
    time: Spread


def wilson(successes: int, n: int) -> Estimate:
    """Return the share of n that succeeded, with Wilson's interval.

    Its ends are the shares p from which the one observed is z standard deviations away, the
    roots of (successes/n - p)^2 = z^2 p (1 - p) / n. Wilson, J. American Statistical Association
    22(158), 1927.
    """
    share, z2 = successes / n, _z() ** 2
    centre = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = math.sqrt(z2 * (share * (1 - share) + z2 / (4 * n)) / n) / (1 + z2 / n)
    low, high = max(0.0, centre - half), min(1.0, centre + half)
    return Estimate(share, min(low, share), max(high, share))  # share is an end at 0 and at 1


def quantile(values: Array, q: float) -> Estimate:
    """Return a quantile between those order statistics that enclose it whatever is distributed.

    Normal approximation of their binomial ranks; the ends are the extremes where values are few.
    """
    n = values.size
    if n == 0:
        return Estimate(math.nan, math.nan, math.nan)
    half = _z() * math.sqrt(n * q * (1 - q))
    ranks = np.clip([math.floor(n * q - half) - 1, math.ceil(n * q + half)], 0, n - 1)
    low, high = np.sort(values)[ranks]
    return Estimate(float(np.quantile(values, q)), float(low), float(high))


def spread(values: Array) -> Spread:
    """Return median, 95th percentile and largest."""
    largest = float(values.max()) if values.size else math.nan
    return Spread(quantile(values, 0.5), quantile(values, 0.95), largest)


def row(name: tuple[str, ...], runs: Runs, shortest: Array, top_speed: float) -> Row:
    """Return how `runs` fared against shortest paths [m] driven at top speed [m/s]."""
    n, home = runs.time.size, runs.arrived
    arrived, collided = int(home.sum()), int(runs.collided.sum())
    path, left, best = runs.path_length[home], runs.final_distance[home], shortest[home]
    return Row(
        name=name,
        arrived=wilson(arrived, n),
        collided=wilson(collided, n),
        neither=wilson(n - arrived - collided, n),
        min_clearance=float(runs.min_clearance.min()),
        driven=spread(path / best),
        to_goal=spread((path + left) / best),
        time=spread(runs.time[home] * top_speed / best),
    )


# How it is done


class Job(NamedTuple):
    """A row to be measured: its name, the controller, the starts and their shortest paths [m]."""

    name: tuple[str, ...]
    controller: Controller
    start: Pose
    shortest: Array


def jobs(table: Table, n: int, seed: int) -> list[Job]:
    """Return a table's rows to be measured from n starts each. Raises GradnavError."""
    start = table.starts(n, seed)
    shortest = shortest_paths(table.settings().world, start.x, start.y)
    return [Job(case.name, table.controller(case), start, shortest) for case in table.cases]


def measure(job: Job) -> Row:
    """Drive the robots of a row."""
    runs = simulate(job.controller, job.start, time_limit=TIME_LIMIT)
    return row(job.name, runs, job.shortest, job.controller.settings.limits.v)


def study(
    n: int, seed: int, tables: Sequence[Table] = TABLES
) -> Iterator[tuple[Table, Sequence[Row]]]:
    """Yield each table with its rows of n starts, measured on all processors at once.

    Raises GradnavError.
    """
    todo = [job for table in tables for job in jobs(table, n, seed)]
    pool = ProcessPoolExecutor(
        mp_context=get_context("spawn"), initializer=signal, initargs=(SIGINT, SIG_IGN)
    )
    try:
        rows = pool.map(measure, todo)
        for table in tables:
            yield table, list(islice(rows, len(table.cases)))
    finally:
        pool.shutdown(cancel_futures=True)


# Numbers that need no thousands of robots


class Steepness(NamedTuple):
    """Quantiles of the norm of grad psi [1/m] for a k."""

    k: float
    p05: float
    median: float
    p95: float


def steepness(n: int, seed: int) -> list[Steepness]:
    """Return how steep psi is at the n starts of the first table, by k."""
    world, start = TABLES[0].settings().world, TABLES[0].starts(n, seed)
    found = []
    for k in (8.0, 20.0, 40.0):
        norm = NavigationFunction(world, k)(start.x, start.y).polar[0]
        p05, median, p95 = (float(value) for value in np.quantile(norm, (0.05, 0.5, 0.95)))
        found.append(Steepness(k, p05, median, p95))
    return found


class Rho(NamedTuple):
    """Distance to the goal [m] at t [s]: eq. (20) as printed, corrected, and simulated."""

    t: float
    printed: float
    corrected: float
    simulated: float


def erratum() -> list[Rho]:
    """Return rho(t) from rho_0 = 2 m, beta_0 = 2 rad under the position law, by eq. (20).

    k_v = -0.1, k_omega = -0.5; the simulation holds a command for a millisecond.
    """
    k_v, k_omega, rho_0, beta_0, dt = -0.1, -0.5, 2.0, 2.0, 1e-3
    values: dict[str, object] = {"law": "position", "potential": "quadratic", "goal": (0.0, 0.0)}
    values |= {"k_v": k_v, "k_omega": k_omega, "auto_reverse": False} | FREE
    values |= {"limits.v": math.inf, "limits.omega": math.inf}
    start = Pose.at(*np.array([[rho_0], [0.0], [beta_0]]))
    runs = simulate(Controller.of(Settings.of(values)), start, dt, 20.0, record=True)
    found = []
    for t in (0.0, 5.0, 10.0, 15.0, 20.0):
        printed = closed_form.rho_as_printed(t, rho_0, beta_0, k_v, k_omega)
        corrected = closed_form.rho(t, rho_0, beta_0, k_v, k_omega)
        x, y, _ = runs.recorded[:, round(t / dt), 0]
        found.append(Rho(t, float(printed), float(corrected), math.hypot(x, y)))
    return found


def _z() -> float:
    return NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)

# SPDX-License-Identifier: Apache-2.0
"""How well controllers drive: the same random worlds and starts, plant, limits and period for all.

See `worlds` for how they are drawn. The plant is the package's unicycle along exact arcs under a
TurtleBot3's joint limits, commanded at 20 Hz. Paths count until arrival within the tolerance of
0.05 m, and the straight rest to the goal is added, so no ratio is below 1.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from bench import worlds
from tbot_gradnav.certify import landscape, on_lattice
from tbot_gradnav.controller import Controller
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.potentials import Map
from tbot_gradnav.settings import Settings
from tbot_gradnav.shortest_path import shortest_paths
from tbot_gradnav.simulate import Runs, simulate
from tbot_gradnav.unicycle import Pose

TIME_LIMIT = 100.0  # [s]; the longest shortest path takes some 25
CELL = 0.05  # [m] of the map that the potential map is given: empty, the obstacles come on top

OURS: Mapping[str, Mapping[str, object]] = {
    "U": {
        "potential": "attractive_repulsive",
        "attractive_repulsive.k_repulsive": 0.002,
        "attractive_repulsive.influence_distance": 0.2,
        "k_omega": 6.0,
    },
    "psi, smallest certified k": {
        "potential": "navigation_function",
        "navigation_function.k": 0.0,
        "k_omega": 6.0,
    },
    "psi, k = 25": {
        "potential": "navigation_function",
        "navigation_function.k": 25.0,
        "k_omega": 6.0,
    },
    "map": {"potential": "map", "map.clearance": 0.1, "k_omega": 6.0},
}
PAPER = "paper's eq. (22)"
RVO: Mapping[str, float] = {"IR-SIM rvo": 1.0, "IR-SIM rvo, robot 20 % larger": 1.2}
THEIRS = (*RVO, "dynamic window", PAPER)
NAMES = (*OURS, *THEIRS)


class Drives(NamedTuple):
    """How all robots fared under one controller; arrays over worlds times starts.

    jerk: mean |d omega/dt| [rad/s^2]; path and time ratios are nan where a robot did not arrive;
    certified: whether `gradnav check` finds no spurious minimum.
    """

    arrived: np.ndarray
    collided: np.ndarray
    path: np.ndarray
    time: np.ndarray
    jerk: np.ndarray
    clearance: np.ndarray
    certified: np.ndarray


def controller(name: str, values: Mapping[str, object]) -> tuple[Controller, bool]:
    """Return a controller in a world, and whether the world is certified for it."""
    if name in OURS:
        empty = Occupancy(np.zeros((200, 200), dtype=np.int8), CELL, -5.0, -5.0)
        topic_map = empty if name == "map" else None
        settings = Settings.of({**values, **OURS[name]}, topic_map=topic_map)
        ours = Controller.of(settings)
        return ours, certified(ours)
    paper: dict[str, object] = {"law": "radial", "k_omega": 1.0, "auto_reverse": False}
    paper |= {"potential": "navigation_function", "navigation_function.k": 8.0}
    settings = Settings.of({**values, **paper})
    as_ours = Controller.of(settings)
    if name == "dynamic window":
        from bench.dynamic_window import DynamicWindow

        return DynamicWindow(settings, as_ours.potential, as_ours.law), False
    if name in RVO:
        from bench.reciprocal import Reciprocal

        return Reciprocal(settings, as_ours.potential, as_ours.law, RVO[name]), False
    return as_ours, False


def certified(control: Controller) -> bool:
    """Return whether the goal is the only minimum."""
    potential = control.potential
    found = on_lattice(potential) if isinstance(potential, Map) else landscape(potential)
    return found.goal_is_minimum and not found.spurious


def drive(job: tuple[str, int]) -> Drives:
    """Return how the starts of one world fared."""
    name, seed = job
    values = worlds.parameters(seed)
    control, sound = controller(name, values)
    start = worlds.starts(seed, values)
    shortest = shortest_paths(control.settings.world, start.x, start.y)
    apart = list(_each(start)) if name in RVO else [start]  # rvo knows its velocity
    runs = [simulate(control, some, time_limit=TIME_LIMIT, record=True) for some in apart]
    return measured(runs, shortest, control.settings.limits.v, sound)


def measured(runs: Sequence[Runs], shortest: np.ndarray, top_speed: float, sound: bool) -> Drives:
    """Return what came of runs, one after another."""
    home, collided, length, left, time, clearance = (
        np.concatenate([getattr(run, name) for run in runs])
        for name in (
            *("arrived", "collided", "path_length"),
            *("final_distance", "time", "min_clearance"),
        )
    )
    return Drives(
        home,
        collided,
        np.where(home, (length + left) / shortest, np.nan),
        np.where(home, time * top_speed / shortest, np.nan),
        np.concatenate([_jerk(run) for run in runs]),
        clearance,
        np.full(home.size, sound),
    )


def _jerk(run: Runs) -> np.ndarray:
    """Return the mean |d omega/dt| [rad/s^2] of each robot until it was done."""
    omega = np.diff(np.unwrap(run.recorded[2], axis=0), axis=0) / run.dt
    steps = np.round(run.time / run.dt)
    driving = np.arange(1, omega.shape[0])[:, None] < steps
    change = np.abs(np.diff(omega, axis=0)) * driving / run.dt
    mean: np.ndarray = change.sum(axis=0) / np.maximum(driving.sum(axis=0), 1)
    return mean


def _each(start: Pose) -> Iterator[Pose]:
    for i in range(np.size(start.x)):
        yield Pose(*(np.asarray(part)[i : i + 1] for part in start))


@dataclass(frozen=True)
class Row:
    """A controller's line of the table."""

    drives: int
    arrived: float
    collided: float
    path_ratio_median: float
    path_ratio_p95: float
    time_ratio_median: float
    time_ratio_p95: float
    mean_angular_acceleration: float
    smallest_clearance: float

    @classmethod
    def of(cls, drives: Drives) -> "Row":
        """Return the row of some drives."""
        path, time = (part[~np.isnan(part)] for part in (drives.path, drives.time))
        return cls(
            int(drives.arrived.size),
            float(np.mean(drives.arrived)),
            float(np.mean(drives.collided)),
            *(_quantile(path, q) for q in (0.5, 0.95)),
            *(_quantile(time, q) for q in (0.5, 0.95)),
            float(np.mean(drives.jerk)),
            float(np.min(drives.clearance)),
        )


def _quantile(values: np.ndarray, q: float) -> float:
    return float(np.quantile(values, q)) if values.size else float("nan")


def measure(
    names: Sequence[str] = NAMES, n: int = worlds.WORLDS, first_seed: int = 0
) -> dict[str, dict[str, Any]]:
    """Return each controller's row over all worlds and, of ours, over those that are certified."""
    jobs = [(name, first_seed + i) for name in names for i in range(n)]
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        found = list(pool.map(drive, jobs, chunksize=5))
    table: dict[str, dict[str, Any]] = {}
    for i, name in enumerate(names):
        drives = Drives(*(np.concatenate(p) for p in zip(*found[i * n : (i + 1) * n], strict=True)))
        table[name] = {"all": Row.of(drives)}
        if drives.certified.any():
            some = Drives(*(part[drives.certified] for part in drives))
            table[name]["certified"] = Row.of(some)
    return table

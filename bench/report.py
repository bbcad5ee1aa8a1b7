# SPDX-License-Identifier: Apache-2.0
"""The benchmarks' results in words and in JSON.

A figure of several runs is their median; the spread that is stated with it is smallest to largest.
"""

import dataclasses
import datetime
import os
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from bench.latency import RATES, Latency, Ratios
from bench.stepping import BATCHES, AgainstSolver
from bench.worlds import STARTS

PACKAGES = ("numpy", "scipy", "ir-sim", "ros-jazzy-rclpy", "scikit-fmm")
WHERE = Path("/proc/cpuinfo")


@dataclass
class Results:
    """What was measured; a list has an entry a run."""

    latency: list[Latency] = field(default_factory=list)
    batches: list[dict[str, dict[int, float]]] = field(default_factory=list)
    irsim: list[dict[int, float]] = field(default_factory=list)
    solver: list[dict[int, AgainstSolver]] = field(default_factory=list)
    quality: dict[str, dict[str, Any]] = field(default_factory=dict)

    def worst(self, what: str) -> list[float]:
        """Return each run's largest ratio to the relay, over rates and potentials."""
        return [
            max(
                getattr(r, what) for by_name in run.against_relay.values() for r in by_name.values()
            )
            for run in self.latency
        ]

    def thousand(self) -> list[float]:
        """Return each run's cost of a message with 1,000 obstacles over that with 9, the worse."""
        return [max(r.cpu for r in run.thousand.values()) for run in self.latency]

    def best_batch(self) -> tuple[str, int]:
        """Return the potential and the batch with the most robot-steps per second."""
        median = {
            (name, n): float(np.median([run[name][n] for run in self.batches]))
            for name in self.batches[0]
            for n in BATCHES
        }
        return max(median, key=lambda key: median[key])

    def best(self) -> list[float]:
        """Return each run's robot-steps per second at the best batch."""
        name, n = self.best_batch()
        return [run[name][n] for run in self.batches]

    def against_irsim(self, n: int) -> list[float]:
        """Return each run's robot-steps per second over IR-SIM's, n robots both."""
        pairs = zip(self.batches, self.irsim, strict=True)
        return [ours["U"][n] / theirs[n] for ours, theirs in pairs]

    def against_solver(self, n: int) -> list[float]:
        """Return each run's time of solve_ivp over ours, n robots at once."""
        return [run[n].ratio for run in self.solver]


def as_json(results: Results) -> dict[str, Any]:
    """Return what results.json holds."""
    name, n = results.best_batch()
    figures: dict[str, list[float]] = {
        "latency_median_ratio": results.worst("median"),
        "latency_p99_ratio": results.worst("p99"),
        "cpu_ratio": results.worst("cpu"),
        "latency_1000_obstacles_ratio": results.thousand(),
        "sim_steps_per_second": results.best(),
        "sim_vs_irsim_ratio": results.against_irsim(100),
        "sim_vs_irsim_one_robot_ratio": results.against_irsim(1),
        "sim_vs_solve_ivp_ratio": results.against_solver(1000),
        "sim_vs_solve_ivp_one_robot_ratio": results.against_solver(1),
    }
    found: dict[str, Any] = {key: float(np.median(values)) for key, values in figures.items()}
    found["quality"] = {key: _row(rows["all"]) for key, rows in results.quality.items()}
    found["quality_certified"] = {
        key: _row(rows["certified"]) for key, rows in results.quality.items() if "certified" in rows
    }
    found["sim_best_batch"] = {"potential": name, "robots": n}
    found["runs"] = figures
    found["latency"] = [dataclasses.asdict(run) for run in results.latency]
    found["batches"] = results.batches
    found["machine"] = machine()
    return found


def as_text(results: Results) -> str:
    """Return what results.md holds."""
    parts = [
        "# Benchmarks",
        "Written by `make bench`; [README.md](README.md) says how each figure is taken.",
        "\n".join(f"- {key}: {value}" for key, value in machine().items()),
        *_latency(results),
        *_stepping(results),
        *_quality(results),
    ]
    return "\n\n".join(parts) + "\n"


def machine() -> dict[str, str]:
    """Return what was measured on, and when."""
    lines = WHERE.read_text(encoding="utf-8").splitlines() if WHERE.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": f"{models[0] if models else platform.processor()}, {os.cpu_count()} cores",
        "system": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "packages": ", ".join(f"{p} {v}" for p in PACKAGES if (v := _version(p))),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "load at the end": f"{os.getloadavg()[1]:.1f} processes in the last five minutes",
    }


def _latency(results: Results) -> list[str]:
    rows = [
        [f"{rate:g}", name, *_ratios(results, lambda r: r.against_relay, rate, name)]
        for rate in RATES
        for name in results.latency[0].against_relay[rate]
    ]
    many = [
        [f"{rate:g}", "1,000 obstacles over 9", *_ratios(results, lambda r: r.thousand, rate)]
        for rate in RATES
    ]
    absolute = [
        [f"{rate:g}", name, *(f"{value:.2f}" for value in _floor(results, rate, name))]
        for rate in RATES
        for name in results.latency[0].absolute[rate]
    ]
    head = ["rate [Hz]", "navigator", "median", "99th percentile", "CPU per message"]
    return [
        "## Latency and cost of the node",
        "Odometry to command over DDS, over a bare relay's. Wanted: 1.10, 1.25, 1.30.",
        _table(head, rows),
        "Over the same navigator with 9 obstacles. Wanted: 1.5.",
        _table(head, many),
        "In milliseconds, median of the runs:",
        _table(["rate [Hz]", "process", *head[2:]], absolute),
    ]


def _ratios(
    results: Results, of: Callable[[Latency], Any], rate: float, name: str = ""
) -> list[str]:
    found: list[Ratios] = [
        of(run)[rate][name] if name else of(run)[rate] for run in results.latency
    ]
    return [_spread(values) for values in zip(*found, strict=True)]


def _floor(results: Results, rate: float, name: str) -> Sequence[float]:
    medians: Sequence[float] = np.median(
        [run.absolute[rate][name] for run in results.latency], axis=0
    ).tolist()
    return medians


def _stepping(results: Results) -> list[str]:
    rows = [
        [
            f"{n:,}",
            *(_spread([run[name][n] / 1e6 for run in results.batches]) for name in ("psi", "U")),
        ]
        for n in BATCHES
    ]
    against = [
        [f"IR-SIM, robots that dash: {n}", _spread(results.against_irsim(n)), ""]
        for n in results.irsim[0]
    ]
    for n, solver in results.solver[0].items():
        how = f"errors {1e3 * solver.error:.1f} and {1e3 * solver.solver_error:.1f} mm"
        name = f"solve_ivp (RK45, rtol {solver.rtol:.1g}), robots at once: {n}"
        against.append([name, _spread(results.against_solver(n)), how])
    return [
        "## Simulation",
        "Millions of robot-steps per second on one core, nine obstacles. Wanted: 5 at the best.",
        _table(["robots", "psi", "U"], rows),
        "How many times as fast ours (U) is:",
        _table(["than", "ratio", "at equal accuracy"], against),
    ]


def _quality(results: Results) -> list[str]:
    head = ["controller", "worlds", "drives", "arrived", "collided", "path, p95", "time, p95"]
    head += ["mean d omega/dt", "smallest clearance [m]"]
    rows = [
        [
            *(name, which, str(row.drives), f"{row.arrived:.1%}", f"{row.collided:.1%}"),
            f"{row.path_ratio_median:.3f}, {row.path_ratio_p95:.3f}",
            f"{row.time_ratio_median:.3f}, {row.time_ratio_p95:.3f}",
            *(f"{row.mean_angular_acceleration:.2f}", f"{row.smallest_clearance:.3f}"),
        ]
        for name, by_worlds in results.quality.items()
        for which, row in by_worlds.items()
        if which == "all" or row.drives < by_worlds["all"].drives
    ]
    return [
        "## Quality",
        f"Random worlds with {STARTS} starts each; path over the shortest path, time over shortest "
        "path ÷ top speed, median and 95th percentile. Wanted of ours: 1.02 and 1.06 in the "
        "median. All is seeded, so measured once. "
        f"Certified worlds: {_certified(results)}.",
        _table(head, rows),
    ]


def _certified(results: Results) -> str:
    shares = {
        name: rows["certified"].drives / rows["all"].drives
        for name, rows in results.quality.items()
        if "certified" in rows
    }
    return ", ".join(f"{share:.0%} for {name}" for name, share in shares.items())


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _spread(values: Sequence[float], digits: int = 2) -> str:
    low, middle, high = (f"{f(values):.{digits}f}" for f in (min, np.median, max))
    return middle if low == high else f"{middle} ({low}–{high})"


def _row(row: Any) -> dict[str, Any]:
    return {k: None if v != v else v for k, v in dataclasses.asdict(row).items()}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None

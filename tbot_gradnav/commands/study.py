# SPDX-License-Identifier: Apache-2.0
"""gradnav study: the laws compared over thousands of random starts."""

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav import plots, study
from tbot_gradnav.controller import Controller
from tbot_gradnav.files import written_whole
from tbot_gradnav.parameters import Integer
from tbot_gradnav.simulate import simulate
from tbot_gradnav.study import Estimate, Row, Spread, Table
from tbot_gradnav.unicycle import Pose

SHOWN = {  # columns of numbers; what is not here is in the JSON
    "laws": ("arrived", "collided", "neither", "min_clearance", "to_goal"),
    "paths": ("arrived", "min_clearance", "driven", "to_goal"),
    "times": ("arrived", "min_clearance", "time", "driven", "to_goal"),
}
HEADS = {
    "arrived": "arrived [%]",
    "collided": "collided [%]",
    "neither": "neither [%]",
    "min_clearance": "clearance [m]",
    "time": "time",
    "driven": "path",
    "to_goal": "path to the goal",
}
PICTURED = (0.5, 3.2, 0.1)  # x, y [m], yaw [rad]
PANELS = {  # title, and where to write "descent"
    "psi": ("navigation function ψ, k = 8", (-0.08, 1.35)),
    "U": ("attractive-repulsive potential U", (1.13, 1.15)),
}
LABELS = {
    "eq. (22) as printed": (1.65, 3.35),
    "collision": (2.55, 2.75),
    "the circle of eq. (30)": (-1.13, 0.02),
    "start": (0.2, 3.45),
    "goal": (-0.2, -0.28),
}
BLUE = "#0072b2"  # Okabe-Ito
DASHED: dict[str, Any] = {"color": "black", "ls": (0, (4, 4)), "lw": 1.2, "zorder": 4}
WORDS: dict[str, Any] = {
    "ha": "center",
    "va": "center",
    "zorder": 9,
    "bbox": {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75},
}
CRASH: dict[str, Any] = {"marker": "X", "ms": 15, "color": "white", "mec": "black", "zorder": 8}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument(
        "--starts", type=int, default=10_000, metavar="N", help="random starts a row (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the starts (%(default)s)")
    parser.add_argument("--json", metavar="OUT", help="write all numbers")
    parser.add_argument(
        "--plot", type=plots.picture, metavar="PNG", help="draw why eq. (22) as printed collides"
    )


def run(options: argparse.Namespace) -> int:
    """Study; 0 when done."""
    n = Integer("", at_least=1).check("--starts", options.starts)
    seed = Integer("").check("--seed", options.seed)
    if options.plot:
        _plot(options.plot)
    with written_whole(options.json) if options.json else nullcontext() as path:
        report = _studied(n, seed)
        if path:
            path.write_text(json.dumps(report, indent=1, allow_nan=False) + "\n")
    return 0


def _studied(n: int, seed: int) -> dict[str, Any]:
    """Print all tables and return them for the JSON."""
    print(f"{n} random starts a row, seed {seed}; in brackets 95 % confidence intervals;")
    print("path and time are ratios to the shortest path: median, 95th percentile, largest")
    report: dict[str, Any] = {"starts": n, "seed": seed, "confidence": study.CONFIDENCE}
    for table, rows in study.study(n, seed):
        _print(table.title, _lines(table, rows))
        report[table.key] = [entry(table, row) for row in rows]
    report["steepness"] = [norm._asdict() for norm in study.steepness(n, seed)]
    report["erratum"] = [rho._asdict() for rho in study.erratum()]
    _print("Norm of the gradient of psi [1/m] at these starts", _numbers(report["steepness"]))
    _print("Eq. (20): rho [m] over t [s] of the position law", _numbers(report["erratum"]))
    return report


# For machines


def entry(table: Table, row: Row) -> dict[str, Any]:
    """Return a row as the words of its name and its numbers, null where there is none."""
    numbers = {key: _plain(value) for key, value in vars(row).items() if key != "name"}
    return dict(zip(table.columns, row.name, strict=True)) | numbers


def _plain(value: float | Estimate | Spread) -> Any:
    if isinstance(value, tuple):
        return {key: _plain(part) for key, part in value._asdict().items()}
    return value if math.isfinite(value) else None


# For people


def _print(title: str, lines: Sequence[Sequence[str]]) -> None:
    """Print lines of words in columns: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    print(f"\n{title}")
    for first, *others in lines:
        right = (word.rjust(width) for word, width in zip(others, widths[1:], strict=True))
        print("  ".join([first.ljust(widths[0]), *right]), flush=True)


def _lines(table: Table, rows: Sequence[Row]) -> list[list[str]]:
    shown = SHOWN[table.key]
    heads = [*table.columns, *(HEADS[key] for key in shown)]
    return [heads, *([*row.name, *(_cell(getattr(row, key)) for key in shown)] for row in rows)]


def _cell(value: float | Estimate | Spread) -> str:
    if isinstance(value, Estimate):
        return "{:.2f} [{:.2f}, {:.2f}]".format(*(100.0 * part for part in value))
    if isinstance(value, Spread):
        return f"{value.median.value:.3f} {value.p95.value:6.3f} {value.largest:7.3f}"
    return f"{value:.3f}"


def _numbers(rows: Sequence[Mapping[str, float]]) -> list[list[str]]:
    return [list(rows[0]), *([f"{number:.4g}" for number in row.values()] for row in rows)]


# The picture


def _plot(path: str) -> None:
    """Draw one start over psi and over U: the circle of eq. (30), and what is driven."""
    table = study.TABLES[0]
    cases = {case.name: case for case in table.cases}
    with plots.figure(path, 11.0, 5.85, ncols=2, sharex=True, sharey=True) as axes:
        for ax, (field, (title, at)) in zip(axes, PANELS.items(), strict=True):
            controller = table.controller(cases["descent", field])
            plots.draw_potential(ax, controller.potential)
            plots.draw_world(ax, controller.settings.world)
            _draw_descent(ax, controller)
            _draw_circle(ax, table.controller(cases["radial: eq. (22) as printed", field]))
            for text, place in {**LABELS, "descent": at}.items():
                ax.annotate(text, place, **WORDS)
            ax.set_title(title)
        axes[0].set(xlim=(-1.9, 3.4), ylim=(-0.75, 4.0))
        axes[1].set_ylabel("")
        axes[0].figure.suptitle(
            "Eq. (22) as printed: the same circle, and the same collision, whatever the potential"
        )


def _draw_circle(ax: Any, controller: Controller) -> None:
    """Draw the circle of eq. (30), what of it is driven, and the collision."""
    x, y, theta = PICTURED
    left = x * math.sin(theta) - y * math.cos(theta)  # rho sin beta
    radius = (x * x + y * y) / (2.0 * left)
    c_x, c_y = x - radius * math.sin(theta), y + radius * math.cos(theta)
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.plot(
        c_x + radius * np.cos(turn),
        c_y + radius * np.sin(turn),
        path_effects=plots.casing(),
        **DASHED,
    )
    path = _driven(controller)
    plots.draw_path(ax, path, arrows=3, lw=2.2, path_effects=plots.casing())
    ax.plot(*path[:2, -1], **CRASH)


def _draw_descent(ax: Any, controller: Controller) -> None:
    path = _driven(controller)
    plots.draw_path(ax, path, arrows=4, color=BLUE, lw=2.2, ls="--", path_effects=plots.casing())


def _driven(controller: Controller) -> NDArray[np.float64]:
    """Return x, y, theta of the pictured run, shape (3, steps)."""
    runs = simulate(controller, Pose.at(*np.array(PICTURED)[:, None]), record=True)
    return runs.recorded[:, :, 0]

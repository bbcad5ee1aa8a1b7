# SPDX-License-Identifier: Apache-2.0
"""gradnav simulate: one robot or thousands in closed loop, without ROS."""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from tbot_gradnav import parameter_file, plots, shipped
from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.files import write_json
from tbot_gradnav.parameters import Integer, Number, Numbers
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import Runs, random_starts, simulate
from tbot_gradnav.unicycle import Pose

PLOTTED = 60  # paths in a picture, at most


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument("file", help="parameter file")
    parser.add_argument(
        "--start",
        nargs=3,
        action="append",
        default=[],
        metavar=("X", "Y", "YAW"),
        help="start pose [m, m, rad]; may be repeated; default: the file's",
    )
    parser.add_argument("--random", type=int, metavar="N", help="N random starts")
    parser.add_argument("--seed", type=int, default=0, help="seed of --random (%(default)s)")
    parser.add_argument("--law", help="another law than the file's; radial sets k_omega = 2 k_v")
    parser.add_argument("--potential", help="another potential than the file's")
    parser.add_argument("--json", metavar="OUT", help="write what became of each robot")
    parser.add_argument(
        "--plot", type=plots.picture, metavar="PNG", help="draw the paths over the potential"
    )


def run(options: argparse.Namespace) -> int:
    """Simulate; 0 if every robot arrived without a collision."""
    settings = read_settings(options)
    controller = Controller.of(settings)
    start = _starts(options, settings)
    if settings.waypoints:
        print("waypoints: only the navigator passes them; these go to the goal", file=sys.stderr)
    runs = simulate(controller, start)
    print(summary(runs))
    if options.json:
        write_json(options.json, report(settings, options.seed, runs))
    if options.plot:
        few = Pose(*(component[:PLOTTED] for component in np.array(start)))
        _plot(options.plot, controller, simulate(controller, few, record=True))
    return 0 if bool(runs.arrived.all()) else 1


def read_settings(options: argparse.Namespace) -> Settings:
    """Return the settings of the file with what the command line overrides.

    A law radial asked for on the command line brings the k_omega = 2 k_v of Theorem IV.5 along.
    """
    overrides = {
        name: value
        for name in ("law", "potential")
        if (value := getattr(options, name)) is not None
    }
    if options.law == "radial":
        k_v = parameter_file.read(shipped.parameter_path(options.file)).get("k_v", Settings.k_v)
        overrides["k_omega"] = 2.0 * Number("").check("k_v", k_v)
    return shipped.configuration(options.file, overrides).settings


def summary(runs: Runs) -> str:
    """Return how the robots fared, in a line or two."""
    n, arrived = len(runs.time), runs.arrived
    text = f"{arrived.sum()} of {n} arrived, {runs.collided.sum()} collided"
    text += f", {n - arrived.sum() - runs.collided.sum()} neither"
    if arrived.any():
        text += (
            f"\ntime to arrive: median {np.median(runs.time[arrived]):.1f} s, "
            f"longest {runs.time[arrived].max():.1f} s"
        )
    clearance = runs.min_clearance.min()
    return text + (f"\nsmallest clearance {clearance:.3f} m" if np.isfinite(clearance) else "")


def report(settings: Settings, seed: int, runs: Runs) -> dict[str, Any]:
    """Return the JSON of the runs; an infinite clearance is null."""
    start = np.array([runs.start.x, runs.start.y, runs.start.theta]).T
    clearance = [value if np.isfinite(value) else None for value in runs.min_clearance.tolist()]
    columns = {
        "start": start.tolist(),
        "arrived": runs.arrived.tolist(),
        "collided": runs.collided.tolist(),
        "time": runs.time.tolist(),
        "path_length": runs.path_length.tolist(),
        "min_clearance": clearance,
        "final_distance": runs.final_distance.tolist(),
    }
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return {"law": settings.law, "potential": settings.potential, "seed": seed, "runs": rows}


def _starts(options: argparse.Namespace, settings: Settings) -> Pose:
    if options.random is not None:
        if options.start:
            raise GradnavError("--start and --random exclude each other")
        Integer("", at_least=1).check("--random", options.random)
        Integer("").check("--seed", options.seed)
        return random_starts(
            settings.world, options.random, options.seed, settings.chosen_potential
        )
    given = [_start(words, settings) for words in options.start] or settings.all_starts
    x, y, yaw = np.array(given).T
    return Pose.at(x, y, yaw)


def _start(words: list[str], settings: Settings) -> tuple[float, ...]:
    numbers = Numbers("", "m, m, rad", (3,), poses=True)
    try:
        start = numbers.check("--start", [float(word) for word in words])
    except ValueError as error:
        raise ParameterError("--start", words, numbers.allowed()) from error
    settings.world.refuse_occupied("--start", *start[:2])
    settings.refuse_unreachable(*start[:2])
    return start


def _plot(path: str | Path, controller: Controller, runs: Runs) -> None:
    with plots.figure(path, height=plots.height(controller.settings.world)) as ax:
        plots.draw_potential(ax, controller.potential)
        plots.draw_world(ax, controller.settings.world, controller.settings.goal_heading)
        n = len(runs.time)
        for i in range(n):
            last = round(runs.time[i] / runs.dt) + 1
            plots.draw_path(
                ax,
                runs.recorded[:, :last, i],
                arrows=12 if n <= 12 else 2,
                lw=1.8 if n <= 12 else 0.8,
            )
            if not runs.arrived[i]:
                ax.plot(*runs.recorded[:2, last - 1, i], "x", color="black", ms=8, mew=2, zorder=7)
        settings = controller.settings
        rest = "" if runs.arrived.all() else "; the others end at a cross"
        ax.set_title(
            f"law {settings.law}, potential {settings.potential}\n"
            f"{runs.arrived.sum()} of the {n} drawn arrived{rest}"
        )

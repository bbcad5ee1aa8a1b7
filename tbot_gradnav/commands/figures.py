# SPDX-License-Identifier: Apache-2.0
"""gradnav figures: the paper's figures 2-8."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from tbot_gradnav import figures, parameter_file
from tbot_gradnav.figures import Group
from tbot_gradnav.options import Configuration

DRIVEN = ("7a", "7b")  # over ROS; from both, Fig. 8
REMARK = " over ROS"  # of a title


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument(
        "--out", default="gradnav_figures", metavar="DIR", help="for the pictures (%(default)s)"
    )
    parser.add_argument(
        "--ros",
        action="store_true",
        help="draw 7a, 7b and 8 from runs of navigator and fake robot too",
    )


def run(options: argparse.Namespace) -> int:
    """Draw; 0 if every run arrived without a collision."""
    out, complete = Path(options.out), True
    for name, remark, groups in _runs(options.ros):
        path = out / f"figure_{name}{'_ros' if remark else ''}.png"
        figures.draw(name, groups, path, remark)
        failures = figures.failed(groups)
        print(f"{path}: {failures or 'all arrived'}", flush=True)
        complete = complete and not failures
    return 0 if complete else 1


def _runs(ros: bool) -> Iterator[tuple[str, str, Sequence[Group]]]:
    """Yield name, remark and groups of runs of each picture; first those that need ROS."""
    if ros:
        driven = [_driven(name) for name in DRIVEN]
        for name, group in zip(DRIVEN, driven, strict=True):
            yield name, REMARK, [group]
        yield "8", REMARK, driven
    for name in figures.PICTURES:
        yield name, "", figures.drive(name)


def _driven(name: str) -> Group:
    """Drive the robot of a figure with both nodes. Raises GradnavError."""
    from tbot_gradnav.commands import demo

    settings, path = figures.scenario(name), figures.scenario_path(name)
    demo.keep_to_this_machine()
    observer = demo.watched(path, Configuration.of(parameter_file.read(path)))
    way = np.array([(p.x, p.y, p.theta) for p in observer.path]).T
    outcome = "collided" if observer.collided else "arrived" if observer.arrived else "not arrived"
    t = np.array(observer.times)
    return [figures.run_of(settings, t, way, outcome, settings.initial_pose[2])]

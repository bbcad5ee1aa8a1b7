# SPDX-License-Identifier: Apache-2.0
"""Measure and draw arrivals with an orientation, for docs/pose_goals.md.

usage: python tools/pose_goals.py [--robots N] [--seed S] [--json OUT] [--plot PNG]

N robots in the arena with nine obstacles, each from a random start to a random heading at the goal.
"""

import argparse
import copy
import json
import math
import sys
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav import plots, pose_law
from tbot_gradnav.controller import Controller
from tbot_gradnav.settings import Settings
from tbot_gradnav.shipped import configuration
from tbot_gradnav.simulate import CONTROL_PERIOD, random_starts
from tbot_gradnav.unicycle import Pose, step

FILE = "nine_attractive_repulsive.yaml"
TOLERANCE = 0.02  # [m]
TIME_LIMIT = 120.0  # [s]
Array = NDArray[np.float64]


class Arrivals(NamedTuple):
    """How N robots fared; arrays of N.

    time [s] of arrival, nan for none; distance [m] and off [rad] from the goal's position and
    heading at the end; clearance [m] at the least; grown [m], the most by which the distance to
    the goal ever grew from one control instant to the next inside the ball.
    """

    time: Array
    distance: Array
    off: Array
    clearance: Array
    grown: Array
    paths: Array  # x, y of shape (2, steps, N)


def drive(start: Pose, yaw: Array) -> Arrivals:
    """Drive a robot from each start to the goal, there to face yaw [rad], all at once."""
    file = configuration(FILE, {"goal": [0.0, 0.0, 0.0], "xy_goal_tolerance": TOLERANCE})
    controller = Controller.of(facing(file.settings, yaw))
    world, radius = file.settings.world, pose_law.ball(file.settings.world.clearance(0.0, 0.0))
    pose, gear, n = start, controller.gear(start), np.size(start.x)
    time, nearest, grown = np.full(n, np.nan), np.full(n, np.inf), np.zeros(n)
    paths, before = [], np.full(n, np.nan)
    for tick in range(round(TIME_LIMIT / CONTROL_PERIOD)):
        nearest = np.minimum(nearest, world.clearance(pose.x, pose.y))
        distance = np.asarray(controller.distance(pose))
        grown = np.where(before <= radius, np.maximum(grown, distance - before), grown)
        before = distance
        paths.append((pose.x, pose.y))
        home = controller.arrived(pose)
        time = np.where(home & np.isnan(time), tick * CONTROL_PERIOD, time)
        if home.all():
            break
        pose = step(pose, controller.command(pose, gear), CONTROL_PERIOD)
    off = np.abs((pose.theta - yaw + math.pi) % (2.0 * math.pi) - math.pi)
    return Arrivals(time, distance, off, nearest, grown, np.moveaxis(np.array(paths), 1, 0))


def facing(settings: Settings, yaw: Array) -> Settings:
    """Return settings whose goal heading is one for each robot: the cached value is replaced."""
    many = copy.copy(settings)
    vars(many)["goal_heading"] = np.cos(yaw), np.sin(yaw)
    return many


def figures(found: Arrivals) -> dict[str, Any]:
    """Return what docs/pose_goals.md says."""
    arrived = ~np.isnan(found.time)
    return {
        "robots": int(found.time.size),
        "arrived": int(arrived.sum()),
        "collided": int((found.clearance < 0.0).sum()),
        "largest_distance": float(found.distance[arrived].max()),
        "largest_off_degrees": float(np.degrees(found.off[arrived].max())),
        "smallest_clearance": float(found.clearance.min()),
        "largest_growth_in_ball": float(found.grown.max()),
        "median_time": float(np.median(found.time[arrived])),
        "p95_time": float(np.quantile(found.time[arrived], 0.95)),
    }


def draw(found: Arrivals, path: str) -> None:
    """Draw paths to one heading from all around, and where and how all robots ended."""
    turn = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    rng = np.random.default_rng(1)
    start = Pose.at(1.05 * np.cos(turn), 1.05 * np.sin(turn), rng.uniform(-np.pi, np.pi, turn.size))
    near = drive(start, np.zeros(turn.size))
    with plots.figure(path, 11.0, 5.0, ncols=2) as (left, right):
        for x, y in np.moveaxis(near.paths, 2, 0):
            left.plot(x, y, color=plots.PATH_COLOUR, linewidth=1.2)
        left.quiver(start.x, start.y, start.cos, start.sin, scale=14.0, width=0.006)
        left.quiver(0.0, 0.0, 1.0, 0.0, scale=5.0, width=0.012, color=plots.GOAL_COLOUR, zorder=3)
        circle = np.linspace(0.0, 2.0 * np.pi, 200)
        ball = pose_law.LARGEST_BALL
        left.plot(ball * np.cos(circle), ball * np.sin(circle), "k--", linewidth=0.8)
        left.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="Inside the ball")
        right.scatter(100.0 * found.distance, np.degrees(found.off), s=4, color=plots.PATH_COLOUR)
        right.plot([0.0, 2.0, 2.0], [3.0, 3.0, 0.0], "k--", linewidth=0.8)
        right.set(
            xlim=(0.0, 2.2),
            ylim=(0.0, 3.3),
            xlabel="distance from the goal [cm]",
            ylabel="off its heading [degrees]",
            title=f"{found.time.size} robots on arrival",
        )


def main(arguments: list[str]) -> int:
    """Drive, and say how it went."""
    parser = argparse.ArgumentParser(description="arrivals with an orientation")
    parser.add_argument("--robots", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json")
    parser.add_argument("--plot")
    options = parser.parse_args(arguments)
    world = configuration(FILE).settings.world
    yaw = np.random.default_rng(options.seed).uniform(-math.pi, math.pi, options.robots)
    found = drive(random_starts(world, options.robots, options.seed), yaw)
    said = json.dumps(figures(found), indent=2)
    print(said)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            file.write(said)
    if options.plot:
        draw(found, options.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

# SPDX-License-Identifier: Apache-2.0
"""Simulation speed: robot-steps per second on one core, against IR-SIM and scipy's solve_ivp.

A robot-step is one control period of one robot with all that `gradnav simulate` does in it:
potential, law, limits, the exact arc, distances kept, arrival and collision checked.
"""

import os
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from tbot_gradnav import parameter_file, shipped
from tbot_gradnav.controller import Controller
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import CONTROL_PERIOD, random_starts, simulate
from tbot_gradnav.unicycle import Floats, Pose, step

BATCHES = (1, 10, 100, 1_000, 3_000, 6_000, 10_000, 30_000, 100_000)
POTENTIALS = {
    "psi": "nine_navigation_function.yaml",
    "U": "nine_attractive_repulsive.yaml",
}
SEED = 0
DRIVEN = 3.0  # [s] of robot time; all robots still drive then, but for a few
REPEATS = 5  # of which the fastest counts: what is measured is the code, not the neighbours
IRSIM_ROBOTS = (1, 100)
IRSIM_STEPS = {1: 400, 100: 40}
TOGETHER = (1, 1000)  # robots integrated at once by ours and by solve_ivp
REACH = 8.0  # [s] of robot time
REFERENCE = 1e-9  # relative tolerance of the reference solution
TOLERANCES = 10.0 ** -np.arange(2.0, 8.5, 0.5)


def one_core() -> None:
    """Keep this process, and what it starts, on one core."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def controller(file: str) -> Controller:
    """Return the controller of a shipped parameter file."""
    return Controller.of(Settings.of(parameter_file.read(shipped.parameter_path(file))))


def steps_per_second(control: Controller, n: int) -> float:
    """Return the robot-steps per second in a batch of n robots."""
    start = random_starts(control.settings.world, n, SEED)
    best = 0.0
    for _ in range(REPEATS if n < 100_000 else 2):
        began = time.perf_counter()
        runs = simulate(control, start, time_limit=DRIVEN)
        seconds = time.perf_counter() - began
        best = max(best, float(np.round(runs.time / runs.dt).sum()) / seconds)
    return best


def batches() -> dict[str, dict[int, float]]:
    """Return the robot-steps per second by potential and batch."""
    return {
        name: {n: steps_per_second(controller(file), n) for n in BATCHES}
        for name, file in POTENTIALS.items()
    }


def irsim(n: int) -> float:
    """Return IR-SIM's robot-steps per second: n robots that dash among the nine obstacles."""
    import irsim

    control = controller(POTENTIALS["U"])
    world, limits = control.settings.world, control.settings.limits
    start = random_starts(world, n, SEED)
    circles = list(world.obstacles.values())
    robots = [
        {
            "kinematics": {"name": "diff"},
            "shape": {"name": "circle", "radius": world.robot_radius},
            "state": [float(x) + 5.0, float(y) + 5.0, float(theta)],
            "goal": [5.0, 5.0, 0.0],
            "vel_max": [limits.v, limits.omega],
            "behavior": {"name": "dash"},
        }
        for x, y, theta in zip(start.x, start.y, np.asarray(start.theta), strict=True)
    ]
    obstacles = [
        {"shape": {"name": "circle", "radius": c.size}, "state": [c.centre[0] + 5, c.centre[1] + 5]}
        for c in circles
    ]
    size = {"height": 10, "width": 10, "step_time": 0.05, "sample_time": 0.05}
    size |= {"collision_mode": "unobstructed"}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "world.yaml"
        file.write_text(yaml.safe_dump({"world": size, "robot": robots, "obstacle": obstacles}))
        env = irsim.make(str(file), display=False, log_level="ERROR")
    steps = IRSIM_STEPS[n]
    began = time.perf_counter()
    for _ in range(steps):
        env.step()
    seconds = time.perf_counter() - began
    env.end()
    return n * steps / seconds


class AgainstSolver(NamedTuple):
    """Ours and solve_ivp on the closed loop as an ODE, at equal accuracy.

    error [m]: median distance at the end from a reference solution, ours; rtol: the loosest
    tolerance with which solve_ivp is at least as accurate; times [s] of the whole batch.
    """

    error: float
    rtol: float
    solver_error: float
    ours: float
    solver: float

    @property
    def ratio(self) -> float:
        """How many times as fast ours is."""
        return self.solver / self.ours


def against_solver(n: int) -> AgainstSolver:
    """Compare with solve_ivp (RK45) on the continuous closed loop of n robots at once.

    Ours holds each command for 50 ms, which is its error; the solver gets the loosest tolerance,
    in steps of half a decade, with an error no larger than that.
    """
    control = controller(POTENTIALS["U"])
    drawn = random_starts(control.settings.world, 3 * n + 20, SEED)
    far = np.hypot(drawn.x, drawn.y) > REACH * control.settings.limits.v + 0.2  # none arrives
    start = Pose(*(np.asarray(part)[far][:n] for part in drawn))
    gear = control.gear(start)
    exact, _ = _solved(control, start, gear, REFERENCE)
    ends, ours = _stepped(control, start, gear)
    error = _apart(ends, exact)
    for rtol in TOLERANCES:
        found, seconds = _solved(control, start, gear, float(rtol))
        if _apart(found, exact) <= error:
            break
    return AgainstSolver(error, float(rtol), _apart(found, exact), ours, seconds)


def _stepped(control: Controller, start: Pose, gear: Floats) -> tuple[np.ndarray, float]:
    """Return where ours ends, x and y [m], and the time [s] it took."""
    fastest = np.inf
    for _ in range(3):
        began, pose = time.perf_counter(), start
        for _ in range(round(REACH / CONTROL_PERIOD)):
            pose = step(pose, control.command(pose, gear), CONTROL_PERIOD)
        fastest = min(fastest, time.perf_counter() - began)
    return np.array([pose.x, pose.y]), fastest


def _solved(
    control: Controller, start: Pose, gear: Floats, rtol: float
) -> tuple[np.ndarray, float]:
    """Return where solve_ivp ends, x and y [m], and the time [s] it took."""
    from scipy.integrate import solve_ivp

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        x, y, theta = state.reshape(3, -1)
        pose = Pose(x, y, np.cos(theta), np.sin(theta))
        v, omega = control.command(pose, gear)
        return np.concatenate([v * pose.cos, v * pose.sin, omega])

    initial = np.concatenate([start.x, start.y, np.asarray(start.theta)])
    began = time.perf_counter()
    end = solve_ivp(rate, (0.0, REACH), initial, rtol=rtol, atol=rtol).y[:, -1]
    return end.reshape(3, -1)[:2], time.perf_counter() - began


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    """Return the median distance [m] between points."""
    return float(np.median(np.hypot(*(a - b))))

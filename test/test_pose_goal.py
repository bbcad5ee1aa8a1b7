# SPDX-License-Identifier: Apache-2.0
"""Goals with an orientation: the pose law, its proof's inequalities, and where no ball fits."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import CONFIG, ROOT
from hypothesis import given, settings
from hypothesis import strategies as st

from tbot_gradnav import pose_law
from tbot_gradnav.controller import Controller
from tbot_gradnav.laws import State
from tbot_gradnav.parameter_file import read
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import random_starts, simulate
from tbot_gradnav.unicycle import Pose, Twist, step

NINE = read(CONFIG / "nine_attractive_repulsive.yaml")
ANGLES = st.floats(-math.pi, math.pi)


def off_by(runs, yaw):
    """Return by how much [rad] each robot's last heading differs from the goal's."""
    off = runs.path[2, -1] - yaw
    return np.abs((off + math.pi) % (2.0 * math.pi) - math.pi)


def towards(x, y, yaw, **more):
    return Controller.of(
        Settings.of(NINE | {"goal": [x, y, yaw], "xy_goal_tolerance": 0.02} | more)
    )


@pytest.mark.parametrize("seed", range(int(os.environ.get("GRADNAV_POSE_SEEDS", "1"))))
def test_2000_starts_and_headings_arrive_within_two_centimetres_and_three_degrees(seed, tmp_path):
    out = tmp_path / "arrivals.json"
    tool = [sys.executable, ROOT / "tools" / "pose_goals.py", "--seed", str(seed), "--json", out]
    subprocess.run(tool, check=True, stdout=subprocess.DEVNULL)
    found = json.loads(out.read_text())
    assert (found["robots"], found["arrived"], found["collided"]) == (2000, 2000, 0)
    assert found["largest_distance"] <= 0.02
    assert found["largest_off_degrees"] <= 3.0
    assert found["smallest_clearance"] > 0.09  # the starts are 0.1 m clear
    assert found["largest_growth_in_ball"] < 1e-5  # [m] while a command is held


def test_the_hard_starts_arrive_too():
    yaw = 0.0
    control = towards(0.0, 0.0, yaw)
    x = np.array([-0.8, 0.8, 0.8, -0.8, 0.0, 0.01, 0.05])
    y = np.array([0.0, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0])
    theta = np.array([math.pi, math.pi, 0.0, 0.0, 0.0, math.pi, math.pi / 2])
    runs = simulate(control, Pose.at(x, y, theta), record=True)
    assert runs.arrived.all()
    assert off_by(runs, yaw).max() <= math.radians(3.0)


def test_where_no_ball_fits_the_robot_turns_at_the_goal():
    control = towards(1.05, 0.2, 1.0)  # 0.1 m clear of an obstacle
    world = control.settings.world
    assert pose_law.ball(world.clearance(*world.goal)) == 0.0
    runs = simulate(control, random_starts(control.settings.world, 50, 1), record=True)
    assert runs.arrived.all()
    assert not runs.collided.any()
    assert off_by(runs, 1.0).max() <= math.radians(3.0)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(rho=st.floats(0.01, 1.1), alpha=ANGLES, theta=ANGLES, yaw=ANGLES)
def test_the_distance_never_grows_and_v_never_rises(rho, alpha, theta, yaw):
    def state(pose):
        r = math.hypot(pose.x, pose.y)
        return State(pose.cos, pose.sin, r, pose.x / r, pose.y / r, 0.0, 0.0, 0.0)

    def lyapunov(pose):
        at = state(pose)
        cos_a = -(at.cos_theta * at.cos_alpha + at.sin_theta * at.sin_alpha)
        cos_b = -(math.cos(yaw) * at.cos_alpha + math.sin(yaw) * at.sin_alpha)
        return (1.0 - cos_a) + pose_law.ETA * (1.0 - cos_b)

    here = Pose.at(rho * math.cos(alpha), rho * math.sin(alpha), theta)
    v, omega = pose_law.align(state(here), math.cos(yaw), math.sin(yaw))
    dt = 1e-6
    there = step(here, Twist(v, omega), dt)
    assert math.hypot(there.x, there.y) <= rho + 1e-11
    assert (lyapunov(there) - lyapunov(here)) / dt <= 1e-4 / rho


def test_goal_of_two_numbers_asks_for_no_orientation():
    control = Controller.of(Settings.of(NINE))
    assert control.arrived(Pose.at(0.03, 0.0, 2.0))
    assert not towards(0.0, 0.0, 0.0).arrived(Pose.at(0.01, 0.0, 2.0))

# SPDX-License-Identifier: Apache-2.0
"""Arriving with an orientation, which the paper leaves to future work.

Inside a ball about the goal that is free of obstacles a law of the same kind takes over,
trigonometric and without atan2. With a the angle from the heading to the line of sight to the
goal, and b that from the goal's heading to this line,

    v = gamma rho cos a,   omega = kappa sin a + gamma cos a (sin a + eta sin b).

Then d rho/dt = -gamma rho cos^2 a <= 0, so the robot does not leave the ball and touches nothing,
and V = (1 - cos a) + eta (1 - cos b) has dV/dt = -kappa sin^2 a <= 0: by LaSalle it comes in along
the goal's heading from almost everywhere. After Aicardi, Casalino, Bicchi and Balestrino, IEEE
Robotics and Automation Magazine 2(1), 1995, whose law uses the angles themselves.
"""

import numpy as np

from tbot_gradnav.laws import State
from tbot_gradnav.unicycle import Floats, Twist

GAMMA = 0.5  # [1/s]
KAPPA = 1.0  # [rad/s]
ETA = 3.0
LARGEST_BALL = 1.1  # [m]
SMALLEST_BALL = 0.3  # [m] in less, the robot goes to the goal and turns there
MARGIN = 0.95  # of the free ball
TURN = 1.5  # [rad/s] on the spot


def ball(clearance: Floats) -> float:
    """Return the radius [m] of the law's ball for a goal's clearance [m]; 0 where none fits."""
    free = min(LARGEST_BALL, MARGIN * float(clearance))
    return free if free >= SMALLEST_BALL else 0.0


def align(at: State, cos_goal: float, sin_goal: float) -> Twist:
    """Return the command inside the ball, the goal's heading being (cos_goal, sin_goal)."""
    # the line of sight from the robot to the goal is -(cos alpha, sin alpha)
    cos_a = -(at.cos_theta * at.cos_alpha + at.sin_theta * at.sin_alpha)
    sin_a = at.sin_theta * at.cos_alpha - at.cos_theta * at.sin_alpha
    sin_b = sin_goal * at.cos_alpha - cos_goal * at.sin_alpha
    v = GAMMA * at.rho * cos_a
    return Twist(v, KAPPA * sin_a + GAMMA * cos_a * (sin_a + ETA * sin_b))


def turn(at: State, cos_goal: float, sin_goal: float) -> Twist:
    """Return the command at the goal: a turn on the spot to its heading."""
    cos = at.cos_theta * cos_goal + at.sin_theta * sin_goal
    sin = sin_goal * at.cos_theta - cos_goal * at.sin_theta
    towards: Floats = np.where(cos > 0.0, sin, np.copysign(1.0, sin))
    return Twist(np.zeros_like(towards), TURN * towards)

# SPDX-License-Identifier: Apache-2.0
"""How long it takes to a goal from every node of a lattice, by fast marching.

Sethian, Proc. National Academy of Sciences 93(4), 1996; the marching itself is scikit-fmm's.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOWEST = 0.2  # speed where the robot touches something, of that in the open
OBSTACLE = 10.0  # 1 / free_space.MARGIN; times the longest time, where no robot may be


class Task(NamedTuple):
    """What is asked for: the time from each node to a goal.

    clearance [m] of the robot and whether it may be there, of shape (rows, columns); the goal's
    column and row, not whole numbers; the nodes' spacing [m]; the radius [m] about the goal in
    which the way is straight; the clearance [m] from which on nothing slows the robot down, and
    the goal's own.
    """

    clearance: Array
    free: NDArray[np.bool_]
    goal: tuple[float, float]
    spacing: float
    radius: float
    ample: float
    goal_clearance: float


def march(task: Task) -> Array:
    """Return phi, the least time [s] from each node at up to 1 m/s, far higher where not free.

    Speed falls to SLOWEST as clearance falls from ample to 0. Where the robot may not be phi rises
    inward, and is so high that, interpolated bilinearly, it is nowhere where the robot touches
    anything below that of a free node: where the weights w_i of clearances c_i [cells] make a sum
    below 0, those that are not free have sum w_i (1 + max(0, -c_i)) >= MARGIN, because free nodes
    have c_i >= MARGIN.
    """
    rows, columns = task.clearance.shape
    x, y = np.arange(columns) - task.goal[0], np.arange(rows)[:, None] - task.goal[1]
    rho = task.spacing * np.hypot(x, y)
    near = rho <= task.radius
    phi = np.where(near, rho / speed(task.goal_clearance, task.ample), np.inf)
    if np.any(task.free & ~near):
        start = task.radius / speed(task.goal_clearance, task.ample)
        phi = np.where(near, phi, start + _beyond(task, rho - task.radius))
    longest = np.max(phi, where=task.free, initial=task.spacing)
    inward = np.maximum(0.0, -task.clearance) / task.spacing
    return np.where(task.free, phi, OBSTACLE * longest * (1.0 + inward))


def speed(clearance: Array | float, ample: float) -> Array:
    """Return the speed [m/s] that the field thinks is right at a clearance [m]."""
    return np.clip(np.asarray(clearance) / ample, SLOWEST, 1.0)


def _beyond(task: Task, outside: Array) -> Array:
    """Return the time from the circle where `outside` [m], the distance from it, is 0."""
    import skfmm

    front = np.ma.MaskedArray(outside, ~task.free)
    pace = speed(task.clearance, task.ample)
    for order in (2, 1):
        time = np.ma.filled(skfmm.travel_time(front, pace, dx=task.spacing, order=order), np.inf)
        if np.all(falls(time)[task.free & (outside > 0.0)]):
            break
    return np.asarray(time, dtype=float)


def falls(phi: Array) -> NDArray[np.bool_]:
    """Return whether each node has a lower neighbour along its row or column.

    Then phi, interpolated bilinearly, has no minimum there; nor has it one between nodes, where
    it is straight along the sides of a square and a saddle, if anything, inside.
    """
    high = np.pad(phi, 1, constant_values=np.inf)
    vertical = np.minimum(high[:-2, 1:-1], high[2:, 1:-1])
    horizontal = np.minimum(high[1:-1, :-2], high[1:-1, 2:])
    return np.minimum(vertical, horizontal) < phi

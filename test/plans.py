# SPDX-License-Identifier: Apache-2.0
"""Floor plans for tests of the potential map."""

import numpy as np
from conftest import CONFIG

from tbot_gradnav.map_files import read
from tbot_gradnav.occupancy import FREE, OCCUPIED, Occupancy
from tbot_gradnav.settings import Settings

RESOLUTION = 0.05  # [m]


def grid(walls):
    """Return the map of an array that is true where there are walls."""
    return Occupancy(np.where(walls, OCCUPIED, FREE).astype(np.int8), RESOLUTION)


def maze(seed, size=6, way=12, wall=2):
    """Return a maze without loops of `size` x `size` rooms, a `way` and a `wall` in cells wide.

    And the middles [m] of its rooms, of shape (size * size, 2).
    """
    rng, pitch = np.random.default_rng(seed), way + wall
    walls = np.ones((size * pitch + wall, size * pitch + wall), dtype=bool)
    seen, stack = {(0, 0)}, [(0, 0)]
    while stack:
        i, j = stack[-1]
        beside = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        fresh = [c for c in beside if c not in seen and min(c) >= 0 and max(c) < size]
        if not fresh:
            stack.pop()
            continue
        k, m = fresh[rng.integers(len(fresh))]
        seen.add((k, m))
        stack.append((k, m))
        top, left = wall + min(i, k) * pitch, wall + min(j, m) * pitch
        walls[top : top + way + (k != i) * pitch, left : left + way + (m != j) * pitch] = False
    middle = RESOLUTION * (wall + way / 2 + pitch * np.arange(size))
    x, y = np.meshgrid(middle, middle)
    return grid(walls), np.stack([x.ravel(), y.ravel()], axis=1)


def trap():
    """Return a room of 6 x 4 m with a U open away from the goal, which is at (5, 2)."""
    walls = np.ones((80, 120), dtype=bool)
    walls[2:-2, 2:-2] = False
    walls[20:60, 70:74] = True
    walls[[*range(20, 24), *range(56, 60)], 30:74] = True
    return grid(walls)


def office():
    """Return the plan that comes with the package."""
    return read(CONFIG / "maps" / "office.yaml")


def settings(occupancy, goal, start, **more):
    """Return settings to drive to `goal` in a map."""
    values = {"potential": "map", "goal": list(goal), "initial_pose": [*start, 0.0]}
    return Settings.of(values | more, topic_map=occupancy)


PLANS = {
    "maze": lambda: settings(maze(3)[0], (0.45, 0.45), maze(3)[1][-1].tolist()),
    "trap": lambda: settings(trap(), (5.0, 2.0), (2.0, 2.0)),
    "office": lambda: settings(office(), (4.2, 7.2), (7.9, 0.6)),
}

# SPDX-License-Identifier: Apache-2.0
"""The random worlds of the quality benchmark.

A disc of radius 4.5 m about the goal; 6 to 12 circles, radii even between 0.25 and 0.5 m, centres
even over the disc. A circle is drawn anew where it would come nearer than GAP to another or to the
boundary, or than GOAL_GAP to the goal: nothing is tuned to any controller, but a Burger of radius
0.105 m fits through everywhere. In each world there are STARTS starts, even over the free space,
0.1 m clear, more than 1 m from the goal, headings even.
"""

from collections.abc import Mapping

import numpy as np

from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import random_starts
from tbot_gradnav.unicycle import Pose

WORLDS = 100
STARTS = 4
RADIUS = 4.5  # [m]
COUNT = (6, 12)
RADII = (0.25, 0.5)  # [m]
GAP = 0.5  # [m] between circles, and to the boundary
GOAL_GAP = 0.4  # [m]
BEYOND = 1.0  # [m] of a start from the goal


def parameters(seed: int) -> dict[str, object]:
    """Return the parameters of a world: goal, boundary and obstacles."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(COUNT[0], COUNT[1] + 1))
    circles: list[tuple[float, float, float]] = []
    while len(circles) < n:
        r, phi = RADIUS * np.sqrt(rng.random()), rng.uniform(-np.pi, np.pi)
        x, y, radius = r * np.cos(phi), r * np.sin(phi), rng.uniform(*RADII)
        apart = all(np.hypot(x - a, y - b) - radius - c >= GAP for a, b, c in circles)
        if apart and r + radius <= RADIUS - GAP and r - radius >= GOAL_GAP:
            circles.append((float(x), float(y), float(radius)))
    values: dict[str, object] = {"goal": [0.0, 0.0], "boundary.radius": RADIUS}
    values["obstacles.names"] = [f"o{i}" for i in range(n)]
    for i, circle in enumerate(circles):
        keyed = zip(["x", "y", "radius"], circle, strict=True)
        values |= {f"obstacles.o{i}.{key}": value for key, value in keyed}
    values["initial_pose"] = [0.0, 0.0, 0.0]  # free, and not used
    return values


def starts(seed: int, values: Mapping[str, object]) -> Pose:
    """Return the starts in a world."""
    drawn = random_starts(Settings.of(values).world, 4 * STARTS + 20, seed)
    far = np.hypot(drawn.x, drawn.y) > BEYOND
    return Pose(*(np.asarray(part)[far][:STARTS] for part in drawn))

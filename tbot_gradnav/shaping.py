# SPDX-License-Identifier: Apache-2.0
"""How fast the robot should be: the gradient's norm replaced by a speed.

The norm of a navigation function's gradient ranges over many decades, and with v = k_v mu as
printed a real robot stands still. Its direction is what avoids obstacles; scaling v and omega by
a common positive factor, or the gradient by any positive function of position, changes no path.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from tbot_gradnav.elementwise import smaller
from tbot_gradnav.unicycle import Floats


class Pace(NamedTuple):
    """What a shaping may use: gain |k_v| [1/s], top speed [m/s] and deceleration [m/s^2]."""

    k_v: float
    top_speed: float
    deceleration: float


def brake(pace: Pace, rho: Floats, mu: Floats) -> Floats:
    """Return the speed from which a constant deceleration stops at the goal."""
    return smaller(pace.top_speed, (2.0 * pace.deceleration * rho) ** 0.5)


def exponential(pace: Pace, rho: Floats, mu: Floats) -> Floats:
    """Return k_v rho, the paper's own speed near the goal, up to the top speed."""
    return smaller(pace.top_speed, pace.k_v * rho)


def unshaped(pace: Pace, rho: Floats, mu: Floats) -> Floats:
    """Return k_v mu, as printed."""
    return pace.k_v * mu


SHAPINGS: Mapping[str, Callable[[Pace, Floats, Floats], Floats]] = {
    "brake": brake,
    "exponential": exponential,
    "none": unshaped,
}

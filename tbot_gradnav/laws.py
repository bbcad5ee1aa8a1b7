# SPDX-License-Identifier: Apache-2.0
"""The control laws: heading and gradient in, (v, omega) out.

theta is the heading, (rho, alpha) the position relative to the goal in polar coordinates,
(mu, gamma) the gradient of the potential in polar coordinates. Angles enter by their sine and
cosine only, so nothing jumps at +-pi. Gains are signed as in the paper: both positive drives
forward, both negative backward; k_v in 1/s, k_omega in rad/s.
"""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from tbot_gradnav.elementwise import choose, larger, magnitude
from tbot_gradnav.unicycle import Floats, Twist

NUDGE = 0.1  # |sin beta| below which a robot that faces the wrong way turns on the spot


class State(NamedTuple):
    """What a law sees of the robot; one robot or many."""

    cos_theta: Floats
    sin_theta: Floats
    rho: Floats
    cos_alpha: Floats
    sin_alpha: Floats
    mu: Floats
    cos_gamma: Floats
    sin_gamma: Floats


class Law(Protocol):
    """A control law: gains and state to a twist."""

    def __call__(self, k_v: Floats, k_omega: Floats, at: State) -> Twist:
        """Return (v, omega) [m/s, rad/s]."""
        ...


def position(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """Eqs. (6)-(8): v = k_v rho, omega = k_omega sin(theta - alpha). Ignores the potential."""
    cos_beta, sin_beta = _between(at, at.cos_alpha, at.sin_alpha)
    return _nudged(Twist(k_v * at.rho, k_omega * sin_beta), k_v, k_omega, cos_beta, sin_beta)


def radial(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """Eq. (22) exactly as printed: v = k_v mu, omega = k_omega (mu / rho) sin(theta - alpha).

    It does not avoid obstacles: omega / v does not depend on the potential, and with
    k_omega = 2 k_v the path is the circle through the goal of eq. (30). For study.
    """
    _, sin_beta = _between(at, at.cos_alpha, at.sin_alpha)
    return Twist(k_v * at.mu, k_omega * at.mu / larger(at.rho, 1e-150) * sin_beta)


def heading(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """Eq. (6) with the gradient's polar form: v = k_v mu, omega = k_omega sin(theta - gamma).

    It drives on while it turns and so can climb the potential and collide. For study.
    """
    cos_beta, sin_beta = _between(at, at.cos_gamma, at.sin_gamma)
    return _nudged(Twist(k_v * at.mu, k_omega * sin_beta), k_v, k_omega, cos_beta, sin_beta)


def descent(k_v: Floats, k_omega: Floats, at: State) -> Twist:
    """`heading`, but driving only where that goes downhill: the law for obstacles.

    v = k_v mu max(0, -+cos beta), omega = k_omega sin beta, beta = theta - gamma, upper sign
    forward. Then d phi/dt = v ||grad phi|| cos beta <= 0 from every heading: phi never rises and
    the robot never reaches an obstacle, where phi is largest.
    """
    cos_beta, sin_beta = _between(at, at.cos_gamma, at.sin_gamma)
    downhill = larger(0.0, choose(k_v > 0.0, -cos_beta, cos_beta))
    ideal = Twist(k_v * at.mu * downhill, k_omega * sin_beta)
    return _nudged(ideal, k_v, k_omega, cos_beta, sin_beta)


LAWS: Mapping[str, Law] = {
    "position": position,
    "radial": radial,
    "heading": heading,
    "descent": descent,
}
TOWARDS_GOAL = frozenset({"position", "radial"})  # steer by alpha; the others by the gradient


def _between(at: State, cos: Floats, sin: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine of beta, the heading relative to a direction."""
    return (
        at.cos_theta * cos + at.sin_theta * sin,
        at.sin_theta * cos - at.cos_theta * sin,
    )


def _nudged(
    twist: Twist, k_v: Floats, k_omega: Floats, cos_beta: Floats, sin_beta: Floats
) -> Twist:
    """Return the twist, but a turn on the spot about the unstable heading (Remark IV.4).

    No continuous law is without such a heading, and a robot set down on it must not stay, nor
    drive away for ever because its turning is too slow for its driver.
    """
    wrong_way = (k_v * cos_beta > 0.0) & (magnitude(sin_beta) < NUDGE)
    turn = k_omega * np.copysign(NUDGE, sin_beta)
    return Twist(choose(wrong_way, 0.0, twist.v), choose(wrong_way, turn, twist.omega))

# SPDX-License-Identifier: Apache-2.0
"""Exact solutions of the paper's closed loops, as oracles."""

import numpy as np

from tbot_gradnav.unicycle import Floats


def beta(t: Floats, beta_0: Floats, k_v: float, k_omega: float) -> Floats:
    """Heading relative to the position, over time, under the position law [rad].

    Eq. (14): tan(beta/2) = eta_0 e^(k_beta t), k_beta = k_omega - k_v.
    """
    eta = np.tan(beta_0 / 2.0) * np.exp((k_omega - k_v) * t)
    result: Floats = 2.0 * np.arctan(eta)
    return result


def rho(t: Floats, rho_0: Floats, beta_0: Floats, k_v: float, k_omega: float) -> Floats:
    """Distance to the goal over time under the position law [m]: eq. (20) corrected.

    As printed, eq. (20) drops the lower limit of its integral and does not even give
    rho(0) = rho_0. With it, rho(t) = rho_0 (sin beta(t) / sin beta_0)^(k_v / k_beta), here
    with sin beta = 2 eta / (1 + eta^2) so that it holds at sin beta_0 = 0 as well.
    """
    k_beta, eta_0 = k_omega - k_v, np.tan(beta_0 / 2.0)
    ratio = (1.0 + eta_0**2) / (1.0 + (eta_0 * np.exp(k_beta * t)) ** 2)
    result: Floats = rho_0 * np.exp(k_v * t) * ratio ** (k_v / k_beta)
    return result


def rho_as_printed(t: Floats, rho_0: Floats, beta_0: Floats, k_v: float, k_omega: float) -> Floats:
    """Eq. (20) as printed [m], which is wrong; kept to show by how much."""
    k_beta = k_omega - k_v
    zeta = np.tan(beta_0 / 2.0) ** 2 * np.exp(2.0 * k_beta * t)
    return rho_0 * (zeta / (1.0 + zeta) ** 2) ** (k_v / (2.0 * k_beta))


def circle_constant(rho_: Floats, sin_beta: Floats) -> Floats:
    """Return rho / sin(beta) [m], constant along eq. (22) for any potential: eq. (30)."""
    return rho_ / sin_beta

# SPDX-License-Identifier: Apache-2.0
"""The unicycle, eq. (1), and its heading read from the quaternion, eq. (3).

Every quantity is a float for one robot or an array for many; functions broadcast.
"""

import math
from typing import NamedTuple

import numpy as np

from tbot_gradnav.elementwise import Floats, choose

__all__ = ["STOP", "Floats", "Pose", "Twist", "has_heading", "heading", "quaternion", "step"]


class Pose(NamedTuple):
    """Position [m] and heading h = (cos theta, sin theta) in a frame."""

    x: Floats
    y: Floats
    cos: Floats
    sin: Floats

    @classmethod
    def at(cls, x: Floats, y: Floats, theta: Floats) -> "Pose":
        """Return the pose at (x, y) [m] with heading theta [rad]."""
        return cls(x, y, np.cos(theta), np.sin(theta))

    @property
    def theta(self) -> Floats:
        """Heading [rad] in (-pi, pi], for people to read; no law uses it."""
        return np.arctan2(self.sin, self.cos)

    def compose(self, other: "Pose") -> "Pose":
        """Return `other`, which is given in this pose's frame, in the frame of this pose."""
        return Pose(
            self.x + self.cos * other.x - self.sin * other.y,
            self.y + self.sin * other.x + self.cos * other.y,
            self.cos * other.cos - self.sin * other.sin,
            self.sin * other.cos + self.cos * other.sin,
        )

    def inverse(self) -> "Pose":
        """Return the pose p with p.compose(self) the origin."""
        return Pose(
            -(self.cos * self.x + self.sin * self.y),
            self.sin * self.x - self.cos * self.y,
            self.cos,
            -self.sin,
        )


class Twist(NamedTuple):
    """Forward speed v [m/s] and turning speed omega [rad/s], the input u = (v, omega)."""

    v: Floats
    omega: Floats


STOP = Twist(0.0, 0.0)


def heading(q_z: Floats, q_w: Floats) -> tuple[Floats, Floats]:
    """Return (cos theta, sin theta) of a quaternion's yaw, eq. (3), without its angle.

    The quotient makes it right for an unnormalised quaternion; for one with roll and pitch it is
    the yaw of the swing-twist decomposition. q and -q give the same. Needs q_z or q_w nonzero.
    """
    norm = q_w * q_w + q_z * q_z
    return (q_w * q_w - q_z * q_z) / norm, 2.0 * q_z * q_w / norm


def has_heading(q_z: float, q_w: float) -> bool:
    """Return whether `heading` has anything to go by: both are 0 for a robot on its back."""
    return math.hypot(q_z, q_w) > 1e-6


def quaternion(theta: float) -> tuple[float, float]:
    """Return (q_z, q_w) of heading theta [rad], eq. (3)."""
    return math.sin(theta / 2.0), math.cos(theta / 2.0)


def step(pose: Pose, twist: Twist, dt: Floats) -> Pose:
    """Return the pose after dt [s] at a constant twist: the exact arc of eq. (1).

    The chord of the arc points along the heading of half time, and both halves of the turn are
    the same rotation.
    """
    half = 0.5 * twist.omega * dt
    half = choose(half == 0.0, 1e-150, half)  # sin(half) / half is 1 there
    cos_half, sin_half = np.cos(half), np.sin(half)
    chord = twist.v * dt * (sin_half / half)
    cos_mid, sin_mid = _rotate(pose.cos, pose.sin, cos_half, sin_half)
    cos_end, sin_end = _rotate(cos_mid, sin_mid, cos_half, sin_half)
    # One Newton step keeps the heading of unit length however many steps follow.
    unit = 1.5 - 0.5 * (cos_end * cos_end + sin_end * sin_end)
    return Pose(pose.x + chord * cos_mid, pose.y + chord * sin_mid, cos_end * unit, sin_end * unit)


def _rotate(cos: Floats, sin: Floats, by_cos: Floats, by_sin: Floats) -> tuple[Floats, Floats]:
    return cos * by_cos - sin * by_sin, sin * by_cos + cos * by_sin

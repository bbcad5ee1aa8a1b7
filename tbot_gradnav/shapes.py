# SPDX-License-Identifier: Apache-2.0
"""Convex obstacles and how far away they are; exact, with a gradient continuous outside them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import ParameterError
from tbot_gradnav.parameters import YAW, Checked, Number, Numbers, field
from tbot_gradnav.unicycle import Floats

Array = NDArray[np.float64]

OUTLINE = 720  # points of an outline
SMALLEST = 1e-6  # [m] of a size; corners much nearer to each other are one by rounding
NEWTON_STEPS = 20  # for the nearest point of an ellipse; it stops changing after a dozen


class Distance(NamedTuple):
    """Signed distance d [m] from an outline, negative inside, and its gradient, a unit vector."""

    d: Floats
    n_x: Floats
    n_y: Floats


class Shape(Checked, ABC):
    """A convex obstacle."""

    @abstractmethod
    def distance(self, x: Floats, y: Floats) -> Distance:
        """Return the distance of points (x, y) [m], floats or arrays."""

    @property
    @abstractmethod
    def size(self) -> float:
        """Radius [m] of a disc of the same area."""

    @property
    @abstractmethod
    def centre(self) -> tuple[float, float]:
        """A point inside [m]."""

    @property
    @abstractmethod
    def outline(self) -> tuple[Array, Array]:
        """Points (x, y) [m] along the outline."""


@dataclass(frozen=True)
class Round(Shape):
    """A shape with a centre and no corners."""

    x: float = field(0.0, Number("centre", "m"))
    y: float = field(0.0, Number("centre", "m"))

    @property
    def centre(self) -> tuple[float, float]:
        """The centre."""
        return self.x, self.y


@dataclass(frozen=True)
class Circle(Round):
    """A circular obstacle."""

    radius: float = field(1.0, Number("radius", "m", at_least=SMALLEST))

    def distance(self, x: Floats, y: Floats) -> Distance:
        """Return the distance of points."""
        dx, dy = x - self.x, y - self.y
        to_centre = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-150)
        return Distance(to_centre - self.radius, dx / to_centre, dy / to_centre)

    @property
    def size(self) -> float:
        """The radius."""
        return self.radius

    @property
    def outline(self) -> tuple[Array, Array]:
        """Points along the circle."""
        turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE)
        return self.x + self.radius * np.cos(turn), self.y + self.radius * np.sin(turn)


class Cornered(Shape):
    """A shape with corners."""

    @property
    @abstractmethod
    def corners(self) -> Array:
        """The corners [m], counter-clockwise, of shape (n, 2)."""

    def distance(self, x: Floats, y: Floats) -> Distance:
        """Return the distance of points: to the nearest edge outside, the nearest line inside."""
        return _from_polygon(self.corners, x, y)

    @property
    def size(self) -> float:
        """Radius of a disc of the same area."""
        return float(np.sqrt(_doubled_area(self.corners) / (2.0 * np.pi)))

    @property
    def centre(self) -> tuple[float, float]:
        """The mean of the corners."""
        x, y = self.corners.mean(axis=0)
        return float(x), float(y)

    @property
    def outline(self) -> tuple[Array, Array]:
        """Points along the edges, the corners among them."""
        along = np.linspace(0.0, 1.0, max(2, OUTLINE // len(self.corners)))[:, None, None]
        points = (self.corners + along * _edges(self.corners)).swapaxes(0, 1).reshape(-1, 2)
        return points[:, 0], points[:, 1]


@dataclass(frozen=True)
class Polygon(Cornered):
    """A convex polygon; its corners in either order."""

    points: tuple[float, ...] = field((), Numbers("corners x y x y ...", "m", rows=2))

    def __post_init__(self) -> None:
        """Check that it is convex."""
        super().__post_init__()
        refuse_unless_convex(self.points)

    @cached_property
    def corners(self) -> Array:
        """The corners [m], counter-clockwise, of shape (n, 2)."""
        corners = np.array(self.points).reshape(-1, 2)
        return corners if _doubled_area(corners) > 0.0 else corners[::-1]


@dataclass(frozen=True)
class Box(Cornered):
    """A rectangle, turned by yaw."""

    x: float = field(0.0, Number("centre", "m"))
    y: float = field(0.0, Number("centre", "m"))
    width: float = field(1.0, Number("full side along its own x", "m", at_least=SMALLEST))
    height: float = field(1.0, Number("full side along its own y", "m", at_least=SMALLEST))
    yaw: float = field(0.0, YAW)

    @cached_property
    def corners(self) -> Array:
        """The corners [m], counter-clockwise, of shape (4, 2)."""
        u = 0.5 * self.width * np.array([1, -1, -1, 1])
        w = 0.5 * self.height * np.array([1, 1, -1, -1])
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.stack([self.x + cos * u - sin * w, self.y + sin * u + cos * w], axis=1)


@dataclass(frozen=True)
class Ellipse(Round):
    """An ellipse, turned by yaw."""

    semi_x: float = field(1.0, Number("half axis along its own x", "m", at_least=SMALLEST))
    semi_y: float = field(1.0, Number("half axis along its own y", "m", at_least=SMALLEST))
    yaw: float = field(0.0, YAW)

    def distance(self, x: Floats, y: Floats) -> Distance:
        """Return the distance of points.

        The nearest point is (a^2 u / (t + a^2), b^2 w / (t + b^2)) with the largest root t of
        (a u / (t + a^2))^2 + (b w / (t + b^2))^2 = 1, (u, w) the point in the ellipse's own axes:
        convex and falling right of -min(a, b)^2, so Newton's method from the left is safe.
        """
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        dx, dy = x - self.x, y - self.y
        u, w = cos * dx + sin * dy, cos * dy - sin * dx
        a, b = self.semi_x, self.semi_y
        au = a * np.maximum(np.abs(u), 1e-9 * a)
        bw = b * np.maximum(np.abs(w), 1e-9 * b)
        t = np.maximum(au - a * a, bw - b * b)
        for _ in range(NEWTON_STEPS):
            p, q = au / (t + a * a), bw / (t + b * b)
            t = t + (p * p + q * q - 1.0) / (2.0 * (p * p / (t + a * a) + q * q / (t + b * b)))
        p, q = au / (t + a * a), bw / (t + b * b)  # the nearest point is (a p, b q)
        n_u, n_w = np.copysign(p / a, u), np.copysign(q / b, w)
        norm = np.sqrt(n_u * n_u + n_w * n_w)
        n_u, n_w = n_u / norm, n_w / norm
        off_u, off_w = np.abs(u) - a * p, np.abs(w) - b * q
        d = np.sign(t) * np.sqrt(off_u * off_u + off_w * off_w)
        return Distance(d, cos * n_u - sin * n_w, sin * n_u + cos * n_w)

    @property
    def size(self) -> float:
        """Radius of a disc of the same area."""
        return float(np.sqrt(self.semi_x * self.semi_y))

    @property
    def outline(self) -> tuple[Array, Array]:
        """Points along the ellipse."""
        turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE)
        u, w = self.semi_x * np.cos(turn), self.semi_y * np.sin(turn)
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return self.x + cos * u - sin * w, self.y + sin * u + cos * w


SHAPES: Mapping[str, type[Shape]] = {
    "circle": Circle,
    "box": Box,
    "ellipse": Ellipse,
    "polygon": Polygon,
}


def refuse_unless_convex(points: tuple[float, ...]) -> None:
    """Raise ParameterError unless corners x y x y ... are those of a convex polygon."""
    corners = np.array(points).reshape(-1, 2)
    edges = _edges(corners)
    onward = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * onward[:, 1] - edges[:, 1] * onward[:, 0]
    whole = np.abs(np.sum(np.arctan2(turns, np.sum(edges * onward, axis=1))))
    one_way = bool(np.all(turns > 0.0) or np.all(turns < 0.0))
    short = bool(np.any(np.hypot(edges[:, 0], edges[:, 1]) < SMALLEST))
    if len(corners) < 3 or short or not one_way or whole > 7.0:  # 2 pi when it goes round once
        raise ParameterError(
            "points", list(points), "must be the corners of a convex polygon, at least 3, in order"
        )


def outward(corners: Array) -> Array:
    """Return the unit normals, of shape (n, 2), of the edges of a counter-clockwise polygon."""
    edges = _edges(corners)
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    unit: Array = normals / np.hypot(normals[:, 0], normals[:, 1])[:, None]
    return unit


def _edges(corners: Array) -> Array:
    return np.roll(corners, -1, axis=0) - corners


def _doubled_area(corners: Array) -> float:
    x, y = corners.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _from_polygon(corners: Array, x: Floats, y: Floats) -> Distance:
    shape = (-1,) + (1,) * np.ndim(x)
    c_x, c_y = (c.reshape(shape) for c in corners.T)
    e_x, e_y = (e.reshape(shape) for e in _edges(corners).T)
    m_x, m_y = (m.reshape(shape) for m in outward(corners).T)
    dx, dy = x - c_x, y - c_y
    along = np.clip((dx * e_x + dy * e_y) / (e_x * e_x + e_y * e_y), 0.0, 1.0)
    off_x, off_y = dx - along * e_x, dy - along * e_y
    d2 = off_x * off_x + off_y * off_y
    line = dx * m_x + dy * m_y  # signed distance from each edge's line
    inside = np.max(line, axis=0) <= 0.0
    edge = np.where(inside, np.argmax(line, axis=0), np.argmin(d2, axis=0))[None]

    def chosen(values: Array) -> Array:
        picked: Array = np.take_along_axis(np.broadcast_to(values, d2.shape), edge, axis=0)[0]
        return picked

    far = np.sqrt(chosen(d2))
    d = np.where(inside, chosen(line), far)
    safe = np.maximum(far, 1e-150)
    on_line = inside | (far < 1e-12)
    return Distance(
        d,
        np.where(on_line, chosen(m_x), chosen(off_x) / safe),
        np.where(on_line, chosen(m_y), chosen(off_y) / safe),
    )

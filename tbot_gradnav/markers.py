# SPDX-License-Identifier: Apache-2.0
"""Markers of RViz and Foxglove: the world of a parameter file, and the vectors at the robot."""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from tbot_gradnav.potentials import Potential
from tbot_gradnav.settings import Settings
from tbot_gradnav.shapes import Box, Circle, Ellipse, Shape
from tbot_gradnav.unicycle import Pose, quaternion
from tbot_gradnav.world import Boundary

HEIGHT = 0.2  # [m] of obstacles
LINE = 0.02  # [m] width
LONGEST = 0.5  # [m] of the vectors at the robot; the others keep their proportion to it
GREY, BLACK = ColorRGBA(r=0.5, g=0.5, b=0.5, a=0.8), ColorRGBA(a=1.0)
GREEN, RED = ColorRGBA(g=0.7, a=1.0), ColorRGBA(r=0.9, a=1.0)
BLUE, ORANGE = ColorRGBA(r=0.1, g=0.3, b=1.0, a=1.0), ColorRGBA(r=1.0, g=0.6, a=0.8)


def of_world(settings: Settings) -> list[Marker]:
    """Return markers of obstacles at their true size, boundary, waypoints and goal."""
    found = [_of_shape(i, shape) for i, shape in enumerate(settings.obstacles.values())]
    if settings.boundary.exists:
        found.append(_of_boundary(settings.boundary))
    for i, leg in enumerate(settings.legs[:-1]):
        x, y = leg.goal[:2]
        found.append(_disc("waypoints", i, x, y, settings.waypoint_tolerance, ORANGE))
    if settings.has_goal:
        x, y = settings.goal[:2]
        found.append(_disc("goal", 0, x, y, settings.xy_goal_tolerance, GREEN))
    if settings.goal_heading is not None:
        cos, sin = settings.goal_heading
        found.append(_arrow("goal", 1, x, y, LONGEST * cos, LONGEST * sin, GREEN))
    return found


def of_robot(potential: Potential, pose: Pose, towards_goal: bool) -> list[Marker]:
    """Return arrows at the robot: -grad phi and, where it has parts, attraction and repulsion.

    None while it has nowhere to go.
    """
    x, y = float(pose.x), float(pose.y)
    vectors = _vectors(potential, x, y) if towards_goal else []
    longest = max((math.hypot(v_x, v_y) for _, v_x, v_y, _ in vectors), default=0.0)
    scale = LONGEST / longest if longest > 0.0 else 0.0
    return [
        _arrow(name, 0, x, y, scale * v_x, scale * v_y, colour)
        for name, v_x, v_y, colour in vectors
    ]


def removed(markers: Iterable[Marker]) -> list[Marker]:
    """Return what takes markers away."""
    return [Marker(header=m.header, ns=m.ns, id=m.id, action=Marker.DELETE) for m in markers]


def identity(marker: Marker) -> tuple[str, int]:
    """Return what tells a marker from others."""
    return marker.ns, marker.id


def _vectors(
    potential: Potential, x: float, y: float
) -> Sequence[tuple[str, float, float, ColorRGBA]]:
    g_x, g_y = map(float, potential(x, y).gradient)
    total = ("total", -g_x, -g_y, BLUE)
    parts = potential.attraction(x, y)
    if parts is None:
        return [total]
    a_x, a_y = map(float, parts)
    return [
        ("attractive", -a_x, -a_y, GREEN),
        ("repulsive", a_x - g_x, a_y - g_y, RED),
        total,
    ]


def _of_shape(i: int, shape: Shape) -> Marker:
    if isinstance(shape, Circle):
        size = 2.0 * shape.radius, 2.0 * shape.radius, HEIGHT
        return _solid(i, Marker.CYLINDER, shape, 0.0, size)
    if isinstance(shape, Ellipse):
        size = 2.0 * shape.semi_x, 2.0 * shape.semi_y, HEIGHT
        return _solid(i, Marker.CYLINDER, shape, shape.yaw, size)
    if isinstance(shape, Box):
        return _solid(i, Marker.CUBE, shape, shape.yaw, (shape.width, shape.height, HEIGHT))
    return _fan(i, shape)


def _solid(i: int, kind: int, shape: Shape, yaw: float, size: tuple[float, float, float]) -> Marker:
    marker = _marker("obstacles", i, kind, GREY, size)
    marker.pose.position.x, marker.pose.position.y = shape.centre
    marker.pose.position.z = HEIGHT / 2.0
    q_z, q_w = quaternion(yaw)
    marker.pose.orientation = Quaternion(z=q_z, w=q_w)
    return marker


def _fan(i: int, shape: Shape) -> Marker:
    """Return a flat marker of any convex shape: triangles about its centre."""
    marker = _marker("obstacles", i, Marker.TRIANGLE_LIST, GREY, (1.0, 1.0, 1.0))
    centre, corners = _point(*shape.centre), list(_outline(shape))
    for a, b in pairwise(corners):
        marker.points += [centre, a, b]
    return marker


def _of_boundary(boundary: Boundary) -> Marker:
    marker = _marker("boundary", 0, Marker.LINE_STRIP, BLACK, (LINE, 0.0, 0.0))
    marker.points = list(_outline(boundary.region))
    return marker


def _outline(shape: Shape) -> Iterator[Point]:
    """Yield the corners of a cornered shape, or some hundred points of a round one, closed."""
    corners = getattr(shape, "corners", None)
    if corners is None:
        x, y = (part[::6] for part in shape.outline)
    else:
        x, y = np.asarray(corners).T
    yield from map(_point, x.tolist(), y.tolist())
    yield _point(float(x[0]), float(y[0]))


def _disc(name: str, i: int, x: float, y: float, radius: float, colour: ColorRGBA) -> Marker:
    marker = _marker(name, i, Marker.CYLINDER, colour, (2.0 * radius, 2.0 * radius, 0.01))
    marker.pose.position.x, marker.pose.position.y = x, y
    return marker


def _arrow(
    name: str, i: int, x: float, y: float, v_x: float, v_y: float, colour: ColorRGBA
) -> Marker:
    marker = _marker(name, i, Marker.ARROW, colour, (LINE, 2.0 * LINE, 0.0))
    marker.points = [_point(x, y, HEIGHT), _point(x + v_x, y + v_y, HEIGHT)]
    return marker


def _marker(name: str, i: int, kind: int, colour: ColorRGBA, size: Sequence[float]) -> Marker:
    marker = Marker(ns=name, id=i, type=kind, action=Marker.ADD, color=colour)
    marker.scale.x, marker.scale.y, marker.scale.z = size
    marker.pose.orientation.w = 1.0
    return marker


def _point(x: float, y: float, z: float = 0.0) -> Any:
    return Point(x=x, y=y, z=z)

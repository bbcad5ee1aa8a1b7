# SPDX-License-Identifier: Apache-2.0
"""The length of the shortest path to the goal, the yardstick for what the controllers drive.

Among discs a shortest path is straight but for arcs along discs, which it meets and leaves on
tangents. So it is a walk in the tangent graph (Liu and Arimoto, Int. J. Robotics Research 11(4),
1992), here of turns: a turn is a disc driven round one way, to the left or to the right. A robot
on a turn is known by its heading, and an arc is the radius times the change of heading.

The boundary and corners where inflated obstacles overlap only forbid: no shortest path bends
there, since the free space is convex at them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.shapes import Circle
from tbot_gradnav.world import World

Array = NDArray[np.float64]

SLACK = 1e-9  # [m] by which to touch is not to overlap, however it was rounded
CHUNK = 1_000_000  # start, tangent and tangent again: triples handled at once, 8 MB an array


def shortest_paths(world: World, x: ArrayLike, y: ArrayLike) -> Array:
    """Return the length [m] of the shortest path to the goal from each start (x, y) [m].

    It is that of the centre of a robot that may touch obstacles and boundary and turns on the
    spot; inf where there is none or where the start, or the goal, is not free. x and y broadcast
    against each other, and the lengths have their shape.
    """
    roads = _Roads(world)
    start_x, start_y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    starts = np.stack([start_x.ravel(), start_y.ravel(), np.zeros(start_x.size)])[..., None]
    lengths = np.empty(start_x.size)
    size = max(1, CHUNK // max(1, roads.onward.size))
    for i in range(0, lengths.size, size):
        lengths[i : i + size] = roads.from_points(_Turns(*starts[:, i : i + size]))
    return lengths.reshape(start_x.shape)


class _Turns(NamedTuple):
    """Circles to drive round: centre (x, y) [m] and radius r [m].

    r is positive to the left (counterclockwise), negative to the right and 0 for a point.
    """

    x: Array
    y: Array
    r: Array


class _Roads:
    """The tangent graph of K turns, two for each obstacle, with the ways from each to the goal.

    exits: heading [rad] in which to leave each turn for each turn and, last, for the goal, and
    onward: length [m] from there to the goal, inf where there is no way; both of shape (K, K + 1).
    """

    def __init__(self, world: World) -> None:
        circles = [c for c in world.obstacles.values() if isinstance(c, Circle)]
        if len(circles) < len(world.obstacles) or world.boundary.shape != "circle":
            raise GradnavError("shortest paths are known among circles only")
        discs = np.array([(c.x, c.y) for c in circles]).reshape(-1, 2)
        x, y = discs.T
        edge = world.boundary
        self.discs = _Turns(x, y, world.size[: x.size])
        self.boundary = edge.x, edge.y, world.size[-1] if world.bounded else np.inf
        self.goal = _Turns(*np.array([*world.goal, 0.0]).reshape(3, 1))
        self.turns = _Turns(np.tile(x, 2), np.tile(y, 2), np.outer([1, -1], self.discs.r).ravel())
        self.covered = self._covered(world)
        ends = _Turns(*(np.append(a, b) for a, b in zip(self.turns, self.goal, strict=True)))
        self.exits, length = self.tangents(_Turns(*(a[:, None] for a in self.turns)), ends)
        self.onward = self._to_goal(length)

    def from_points(self, points: _Turns) -> Array:
        """Return the length [m] to the goal from each of `points`, of shape (N, 1); (N,)."""
        heading, length = self.tangents(points, self.turns)
        around = length + (self.arcs(heading) + self.onward).min(axis=-1, initial=np.inf)
        _, direct = self.tangents(points, self.goal)
        shortest: Array = np.minimum(direct[:, 0], around.min(axis=-1, initial=np.inf))
        return shortest

    def tangents(self, a: _Turns, b: _Turns) -> tuple[Array, Array]:
        """Return heading [rad] and length [m] of the segment from turn a to turn b.

        The length is inf where they have no such tangent or it is not free. a and b broadcast.
        """
        dx, dy, dr = b.x - a.x, b.y - a.y, b.r - a.r
        apart = np.hypot(dx, dy)
        sine = np.clip(dr / np.maximum(apart, 1e-150), -1.0, 1.0)
        heading = np.arctan2(dy, dx) - np.arcsin(sine)
        left_x, left_y = -np.sin(heading), np.cos(heading)
        free = self.free(
            (a.x - a.r * left_x, a.y - a.r * left_y), (b.x - b.r * left_x, b.y - b.r * left_y)
        )  # it never is where |dr| > apart: the circles overlap, and the ends are inside
        length = np.sqrt(np.maximum((apart - dr) * (apart + dr), 0.0))
        return heading, np.where(free, length, np.inf)

    def free(self, p: tuple[Array, Array], q: tuple[Array, Array]) -> NDArray[np.bool_]:
        """Return whether the robot may drive straight from p to q, both (x, y) [m] of one shape."""
        c_x, c_y, limit = self.boundary
        within = [np.hypot(x - c_x, y - c_y) <= limit + SLACK for x, y in (p, q)]
        free: NDArray[np.bool_] = np.logical_and(*within)
        dx, dy = q[0] - p[0], q[1] - p[1]
        inverse = 1.0 / np.maximum(dx * dx + dy * dy, 1e-150)
        for c_x, c_y, r in zip(*self.discs, strict=True):
            to_x, to_y = c_x - p[0], c_y - p[1]
            nearest = np.clip((to_x * dx + to_y * dy) * inverse, 0.0, 1.0)
            free &= np.hypot(to_x - nearest * dx, to_y - nearest * dy) >= r - SLACK
        return free

    def arcs(self, heading: Array) -> Array:
        """Return the length [m] of the arc along each turn up to each of its exits.

        heading [rad]: that on arrival at each turn, of shape (..., K); result: (..., K, K + 1),
        inf where the arc is not free.
        """
        left, come = np.sign(self.turns.r)[:, None], heading[..., None]
        along = left * (self.exits - come) % (2.0 * np.pi)
        # Exits are not covered, so one beyond the middle of what is covered is beyond all of it.
        room = left * (self.covered - come) % (2.0 * np.pi)
        room = np.fmin.reduce(room, axis=-1, keepdims=True, initial=np.inf)
        return np.where(along < room, np.abs(self.turns.r)[:, None] * along, np.inf)

    def _covered(self, world: World) -> Array:
        """Return the heading [rad] on each turn in the middle of what M others cover of it.

        The others are the discs and the boundary, beyond which all is covered. Shape (K, M); nan
        where nothing is covered.
        """
        left = np.sign(self.turns.r)
        d, n_x, n_y = world.distances(self.turns.x, self.turns.y)
        overlap = (d < np.abs(self.turns.r) - SLACK) & (np.hypot(n_x, n_y) > 0.0)  # not with itself
        return np.where(overlap, np.arctan2(-left * n_x, left * n_y), np.nan).T

    def _to_goal(self, length: Array) -> Array:
        """Return the length [m] from each exit to the goal, given that of each tangent.

        Bellman's iteration: round n knows the ways with up to n + 1 tangents.
        """
        arcs = self.arcs(self.exits[:, :-1])
        onward = np.full_like(length, np.inf)
        onward[:, -1] = length[:, -1]
        while True:
            arrival = (arcs + onward).min(axis=-1, initial=np.inf)
            longer = np.column_stack([length[:, :-1] + arrival, length[:, -1]])
            if np.array_equal(longer, onward):
                return onward
            onward = longer

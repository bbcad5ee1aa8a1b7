# SPDX-License-Identifier: Apache-2.0
"""Walls from a map, surprises from the lidar."""

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Self

import numpy as np

from tbot_gradnav.fast_marching import Task
from tbot_gradnav.free_space import NOWHERE, FreeSpace, blocked
from tbot_gradnav.marching_process import Marching
from tbot_gradnav.potentials.field import Field, Points
from tbot_gradnav.potentials.map import Map, task_in
from tbot_gradnav.potentials.repulsion import repulsion
from tbot_gradnav.potentials.scan import Scan
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import Boundary, Distances, World

ON_WALL = 0.06  # [m] what the lidar sees this near a wall of the map is that wall
MAPPED = 0.15  # [m] likewise for plans, which drift of the odometry shall not close
SHY = 0.05  # [m] more than needed that a way leaves beside a surprise, of which a part is seen
COARSE = 0.2  # [m] side of the squares by which surprises are told from those before


@dataclass(frozen=True)
class MapScan(Map, Scan):
    """phi = T^2 / 2 + T^2 times the repulsion of what the lidar sees and the map does not hold.

    T is the time of the fastest way, as in Map, around the surprises. Where they change it is
    found anew; until it is there the old one counts, and the repulsion keeps the robot off. What
    the parameter file says of obstacles is not used.
    """

    borrows: ClassVar[tuple[str, ...]] = ("map", "scan")
    advice: ClassVar[str] = "to look for what stands in the way"

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return phi and its gradient at (x, y)."""
        time, t_x, t_y, _ = Map.__call__(self, x, y)
        push = repulsion(self._near(x, y), self.k_repulsive, self.influence_distance)
        pull, weight = time * (1.0 + 2.0 * push.value), time * time
        return Field(
            weight * (0.5 + push.value), pull * t_x + weight * push.x, pull * t_y + weight * push.y
        )

    @property
    def known(self) -> World:
        """The world without what only the lidar sees."""
        return self.world if self.revealed else replace(self.world, obstacles={})

    def room(self, x: Floats, y: Floats) -> Floats:
        """Return how far [m] a robot at (x, y) is from a wall or anything seen."""
        return np.minimum(self.known.clearance(x, y), Scan.room(self, x, y))

    def all_seen(self) -> Self:
        """Return the same potential as if the lidar had seen all there is."""
        other = super().all_seen()
        for cached in ("_space", "_marching"):
            other.__dict__.pop(cached, None)
        return other

    def prepare(self) -> None:
        """Find ways in the background from now on."""
        object.__setattr__(self, "_background", True)
        super().prepare()

    def seeing(self, points: Points) -> Self:
        """Return the same potential with these points seen by the lidar."""
        other = super().seeing(self._off_walls(points, ON_WALL))
        if self.world.walls is not None:
            other._plan()
        return other

    def _plan(self) -> None:
        """Begin another plan where the surprises have changed; take it once it is ready."""
        memory = self.__dict__
        surprises = self._off_walls(self.seen, MAPPED)
        squares = frozenset(zip(*np.rint(np.array(surprises) / COARSE).tolist(), strict=True))
        if memory.get("_next") is None and squares != memory.get("_planned", frozenset()):
            memory["_planned"] = squares
            memory["_next"] = Marching(
                partial(_task_among, self._space, self.known, surprises, self.clearance)
            )
            if memory.get("_background"):
                memory["_next"].begin()
        plan: Marching | None = memory.get("_next")
        if plan is not None and plan.ready:
            memory["_next"] = None
            if not plan.failed:
                memory["_marching"] = plan

    def _off_walls(self, points: Points, distance: float) -> Points:
        """Return those of the points that are further than this [m] from any wall of the map."""
        if self.world.walls is None:
            return points
        off = np.asarray(self.world.walls.distance(*points).d) > distance
        return Points(points.x[off], points.y[off])

    def _near(self, x: Floats, y: Floats) -> Distances:
        if not self.revealed:
            return Scan._near(self, x, y)
        world = self.world
        return World(world.goal, world.obstacles, Boundary(), world.robot_radius).distances(x, y)


def _task_among(space: FreeSpace, known: World, seen: Points, ample: float) -> Task:
    """Return what is asked for in a free space with surprises in it."""
    goal_clearance = float(known.clearance(*known.goal))
    among = blocked(space, *seen, known.robot_radius + SHY, ample)
    if among.part_at(*known.goal) == NOWHERE:  # something stands on the goal: go and see
        among = space
    return task_in(among, known.goal, goal_clearance, ample)

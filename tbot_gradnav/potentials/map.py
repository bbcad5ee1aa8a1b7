# SPDX-License-Identifier: Apache-2.0
"""The way to the goal in a map, which has no minimum but the goal."""

from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from importlib.util import find_spec
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.elementwise import choose, larger
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.fast_marching import Task, falls, speed
from tbot_gradnav.free_space import NOWHERE, FreeSpace, free_space
from tbot_gradnav.marching_process import Marching
from tbot_gradnav.parameters import Number, Text, field
from tbot_gradnav.potentials.field import Field, Potential
from tbot_gradnav.unicycle import Floats
from tbot_gradnav.world import World

Array = NDArray[np.float64]

STRAIGHT = 2.0  # cells about the goal in which the way to it is straight, if they are free
FIELDS = 8  # the last few are kept


@dataclass(frozen=True)
class Map(Potential):
    """phi is the time of the fastest way to the goal, at 1 m/s, slower near obstacles.

    So phi is the length [m] of the shortest way where there is room. Obstacles and boundary of
    the parameter file count as well as the walls. phi is found at the nodes of the map's lattice
    by fast marching and interpolated bilinearly, and the gradient is that of what is
    interpolated; near the goal phi is a cone. Each node has a lower one beside it, so nothing but
    the goal is a minimum. A robot where none can be is led out.
    """

    advice: ClassVar[str] = "to look for what stands in the way and is not in the map"

    file: str = field("", Text("map_server's YAML file, of any potential; empty: the topic map"))
    clearance: float = field(
        0.25, Number("nearer to obstacles the robot would rather not be", "m", above=0.0)
    )

    def __post_init__(self) -> None:
        """Check that there is something to march with."""
        super().__post_init__()
        if find_spec("skfmm") is None:
            raise GradnavError("potential map needs scikit-fmm: pip install scikit-fmm")

    @property
    def ready(self) -> bool:
        """Whether there is a map, and the field is not just being made."""
        return self.world.walls is not None and self._marching.ready

    def prepare(self) -> None:
        """Begin to make the field in a process of its own."""
        if self.world.walls is not None:
            self._marching.begin()

    def reaches(self, x: Floats, y: Floats) -> NDArray[np.bool_]:
        """Return whether there is a way from (x, y) to the goal; yes while there is no map."""
        if self.world.walls is None:
            return super().reaches(x, y)
        goal = self._space.part_at(*self.world.goal)
        reached: NDArray[np.bool_] = (self._space.part_at(x, y) == goal) & (goal != NOWHERE)
        return reached

    def __call__(self, x: Floats, y: Floats) -> Field:
        """Return phi and its gradient at (x, y). Raises GradnavError without a map."""
        marching, lattice = self._marching, self._space.lattice
        steepest = marching.phi[0, 0] / lattice.spacing
        value, g_x, g_y = lattice.sampled(marching.phi, x, y, beyond=steepest)
        dx, dy = x - self.world.goal[0], y - self.world.goal[1]
        rho = (dx * dx + dy * dy) ** 0.5
        near, slope = rho <= marching.task.radius, self._slowness / larger(rho, 1e-150)
        return Field(
            choose(near, self._slowness * rho, value),
            choose(near, slope * dx, g_x),
            choose(near, slope * dy, g_y),
        )

    @property
    def pits(self) -> tuple[Array, Array]:
        """The nodes (x, y) [m] with a way to the goal, but none that is lower beside them."""
        task, (x, y) = self._marching.task, self._space.lattice.nodes
        far = np.hypot(x - self.world.goal[0], y - self.world.goal[1]) > task.radius
        pit = task.free & far & ~falls(self._marching.phi)
        return x[pit], y[pit]

    @property
    def counts(self) -> tuple[int, int]:
        """How many nodes are free, and from how many of them there is a way to the goal."""
        return int(self._space.free.sum()), int(self._marching.task.free.sum())

    @property
    def known(self) -> World:
        """The world as far as the potential knows it beforehand."""
        return self.world

    @cached_property
    def _slowness(self) -> float:
        return 1.0 / float(speed(self._marching.task.goal_clearance, self.clearance))

    @cached_property
    def _space(self) -> FreeSpace:
        if self.world.walls is None:
            raise GradnavError("potential map has no map: map.file is empty, and no topic map came")
        return free_space(self.known)

    @cached_property
    def _marching(self) -> Marching:
        clear = float(self.known.clearance(*self.world.goal))
        return _marching(self._space, self.world.goal, clear, self.clearance)


@lru_cache(maxsize=FIELDS)
def _marching(
    space: FreeSpace, goal: tuple[float, float], goal_clearance: float, ample: float
) -> Marching:
    """Return the marching to a goal, the same for the same."""
    return Marching(partial(task_in, space, goal, goal_clearance, ample))


def task_in(
    space: FreeSpace, goal: tuple[float, float], goal_clearance: float, ample: float
) -> Task:
    """Return what is asked for in a free space; see Task."""
    away, _, part = space.nearest(*goal)
    spacing = space.lattice.spacing
    column, row = map(float, space.lattice.place(*goal))
    return Task(
        space.clearance,
        (space.part == part) & (part != NOWHERE),
        (column, row),
        spacing,
        max(min(STRAIGHT * spacing, goal_clearance), 1.01 * float(away)),
        ample,
        goal_clearance,
    )

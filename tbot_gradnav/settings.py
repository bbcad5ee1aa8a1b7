# SPDX-License-Identifier: Apache-2.0
"""Everything one parameter file says about control and world."""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tbot_gradnav import map_files
from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.laws import LAWS
from tbot_gradnav.limits import Limits
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.parameters import (
    Checked,
    Choice,
    Flag,
    Names,
    Number,
    Numbers,
    Parameter,
    build,
    field,
    parameters_of,
    refuse_unknown,
)
from tbot_gradnav.potentials import Map, Potential, gains_of, potentials
from tbot_gradnav.shapes import SHAPES, Shape
from tbot_gradnav.shaping import SHAPINGS
from tbot_gradnav.unicycle import Pose
from tbot_gradnav.walls import Walls, walls
from tbot_gradnav.world import Boundary, World

OBSTACLES = "obstacles."
NAMES = Names("names of the obstacles; each has an entry of its own")
SHAPE = Choice("shape of an obstacle", tuple(SHAPES))
MOST_WAYPOINTS = 100  # each has a potential of its own, made beforehand
OPTIONAL = "yaw"  # of an obstacle; all else must be given


@dataclass(frozen=True)
class Settings(Checked):
    """Law, gains, potential, world and limits.

    Raises ParameterError for an impossible value or combination, naming the parameter.
    """

    law: str = field("descent", Choice("control law", tuple(LAWS)))
    k_v: float = field(
        0.5, Number("gain of v; k_v, k_omega < 0 drive backward; brake uses its sign only", "1/s")
    )
    k_omega: float = field(3.0, Number("gain of omega", "rad/s"))
    auto_reverse: bool = field(
        True, Flag("may flip both gains when a goal is set, to start the short way")
    )
    speed_shaping: str = field(
        "brake", Choice("speed along the gradient; none: v = k_v mu", tuple(SHAPINGS))
    )
    deceleration: float = field(0.5, Number("deceleration of brake", "m/s^2", above=0.0))
    potential: str = field("attractive_repulsive", Choice("potential", tuple(potentials())))
    goal: tuple[float, ...] = field(
        (),
        Numbers(
            "x, y of the goal in the world frame, and yaw if it matters; empty: wait for goal_pose",
            "m, rad",
            (0, 2, 3),
            poses=True,
        ),
    )
    waypoints: tuple[float, ...] = field(
        (),
        Numbers(
            "x, y of the points that the navigator passes on the way to the goal, in this order",
            "m",
            rows=2,
            at_most=MOST_WAYPOINTS,
        ),
    )
    waypoint_tolerance: float = field(
        0.2, Number("how near a waypoint is passed; there is no stop", "m", above=0.0)
    )
    initial_pose: tuple[float, ...] = field(
        (0.0, 0.0, 0.0),
        Numbers("x, y, yaw in the world frame at the first odometry", "m, rad", (3,), poses=True),
    )
    starts: tuple[float, ...] = field(
        (),
        Numbers(
            "more starts, for gradnav simulate and figures: x, y, yaw each",
            "m, rad",
            rows=3,
            poses=True,
        ),
    )
    robot_radius: float = field(
        0.105, Number("obstacles and boundary are inflated by it", "m", at_least=0.0)
    )
    lidar_x: float = field(
        -0.032, Number("how far ahead of the robot's centre the lidar is, for potential scan", "m")
    )
    xy_goal_tolerance: float = field(0.05, Number("how near the goal is arrived", "m", above=0.0))
    yaw_goal_tolerance: float = field(
        0.05,
        Number("how near the goal's yaw is arrived, if it matters", "rad", above=0.0, at_most=3.14),
    )
    limits: Limits = dataclasses.field(default_factory=Limits)
    boundary: Boundary = dataclasses.field(default_factory=Boundary)
    obstacles: Mapping[str, Shape] = dataclasses.field(default_factory=dict)
    potential_gains: Mapping[str, Mapping[str, object]] = dataclasses.field(default_factory=dict)
    topic_map: Occupancy | None = None  # where map.file names none

    @classmethod
    def of(
        cls,
        values: Mapping[str, object],
        also_known: Iterable[str] = (),
        starting: bool = True,
        topic_map: Occupancy | None = None,
    ) -> "Settings":
        """Return the settings that parameters with dotted names describe.

        A name that is not a parameter is refused, with a hint at a near one, of these or of those
        `also_known`. The poses to start from must be free only while `starting`.
        """
        _refuse_unnamed(values)
        refuse_unknown(values, {*settings_parameters(values), *also_known})
        rest = dict(values)
        obstacles = _take_obstacles(rest)
        gains = {name: _take_gains(name, rest) for name in potentials()}
        settings = build(cls, rest, obstacles=obstacles, potential_gains=gains, topic_map=topic_map)
        if starting:
            settings._refuse_occupied_starts()
        return settings

    def __post_init__(self) -> None:
        """Check each parameter, then how they go together."""
        super().__post_init__()
        self._check_gains()
        if self.has_goal:
            self.world.refuse_occupied("goal", *self.goal[:2])
        for x, y in self._waypoints:
            self.world.refuse_occupied("waypoints", x, y)
        for leg in self.legs:
            _ = leg.chosen_potential  # which refuses what it cannot be made of

    @property
    def has_goal(self) -> bool:
        """Whether a goal is set."""
        return len(self.goal) > 0

    @cached_property
    def legs(self) -> "list[Settings]":
        """These settings with each waypoint in the goal's place, then with the goal itself."""
        if not self.waypoints:
            return [self]
        goals = [*self._waypoints, self.goal] if self.has_goal else [()]
        return [dataclasses.replace(self, goal=goal, waypoints=()) for goal in goals]

    @property
    def _waypoints(self) -> list[tuple[float, float]]:
        return list(zip(self.waypoints[::2], self.waypoints[1::2], strict=True))

    @cached_property
    def goal_heading(self) -> tuple[float, float] | None:
        """(cos, sin) of the yaw that the goal asks for; None where it asks for none."""
        return (math.cos(self.goal[2]), math.sin(self.goal[2])) if len(self.goal) == 3 else None

    @cached_property
    def world(self) -> World:
        """The world; while no goal is set, the robot's initial position stands in for it."""
        goal = self.goal if self.has_goal else self.initial_pose
        return World(
            (goal[0], goal[1]), self.obstacles, self.boundary, self.robot_radius, self._walls
        )

    @property
    def _walls(self) -> Walls | None:
        """The walls of the map, if there is one. Raises GradnavError."""
        file = self._map_file
        try:
            occupancy = map_files.read(file) if file else self.topic_map
            return None if occupancy is None else walls(occupancy)
        except GradnavError as error:
            raise GradnavError(f"map.file: {error}" if file else f"the map: {error}") from error

    @property
    def awaits_map(self) -> bool:
        """Whether the map is to come by a topic."""
        return issubclass(potentials()[self.potential], Map) and not self._map_file

    @property
    def _map_file(self) -> str:
        return str(self.potential_gains.get("map", {}).get("file", ""))

    @property
    def all_starts(self) -> list[tuple[float, ...]]:
        """The initial pose and the further starts: x, y [m] and yaw [rad] of each."""
        flat = self.initial_pose + self.starts
        return [flat[i : i + 3] for i in range(0, len(flat), 3)]

    @property
    def start(self) -> Pose:
        """The initial pose xi(0)."""
        x, y, yaw = self.initial_pose
        return Pose(x, y, math.cos(yaw), math.sin(yaw))

    @cached_property
    def chosen_potential(self) -> Potential:
        """The chosen potential in this world."""
        kind = potentials()[self.potential]
        sections = kind.borrows or (self.potential,)
        gains = [self.potential_gains.get(section, {}) for section in sections]
        try:
            return kind(self.world, **{name: g[name] for g in gains for name in g})
        except ParameterError as error:
            for section in sections:
                if error.name in gains_of(section):
                    raise error.within(section + ".") from error
            raise

    @cached_property
    def cautions(self) -> list[str]:
        """What a user should know who expects the robot to keep clear of what is in the file."""
        if not (self.obstacles or self.world.bounded or self.world.walls):
            return []
        found = []
        if self.law != "descent":
            found.append(f"law {self.law} does not keep clear of obstacles; law descent does")
        if not self.chosen_potential.repels:
            found.append(f"potential {self.potential} knows of no obstacles")
        return found

    def _refuse_occupied_starts(self) -> None:
        self.world.refuse_occupied("initial_pose", *self.initial_pose[:2])
        for x, y, _ in self.all_starts[1:]:
            self.world.refuse_occupied("starts", x, y)
        for x, y, _ in self.all_starts:
            self.refuse_unreachable(x, y)

    def refuse_unreachable(self, x: float, y: float) -> None:
        """Raise ParameterError unless there is a way from (x, y) [m] to goal and waypoints."""
        for leg in self.legs if self.has_goal else []:
            if not leg.chosen_potential.reaches(x, y):
                raise ParameterError(
                    "goal" if leg.goal == self.goal else "waypoints",
                    list(leg.goal),
                    f"there is no way to it from ({x:.3g}, {y:.3g}) for a robot of radius "
                    f"{self.robot_radius:g} (a way must be a cell of the map wider than the robot)",
                )

    def _check_gains(self) -> None:
        """Refuse gains outside the ranges for which the paper proves convergence."""
        k_v, k_omega = self.k_v, self.k_omega
        if k_v == 0.0:
            raise ParameterError("k_v", k_v, "must not be 0")
        if k_omega * k_v <= 0.0:
            raise ParameterError("k_omega", k_omega, f"must have the sign of k_v = {k_v:g}")
        if self.law in ("position", "heading") and abs(k_omega) <= abs(k_v):
            raise ParameterError(
                "k_omega",
                k_omega,
                f"law {self.law} needs k_omega < k_v < 0 or 0 < k_v < k_omega, and k_v = {k_v:g}",
            )
        if self.law == "radial" and k_omega != 2.0 * k_v:
            raise ParameterError(
                "k_omega", k_omega, f"law radial needs k_omega = 2 k_v = {2.0 * k_v:g}"
            )


def settings_parameters(values: Mapping[str, object]) -> dict[str, tuple[Parameter, Any]]:
    """Return every parameter of Settings and its default, given which obstacles are named."""
    found = parameters_of(Settings)
    for name in potentials():
        gains = gains_of(name)
        found.update({f"{name}.{gain}": entry for gain, entry in gains.items()})
    found["obstacles.names"] = (NAMES, ())
    for obstacle in NAMES.check("obstacles.names", values.get("obstacles.names", ())):
        prefix = f"{OBSTACLES}{obstacle}."
        found[prefix + "shape"] = (SHAPE, "circle")
        shape = SHAPE.check(prefix + "shape", values.get(prefix + "shape", "circle"))
        entries = parameters_of(SHAPES[shape])
        found.update({prefix + key: entry for key, entry in entries.items()})
    return found


def _take_obstacles(values: dict[str, object]) -> dict[str, Shape]:
    """Take the obstacles out of `values`: those in obstacles.names, each with its entry."""
    names = NAMES.check("obstacles.names", values.pop("obstacles.names", ()))
    obstacles = {}
    for name in names:
        prefix = f"{OBSTACLES}{name}."
        shape = SHAPE.check(prefix + "shape", values.pop(prefix + "shape", "circle"))
        for key in parameters_of(SHAPES[shape]):
            if prefix + key not in values and key != OPTIONAL:
                raise ParameterError("obstacles.names", list(names), f"{prefix}{key} is missing")
        obstacles[name] = build(SHAPES[shape], values, prefix)
    return obstacles


def _refuse_unnamed(values: Mapping[str, object]) -> None:
    """Raise ParameterError for an entry of an obstacle that is not in obstacles.names."""
    names = NAMES.check("obstacles.names", values.get("obstacles.names", ()))
    for name, value in values.items():
        if name.startswith(OBSTACLES) and name.split(".")[1] not in (*names, "names"):
            raise ParameterError(name, value, "its obstacle is not in obstacles.names")


def _take_gains(potential: str, values: dict[str, object]) -> dict[str, object]:
    """Take the gains of a potential out of `values`, each checked, chosen or not."""
    gains = {}
    for gain, (parameter, _) in gains_of(potential).items():
        name = f"{potential}.{gain}"
        if name in values:
            gains[gain] = parameter.check(name, values.pop(name))
    return gains

# SPDX-License-Identifier: Apache-2.0
"""The closed loop of controller and unicycle, for one robot or thousands at once."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.lookout import Lookout
from tbot_gradnav.potentials import Potential
from tbot_gradnav.shapes import Shape
from tbot_gradnav.unicycle import Pose, step
from tbot_gradnav.world import World

CONTROL_PERIOD = 0.05  # [s] the odometry rate of a TurtleBot3
TIME_LIMIT = 300.0  # [s]
START_CLEARANCE = 0.1  # [m] of a random start
KEPT = 31 * 2**20  # [B] see _keep_freed_memory; glibc heeds no more than 32 MiB


@dataclass(frozen=True)
class Runs:
    """How each of N robots fared; arrays of N.

    time [s] and path_length [m] up to arrival, collision or the time limit; min_clearance [m] is
    that of the robot's disc at the control instants; path, if recorded, holds x, y, theta of
    shape (3, steps + 1, N), a robot that is done staying where it is. dt [s] is the control
    period.
    """

    start: Pose
    dt: float
    arrived: NDArray[np.bool_]
    collided: NDArray[np.bool_]
    time: NDArray[np.float64]
    path_length: NDArray[np.float64]
    min_clearance: NDArray[np.float64]
    final_distance: NDArray[np.float64]
    path: NDArray[np.float64] | None = None

    @property
    def recorded(self) -> NDArray[np.float64]:
        """The path, of runs that were recorded."""
        if self.path is None:
            raise AssertionError("these runs were not recorded")
        return self.path


def simulate(
    controller: Controller,
    start: Pose,
    dt: float = CONTROL_PERIOD,
    time_limit: float = TIME_LIMIT,
    record: bool = False,
) -> Runs:
    """Drive a robot from each pose of `start` (arrays of N) until it arrives, collides or gives up.

    The command is held for dt [s], as between two odometry messages, and the unicycle moves along
    the exact arc. Robots whose potential looks drive one at a time, each seeing its own.
    """
    if controller.potential.looks and np.size(start.x) > 1:
        alone = [Pose(*column[:, None]) for column in np.array(start).T]
        return _together([simulate(controller, pose, dt, time_limit, record) for pose in alone])
    world = controller.settings.world
    _keep_freed_memory()
    pose = Pose(*np.array(start, dtype=float))
    n = np.size(pose.x)
    runs = Runs(
        start=start,
        dt=dt,
        arrived=np.zeros(n, dtype=bool),
        collided=np.zeros(n, dtype=bool),
        time=np.zeros(n),
        path_length=np.zeros(n),
        min_clearance=np.full(n, np.inf),
        final_distance=np.zeros(n),
    )
    driving = np.arange(n)  # the robots that `pose`, `gear`, `path_length`, `nearest` are about
    lookout = Lookout(controller.settings) if controller.potential.looks else None
    if lookout and (seen := lookout.look(0.0, pose)):
        controller = controller.seeing(seen)
    gear = np.array(controller.gear(pose))
    path_length, nearest = np.zeros(n), np.full(n, np.inf)
    path = [_snapshot(pose)] if record else []
    last = round(time_limit / dt)
    for tick in range(last + 1):
        clearance = world.clearance(pose.x, pose.y)
        np.minimum(nearest, clearance, out=nearest)
        hit = np.less(clearance, 0.0)
        home = controller.arrived(pose) & ~hit
        done = hit | home
        if tick == last or done.any():
            runs.collided[driving], runs.arrived[driving] = hit, home
            runs.time[driving], runs.path_length[driving] = tick * dt, path_length
            runs.min_clearance[driving] = nearest
            runs.final_distance[driving] = controller.distance(pose)
            left = ~done
            driving, gear = driving[left], gear[left]
            path_length, nearest = path_length[left], nearest[left]
            pose = Pose(*(np.asarray(component)[left] for component in pose))
        if driving.size == 0 or tick == last:
            break
        if lookout and (seen := lookout.look(tick * dt, pose)):
            controller = controller.seeing(seen)
        twist = controller.command(pose, gear)
        path_length += np.abs(twist.v) * dt
        pose = step(pose, twist, dt)
        if record:
            path.append(path[-1].copy())
            path[-1][:, driving] = _snapshot(pose)
    return replace(runs, path=np.stack(path, axis=1)) if record else runs


EACH = ("arrived", "collided", "time", "path_length", "min_clearance", "final_distance")


def _together(runs: list[Runs]) -> Runs:
    """Return the runs of robots that drove one at a time, as if they had driven at once."""
    joined = {name: np.concatenate([getattr(run, name) for run in runs]) for name in EACH}
    start = Pose(*(np.concatenate(parts) for parts in zip(*(r.start for r in runs), strict=True)))
    path = None
    if runs[0].path is not None:
        paths = [run.recorded for run in runs]
        steps = max(path.shape[1] for path in paths)
        path = np.concatenate(
            [np.pad(p, ((0, 0), (0, steps - p.shape[1]), (0, 0)), "edge") for p in paths], axis=2
        )
    return Runs(start=start, dt=runs[0].dt, path=path, **joined)


def random_starts(world: World, n: int, seed: int, reaching: Potential | None = None) -> Pose:
    """Return n poses spread evenly over the free space, START_CLEARANCE clear, headings random.

    The space is the boundary's disc, one that holds the map, or one about the goal that holds all
    obstacles; of it, where there is a way to the goal as far as a potential knows. Raises
    GradnavError where hardly any of it is free.
    """
    rng = np.random.default_rng(seed)
    c_x, c_y, radius = extent(world)
    x, y = np.empty(0), np.empty(0)
    for _ in range(1000):
        if x.size >= n:
            break
        r, phi = radius * np.sqrt(rng.random(2 * n + 10)), 2.0 * np.pi * rng.random(2 * n + 10)
        try_x, try_y = c_x + r * np.cos(phi), c_y + r * np.sin(phi)
        free = np.greater_equal(world.clearance(try_x, try_y), START_CLEARANCE)
        if reaching is not None:
            free &= reaching.reaches(try_x, try_y)
        x, y = np.append(x, try_x[free]), np.append(y, try_y[free])
    else:
        raise GradnavError(f"no room for random starts {START_CLEARANCE} m clear of everything")
    return Pose.at(x[:n], y[:n], rng.uniform(-np.pi, np.pi, n))


def extent(world: World) -> tuple[float, float, float]:
    """Return centre x, y and radius [m] of the disc in which the world plays."""
    if world.bounded:
        region = world.boundary.region
        return (*region.centre, _reach(region, *region.centre))
    if world.walls is not None:
        x, y = world.walls.corners
        c_x, c_y = float(np.mean(x)), float(np.mean(y))
        return c_x, c_y, float(np.max(np.hypot(x - c_x, y - c_y)))
    goal_x, goal_y = world.goal
    reach = [_reach(shape, goal_x, goal_y) + 0.5 for shape in world.obstacles.values()]
    return goal_x, goal_y, max([2.0, *reach])


def _reach(shape: Shape, x: float, y: float) -> float:
    """Return how far a shape goes from (x, y) [m]."""
    outline_x, outline_y = shape.outline
    return float(np.max(np.hypot(outline_x - x, outline_y - y)))


def _keep_freed_memory() -> None:
    """Make steps of thousands of robots two to three times as fast.

    glibc gives the memory of freed large arrays back to the system, to get it again page by page
    at the next step. Once a block has been freed, it keeps for itself what is smaller.
    """
    np.empty(KEPT, dtype=np.uint8)


def _snapshot(pose: Pose) -> NDArray[np.float64]:
    return np.array([pose.x, pose.y, pose.theta])

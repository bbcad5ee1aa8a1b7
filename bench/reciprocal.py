# SPDX-License-Identifier: Apache-2.0
"""IR-SIM's reciprocal velocity obstacles (PyPI ir-sim, behaviour rvo) as a controller of ours.

Its velocity grid is 0.05 m/s, made for its default top speed of 1.5 m/s. Lengths are handed to it
scaled so that our top speed is its own: the geometry is the same and the grid fine enough. The
desired velocity is IR-SIM's: towards the goal at top speed.

It is made for robots that may move any way and heeds no turning, so a robot that turns grazes
obstacles by a millimetre or two. The table has it as it is, and told that the robot is a fifth
larger, the best of a few margins on worlds with other seeds than the table's.
"""

from dataclasses import dataclass, field

import numpy as np
from irsim.lib.behavior.behavior_methods import DiffRVO

from tbot_gradnav.controller import Controller
from tbot_gradnav.shapes import Circle
from tbot_gradnav.unicycle import Floats, Pose, Twist

ITS_SPEED = 1.5  # [m/s]
ITS_REACH = 10.0  # [m] within which it heeds obstacles; it is the whole arena in our lengths


@dataclass(frozen=True)
class Reciprocal(Controller):
    """The behaviour in place of a law, for one robot at a time: it knows its own velocity."""

    margin: float = 1.0  # times the robot's radius, as it is told
    velocity: dict[str, float] = field(default_factory=lambda: {"x": 0.0, "y": 0.0})

    def command(self, pose: Pose, gear: Floats) -> Twist:
        """Return the command of a single robot, given as arrays of one."""
        limits, world = self.settings.limits, self.settings.world
        scale = ITS_SPEED / limits.v
        x, y, cos, sin = (float(np.asarray(part).item()) for part in pose)
        if self.arrived(Pose(x, y, cos, sin)):
            return Twist(np.zeros(1), np.zeros(1))
        to_x, to_y = world.goal[0] - x, world.goal[1] - y
        towards = ITS_SPEED / max(float(np.hypot(to_x, to_y)), 1e-9)
        state = [
            *(scale * x, scale * y, scale * self.velocity["x"], scale * self.velocity["y"]),
            scale * world.robot_radius * self.margin,
            *(towards * to_x, towards * to_y, float(np.arctan2(sin, cos))),
        ]
        circles = [
            [scale * c.x, scale * c.y, 0.0, 0.0, scale * c.radius]
            for c in world.obstacles.values()
            if isinstance(c, Circle)
        ]
        wish = DiffRVO(
            *(state, circles, ITS_SPEED, ITS_SPEED, ITS_SPEED),
            neighbor_threshold=ITS_REACH,
        )
        v, omega = limits(float(wish[0, 0]) / scale, float(wish[1, 0]))
        self.velocity.update(x=float(v) * cos, y=float(v) * sin)
        return Twist(np.array([v]), np.array([omega]))

    def gear(self, pose: Pose) -> Floats:
        """Return forward, and forget the last drive."""
        self.velocity.update(x=0.0, y=0.0)
        return np.ones_like(pose.x)

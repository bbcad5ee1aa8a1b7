# SPDX-License-Identifier: Apache-2.0
"""What the robot's drive can do, and a command fitted into it without bending the path."""

from dataclasses import dataclass

from tbot_gradnav.elementwise import larger, magnitude, smaller
from tbot_gradnav.parameters import Checked, Number, field
from tbot_gradnav.unicycle import Floats, Twist


@dataclass(frozen=True)
class Limits(Checked):
    """Limits of a TurtleBot3 Burger; v and omega are always scaled by the same factor.

    A wheel runs at |v| + |omega| separation / 2 at most. Below `wheel_floor` the command is
    scaled up, since the driver truncates to 0.01 m/s and 0.01 rad/s and would leave the robot
    short of its goal.
    """

    v: float = field(0.2097, Number("top speed", "m/s", above=0.0, infinite=True))
    omega: float = field(2.635, Number("top turning speed", "rad/s", above=0.0, infinite=True))
    wheel: float = field(
        0.2097,
        Number("top of |v| + |omega| wheel_separation / 2", "m/s", above=0.0, infinite=True),
    )
    wheel_floor: float = field(
        0.02,
        Number("a slower command is scaled up to this; 0: never", "m/s", at_least=0.0),
    )
    wheel_separation: float = field(0.160, Number("distance between the wheels", "m", above=0.0))

    def __call__(self, v: Floats, omega: Floats) -> Twist:
        """Return the command scaled into what the drive can do, on the same path."""
        speed, turning = magnitude(v), magnitude(omega)
        wheel = speed + 0.5 * self.wheel_separation * turning
        demand = larger(larger(speed / self.v, turning / self.omega), wheel / self.wheel)
        raised = larger(1.0, self.wheel_floor / larger(wheel, 1e-150))
        scale = smaller(raised, 1.0 / larger(demand, 1e-150))
        return Twist(v * scale, omega * scale)

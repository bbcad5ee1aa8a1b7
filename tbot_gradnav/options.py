# SPDX-License-Identifier: Apache-2.0
"""What a parameter file says to the nodes besides law and world; and the whole file, checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tbot_gradnav.fake_lidar import LIDARS
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.parameters import (
    Checked,
    Choice,
    Flag,
    Integer,
    Number,
    Parameter,
    Text,
    build,
    field,
    parameters_of,
)
from tbot_gradnav.settings import Settings, settings_parameters

OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides.")


@dataclass(frozen=True)
class NavigatorOptions(Checked):
    """How the navigator deals with the graph around it."""

    cmd_vel_type: str = field(
        "auto",
        Choice(
            "type of cmd_vel; auto: whatever the subscriber wants",
            ("auto", "twist", "twist_stamped"),
        ),
    )
    odometry_timeout: float = field(
        0.5, Number("without odometry for this long the robot is stopped", "s", above=0.0)
    )
    world_frame: str = field("map", Text("frame of the goal and the obstacles"))
    publish_tf: bool = field(
        False, Flag("publish where odometry is in the world frame; not if AMCL or SLAM does")
    )


@dataclass(frozen=True)
class WatchdogOptions(Checked):
    """When commands are taken for broken off."""

    watchdog_timeout: float = field(
        0.5,
        Number("a robot told to drive is stopped without a command for this long", "s", above=0.0),
    )


def _strength(side: str) -> Number:
    return Number(
        f"share of its commanded speed that the {side} wheel reaches", at_least=0.1, at_most=1.0
    )


@dataclass(frozen=True)
class FakeRobotOptions(Checked):
    """How the fake robot differs from an ideal one."""

    rate: float = field(20.0, Number("rate of odometry", "Hz", at_least=0.1, at_most=1000.0))
    real_time_factor: float = field(
        1.0,
        Number("speed of time; other than 1, /clock is published", at_least=0.01, at_most=1000.0),
    )
    driver_quirks: bool = field(
        False, Flag("clamp, truncate to 0.01 and ignore wheel speeds as the real driver does")
    )
    lidar: str = field(
        "lds_02", Choice("whose LaserScan is published while somebody listens", tuple(LIDARS))
    )
    range_noise: float = field(
        0.0, Number("standard deviation of each range of the lidar", "m", at_least=0.0)
    )
    range_dropout: float = field(
        0.0, Number("share of the lidar's beams that are lost", at_least=0.0, at_most=1.0)
    )
    left_wheel: float = field(1.0, _strength("left"))
    right_wheel: float = field(1.0, _strength("right"))
    wheel_slip: float = field(
        0.0,
        Number(
            "share of the wheels' motion lost on the floor, which odometry takes for driven",
            at_least=0.0,
            at_most=0.9,
        ),
    )
    command_latency: float = field(
        0.0, Number("from a command's arrival to its effect", "s", at_least=0.0)
    )
    command_timeout: float = field(
        0.0,
        Number(
            "stop when no command came for this long; 0: never, as on the real robot",
            "s",
            at_least=0.0,
        ),
    )
    position_noise: float = field(
        0.0, Number("standard deviation of each odometry x and y", "m", at_least=0.0)
    )
    heading_noise: float = field(
        0.0, Number("standard deviation of each odometry heading", "rad", at_least=0.0)
    )
    odometry_drift: float = field(
        0.0,
        Number(
            "standard deviation of the odometry's scale errors, drawn once",
            at_least=0.0,
            at_most=0.5,
        ),
    )
    seed: int = field(0, Integer("seed of noise and drift"))


@dataclass(frozen=True)
class Configuration:
    """All that one parameter file says."""

    settings: Settings
    navigator: NavigatorOptions
    watchdog: WatchdogOptions
    fake_robot: FakeRobotOptions

    @classmethod
    def of(
        cls,
        values: Mapping[str, object],
        starting: bool = True,
        topic_map: Occupancy | None = None,
    ) -> "Configuration":
        """Return what parameters with dotted names describe. Raises GradnavError.

        The poses to start from must be free only while `starting`. A map that came by a topic
        serves where map.file names none.
        """
        rest = {name: value for name, value in values.items() if not name.startswith(OF_ROS)}
        options = (
            build(NavigatorOptions, rest),
            build(WatchdogOptions, rest),
            build(FakeRobotOptions, rest),
        )
        return cls(Settings.of(rest, OPTIONS, starting, topic_map), *options)


OPTIONS = (
    parameters_of(NavigatorOptions)
    | parameters_of(WatchdogOptions)
    | parameters_of(FakeRobotOptions)
)


def known_parameters(values: Mapping[str, object]) -> dict[str, tuple[Parameter, Any]]:
    """Return every parameter and its default, given which obstacles `values` name."""
    return settings_parameters(values) | OPTIONS

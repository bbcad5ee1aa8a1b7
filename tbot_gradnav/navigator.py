# SPDX-License-Identifier: Apache-2.0
"""The node that drives: odometry in, velocity out."""

import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from nav_msgs.msg import Odometry as OdometryMessage
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.subscription import Subscription
from sensor_msgs.msg import LaserScan

from tbot_gradnav import ros
from tbot_gradnav.changes import entries, merged, waiting
from tbot_gradnav.command_publisher import CommandPublisher
from tbot_gradnav.company import Company
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.goals import Goals
from tbot_gradnav.health import Health
from tbot_gradnav.journal import Journal
from tbot_gradnav.lidar import BadScanError, Sweep
from tbot_gradnav.map_topic import MapTopic
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.odometry import BadOdometryError, Reading
from tbot_gradnav.options import Configuration
from tbot_gradnav.supervision import Supervision
from tbot_gradnav.transforms import WorldTransform
from tbot_gradnav.unicycle import STOP
from tbot_gradnav.visuals import Visuals

# decided when the node starts
FIXED = ("initial_pose", "cmd_vel_type", "world_frame", "publish_tf")
CHECK_PERIOD = 0.06  # [s] between looks at the age of the odometry, begun anew by each message
RECOVERY = 1.0  # [s] of good odometry before an interruption is over
PATIENCE = 5.0  # [s] for the first odometry; discovery may take 2.5 s


class Navigator(Node):
    """Drives to the goal of its parameters, of goal_pose or of waypoints.

    Subscribes odom (nav_msgs/Odometry), publishes cmd_vel; see also Goals, Supervision, Health and
    Visuals. Whatever is unusual ends in zero velocity first and a word after. Raises
    GradnavError for parameters that are not allowed.
    """

    def __init__(self, **node_arguments: Any) -> None:
        super().__init__(
            "navigator",
            automatically_declare_parameters_from_overrides=True,
            allow_undeclared_parameters=True,
            **node_arguments,
        )
        self._configuration = ros.declare(self, fixed=FIXED)
        options = self._configuration.navigator
        self._navigation = Navigation(self._configuration.settings, options.world_frame)
        if self._navigation.has_drive and self._navigation.potential.ready:
            # What takes long is done before odometry comes.
            self._navigation.potential(*self._configuration.settings.initial_pose[:2])
        self._navigation.in_background()  # and all that comes after
        self._commands = CommandPublisher(self, options.cmd_vel_type)
        self._company = Company(self)
        self._checked = self._configuration  # parameters that have passed, to be taken next
        # Safety hangs on a clock that nobody sets and that never stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._heard = self._seconds()  # when the last odometry came, good or bad, or the start
        self._sound_since: float | None = None  # since when odometry has been good
        self._interrupted = False
        self._journal = Journal(self)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._odometry = self.create_subscription(OdometryMessage, "odom", self._on_odometry, 10)
        self._goals = Goals(self, self._navigation, self._halt)
        self._supervision = Supervision(self, self._navigation, self._halt, self._goals.forget)
        self._health = Health(
            self,
            self._navigation,
            lambda: self._seconds() - self._heard,
            lambda: self._goals.refusal,
        )
        transform = WorldTransform(self, self._navigation.odometry) if options.publish_tf else None
        self._visuals = Visuals(self, self._navigation, transform)
        self._lidar: Subscription | None = None
        self._map: Occupancy | None = None  # the last that came by the topic
        self._maps: MapTopic | None = None
        self._listen()
        self._check = self.create_timer(CHECK_PERIOD, self._check_odometry, clock=steady)
        self._introduce()

    def _halt(self) -> None:
        self._commands.publish(STOP)

    def close(self) -> None:
        """Stop the robot, for good."""
        self._halt()
        self._commands.flush()
        self.get_logger().info("stopped: zero velocity published")

    def _on_odometry(self, message: OdometryMessage) -> None:
        reading = Reading.of(message)
        if self._navigation.odometry.repeats(reading):
            self._journal.warn(
                "repeats", "odometry repeats its last message: does the driver hang?"
            )
            return
        self._heard, began = self._seconds(), time.perf_counter()
        self._check.reset()
        try:
            _, twist, notices = self._navigation.update(reading)
            if twist is not None:
                self._commands.publish(twist)
            self._health.note(twist or STOP, time.perf_counter() - began)
        except BadOdometryError as error:
            self._stop("bad odometry", str(error))
            return
        except Exception as error:  # whatever it is, the robot must not drive on
            self._stop("error", f"{type(error).__name__}: {error}")
            return
        self._resume()
        self._supervision.announce()
        for notice in notices:
            self._journal.tell(notice)

    def _listen(self) -> None:
        """Subscribe scan and map while the potential needs them."""
        awaits = self._configuration.settings.awaits_map
        if awaits and self._maps is None:
            frame = self._configuration.navigator.world_frame
            self._maps = MapTopic(self, frame, self._on_map)
        elif self._maps is not None and not awaits:
            self._maps.close()
            self._maps = self._map = None
        looks = self._configuration.settings.chosen_potential.looks
        if looks and self._lidar is None:
            self._lidar = self.create_subscription(
                LaserScan, "scan", self._on_scan, qos_profile_sensor_data
            )
        elif self._lidar is not None and not looks:
            self.destroy_subscription(self._lidar)
            self._lidar = None

    def _on_scan(self, message: LaserScan) -> None:
        try:
            self._navigation.see(Sweep.of(message))
        except BadScanError as error:
            self._journal.warn("bad scan", str(error))

    def _on_map(self, occupancy: Occupancy) -> None:
        """Go on in another map, without the goal if there is no way to it."""
        self._map = occupancy
        try:
            self._checked = self._changed([])
        except GradnavError as error:
            self.get_logger().error(f"goal given up in a new map: {error}")
            with suppress(GradnavError):  # there may be none, or the parameters may be refused
                self._goals.forget()
            return
        self._take_parameters([])
        self.get_logger().info(f"a map of {occupancy.worded} came")

    def _resume(self) -> None:
        """Note that good odometry came; say so once it has come for a while."""
        if self._sound_since is None:
            self._sound_since = self._heard
        if self._interrupted and self._heard - self._sound_since > RECOVERY:
            self._interrupted = False
            self.get_logger().info("good odometry again: going on")

    def _check_odometry(self) -> None:
        silent = self._seconds() - self._heard
        if self._navigation.odometry.frame is None:
            if silent > PATIENCE and self._navigation.state is not State.PAUSED:
                self._journal.warn(
                    "waiting", f"no odometry on {self._odometry.topic_name}: is the robot up?"
                )
            return
        timeout = self._configuration.navigator.odometry_timeout
        if silent > timeout and self._sound_since is not None:
            self._stop("stale", f"no odometry for {timeout:g} s")

    def _stop(self, kind: str, text: str) -> None:
        """Publish zero velocity, then say why."""
        if self._navigation.settings.has_goal:
            self._halt()
        self._navigation.lose_odometry()
        self._supervision.announce()
        self._sound_since, self._interrupted = None, True
        self._journal.fail(kind, text)

    def _check_parameters(self, parameters: list[RosParameter]) -> SetParametersResult:
        try:
            self._checked = self._changed(parameters)
        except GradnavError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_parameters(self, parameters: list[RosParameter]) -> None:
        before, self._configuration = self._configuration.settings, self._checked
        settings = self._configuration.settings
        self._navigation.change(settings)
        self._listen()
        self._supervision.announce()
        self._describe_obstacles([p.name for p in parameters if p.value is not None])
        if settings.goal != before.goal:
            self._goals.wait_no_more()
            self.get_logger().info(f"new goal: {_worded(settings.goal)}")
        for caution in set(settings.cautions) - set(before.cautions):
            self.get_logger().warning(caution)

    def _describe_obstacles(self, names: list[str]) -> None:
        """Describe those of the parameters that are obstacles', and say which have no effect."""
        obstacles = entries(names)
        ros.describe(self, obstacles)
        aside = waiting(obstacles, ros.values(self))
        if aside:
            self.get_logger().info(f"{', '.join(aside)}: kept until it is in obstacles.names")

    def _changed(self, parameters: list[RosParameter]) -> Configuration:
        """Return the configuration with some parameters changed. Raises GradnavError.

        That may take a moment (navigation_function.k: 0 tries several), so the robot stands.
        """
        if self._navigation.has_drive:
            self._halt()
        changes = {p.name: ros.plain(p.value) for p in parameters}
        values = merged(ros.values(self), changes)
        configuration = Configuration.of(values, starting=False, topic_map=self._map)
        settings = configuration.settings
        pose = self._navigation.pose or settings.start
        settings.refuse_unreachable(float(pose.x), float(pose.y))
        return configuration

    def _introduce(self) -> None:
        settings = self._configuration.settings
        potential = settings.chosen_potential.worded(settings.potential)
        self.get_logger().info(
            f"law {settings.law}, potential {potential}, {len(settings.obstacles)} obstacles; "
            f"goal: {_worded(settings.goal)}"
        )
        for caution in settings.cautions:
            self.get_logger().warning(caution)

    def _seconds(self) -> float:
        return time.monotonic()  # rclpy's steady clock, at a fiftieth of its cost


def _worded(goal: Sequence[float]) -> str:
    if not goal:
        return "none, waiting for goal_pose"
    yaw = f", {goal[2]:g} rad" if len(goal) == 3 else ""
    return f"({goal[0]:g}, {goal[1]:g}) m{yaw}"


def main(arguments: Sequence[str] = sys.argv) -> int:
    """Run the navigator until a signal; return the exit status."""
    return ros.run(Navigator, Navigator.close, arguments)


if __name__ == "__main__":
    sys.exit(main())

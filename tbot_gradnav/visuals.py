# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show of a drive."""

import math
import threading
from typing import Any

from geometry_msgs.msg import PoseStamped, Quaternion
from nav_msgs.msg import OccupancyGrid, Path
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from tbot_gradnav import markers
from tbot_gradnav.navigation import Navigation
from tbot_gradnav.potentials import Potential
from tbot_gradnav.raster import Raster, raster
from tbot_gradnav.ros import LATCHED
from tbot_gradnav.settings import Settings
from tbot_gradnav.transforms import WorldTransform
from tbot_gradnav.unicycle import quaternion

PERIOD = 0.2  # [s]
IDLE_PERIOD = 0.5  # [s] while nobody listens
PATH_PERIOD = 5  # ticks between two publications of the driven path
STRIDE = 0.05  # [m] between two poses of it
LONGEST = 1000  # poses of it; the oldest are dropped


class Visuals:
    """Publishes markers, driven_path and potential from a timer; nothing that nobody listens to.

    Obstacles, boundary, waypoints and goal are sent again only when they change or somebody new
    listens; the vectors at the robot with every tick. The potential is computed in a thread of
    its own, since a thousand obstacles take seconds.
    """

    def __init__(
        self, node: Node, navigation: Navigation, transform: WorldTransform | None
    ) -> None:
        self._node, self._navigation, self._transform = node, navigation, transform
        self._frame, _ = navigation.odometry.frame_names
        self._markers = node.create_publisher(MarkerArray, "markers", 10)
        self._driven = node.create_publisher(Path, "driven_path", 10)
        self._potential = node.create_publisher(OccupancyGrid, "potential", LATCHED)
        self._listeners = 0  # to the markers
        self._shown: list[Marker] = []  # of the world
        self._settings: Settings | None = None  # which they show
        self._path = Path()
        self._ticks = 0
        self._rastered: Potential | None = None  # published or being computed
        self._raster: Raster | None = None  # computed, to be published
        self._thread: threading.Thread | None = None  # that computes
        self._timer = node.create_timer(
            IDLE_PERIOD, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def _tick(self) -> None:
        self._ticks += 1
        if self._transform is not None:
            self._transform.update()
        self._show_path()
        self._show_markers()
        self._show_potential()
        listened = self._listeners or self._driven.get_subscription_count()
        period = round(1e9 * (PERIOD if listened else IDLE_PERIOD))
        if self._timer.timer_period_ns != period:
            self._timer.timer_period_ns = period

    def _show_markers(self) -> None:
        before, self._listeners = self._listeners, self._markers.get_subscription_count()
        if not self._listeners:
            return
        settings, pose = self._navigation.settings, self._navigation.pose
        sent = []
        if settings is not self._settings:
            world = markers.of_world(settings)
            there = set(map(markers.identity, world))
            sent += markers.removed(m for m in self._shown if markers.identity(m) not in there)
            self._shown, self._settings = world, settings
            sent += world
        elif self._listeners > before:
            sent += self._shown
        if pose is not None:
            potential = self._navigation.potential
            driving = self._navigation.has_drive and potential.ready
            arrows = markers.of_robot(potential, pose, driving)
            sent += arrows
        header = self._header()
        for marker in sent:
            marker.header = header
        self._markers.publish(MarkerArray(markers=sent))

    def _show_path(self) -> None:
        pose, poses = self._navigation.pose, self._path.poses
        if pose is None:
            return
        last = poses[-1].pose.position if poses else None
        if last is None or math.hypot(pose.x - last.x, pose.y - last.y) >= STRIDE:
            stamped = PoseStamped(header=self._header())
            stamped.pose.position.x, stamped.pose.position.y = float(pose.x), float(pose.y)
            q_z, q_w = quaternion(float(pose.theta))
            stamped.pose.orientation = Quaternion(z=q_z, w=q_w)
            poses.append(stamped)
            del poses[:-LONGEST]
        if self._ticks % PATH_PERIOD == 0 and self._driven.get_subscription_count():
            self._path.header = self._header()
            self._driven.publish(self._path)

    def _show_potential(self) -> None:
        if self._raster is not None:
            self._publish_raster(self._raster)
            self._raster, self._thread = None, None
        potential = self._navigation.potential
        if (
            self._thread is not None
            or potential.world is getattr(self._rastered, "world", None)
            or potential.looks  # it changes with every scan
            or not potential.ready
            or not self._navigation.settings.has_goal
            or not self._potential.get_subscription_count()
        ):
            return
        self._rastered = potential
        self._thread = threading.Thread(target=self._compute, args=(potential,), daemon=True)
        self._thread.start()

    def _compute(self, potential: Potential) -> None:
        self._raster = raster(potential)

    def _publish_raster(self, found: Raster) -> None:
        grid = OccupancyGrid(header=self._header())
        grid.info.map_load_time = grid.header.stamp
        grid.info.resolution = found.resolution
        grid.info.height, grid.info.width = found.levels.shape
        grid.info.origin.position.x, grid.info.origin.position.y = found.x, found.y
        grid.info.origin.orientation.w = 1.0
        grid.data = found.levels.ravel().tolist()
        self._potential.publish(grid)

    def _header(self) -> Any:
        return Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)

# SPDX-License-Identifier: Apache-2.0
"""From odometry messages to the pose in the world, whatever the messages look like."""

import math
from collections import deque
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.limits import Limits
from tbot_gradnav.unicycle import Pose, has_heading, heading

FAR = 1e6  # [m] no odometry of a small robot is beyond
JUMP_DISTANCE = 0.1  # [m] more than twice what the limits allow, plus this, is a jump
JUMP_ANGLE = 0.3  # [rad] likewise
HOLE = 1.0  # [s] between two stamps
MEMORY = 2.0  # [s] for which the poses are kept
BEGUN = 0.05  # [m], [rad] at most from where odometry begins, for one that has just begun
LARGEST_NORM = 1.1  # of a quaternion that is not given in degrees
COS_TILT = math.cos(math.radians(30.0))


class Reading(NamedTuple):
    """What is used of one odometry message: stamp [s], position [m], quaternion and frame."""

    stamp: float
    x: float
    y: float
    q_x: float
    q_y: float
    q_z: float
    q_w: float
    frame: str = "odom"

    @classmethod
    def of(cls, message: Any) -> "Reading":
        """Return what is used of a nav_msgs/Odometry, whichever library decoded it."""
        stamp, position = message.header.stamp, message.pose.pose.position
        q = message.pose.pose.orientation
        seconds = stamp.sec + stamp.nanosec * 1e-9
        frame = message.header.frame_id
        return cls(seconds, position.x, position.y, q.x, q.y, q.z, q.w, frame)


class GoalPose(NamedTuple):
    """What is used of a goal message; a quaternion of zeros asks for no orientation."""

    frame: str
    x: float
    y: float
    q_z: float
    q_w: float

    @classmethod
    def of(cls, message: Any) -> "GoalPose":
        """Return what is used of a geometry_msgs/PoseStamped, whichever library decoded it."""
        position, q = message.pose.position, message.pose.orientation
        return cls(message.header.frame_id, position.x, position.y, q.z, q.w)


Route: TypeAlias = list[GoalPose]  # the goal, after the waypoints on the way to it


def route(message: Any) -> Route:
    """Return what is used of a geometry_msgs/PoseStamped or nav_msgs/Path.

    Raises GradnavError for a path without poses, or in more than one frame.
    """
    if not hasattr(message, "poses"):
        return [GoalPose.of(message)]
    frame = message.header.frame_id
    poses = [GoalPose.of(pose) for pose in message.poses]
    if not poses:
        raise GradnavError("a path without poses; to stop, call the service cancel")
    if {pose.frame for pose in poses} - {"", frame}:
        raise GradnavError("the poses of a path must be in the frame of the path")
    return [pose._replace(frame=frame) for pose in poses]


class Notice(NamedTuple):
    """Something worth a word: its kind, so that it can be said once or counted, and the word."""

    kind: str
    text: str


class BadOdometryError(GradnavError):
    """A message from which no pose can be had; the robot must stop."""


class Odometry:
    """The robot's pose in the world, xi(0) plus odometry since the first message.

    REP 105 asks an odometry frame to be continuous, so a pose that jumps further than the robot
    can have moved is a reset: the robot is where it was, and the frame has moved. So is one at the
    frame's origin after a hole: drivers begin there, and a robot hardly ever returns to it.
    """

    def __init__(self, initial: Pose, limits: Limits, world_frame: str = "map") -> None:
        self.frame: Pose | None = None  # pose of the odometry frame in the world
        self._frame_names = (world_frame, "odom")
        self._initial = initial
        self.limits = limits  # beyond which a motion is a jump
        self._last: tuple[float, Pose] | None = None
        self._last_reading: Reading | None = None
        self._past: deque[tuple[float, Pose]] = deque()  # without jumps

    def update(self, reading: Reading) -> tuple[Pose, list[Notice]]:
        """Return the pose in the world and what stands out. Raises BadOdometryError."""
        pose = _decoded(reading)
        notices = list(self._compared(reading.stamp, pose)) + list(_tilted(reading))
        if self.frame is None:
            self.frame = self._initial.compose(pose.inverse())
        self._last = reading.stamp, pose
        self._last_reading = reading
        if any(notice.kind in ("jump", "backward", "repeated") for notice in notices):
            self._past.clear()
        self._past.append(self._last)
        while self._past[0][0] < reading.stamp - MEMORY:
            self._past.popleft()
        self._frame_names = self._frame_names[0], reading.frame
        return self.frame.compose(pose), notices

    def repeats(self, reading: Reading) -> bool:
        """Return whether a message is the last one again: no sign that anybody measures."""
        return reading == self._last_reading

    def at(self, stamp: float) -> Pose | None:
        """Return the pose in the world at a time [s] between recent messages, None at another."""
        if self.frame is None or not self._past[0][0] <= stamp <= self._past[-1][0]:
            return None
        stamps = [s for s, _ in self._past]
        x, y, cos, sin = (
            float(np.interp(stamp, stamps, part))
            for part in zip(*(p for _, p in self._past), strict=True)
        )
        norm = math.hypot(cos, sin)
        return self.frame.compose(Pose(x, y, cos / norm, sin / norm))

    @property
    def frame_names(self) -> tuple[str, str]:
        """Names of the world frame and of the odometry frame."""
        return self._frame_names

    def in_world(self, route: Route) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return goal and waypoints in the world frame, as the parameters of these names have them.

        Raises GradnavError for an unknown frame.
        """
        *waypoints, goal = map(self._in_world, route)
        return goal, tuple(value for point in waypoints for value in point[:2])

    def _in_world(self, goal: GoalPose) -> tuple[float, ...]:
        """Return x, y [m] and, where there is an orientation, yaw [rad]."""
        world, odometry = self._frame_names
        norm = math.hypot(goal.q_z, goal.q_w)
        if not norm < LARGEST_NORM:
            raise GradnavError(f"the orientation has norm {norm:g}; must be a quaternion, or zeros")
        turned = has_heading(goal.q_z, goal.q_w)
        pose = Pose(goal.x, goal.y, *(heading(goal.q_z, goal.q_w) if turned else (1.0, 0.0)))
        if goal.frame not in ("", world):
            if goal.frame != odometry:
                raise GradnavError(
                    f"frame {goal.frame} is unknown here; it must be {world} or {odometry}"
                )
            if self.frame is None:
                raise GradnavError(f"frame {odometry} is unknown before the first odometry")
            pose = self.frame.compose(pose)
        place = float(pose.x), float(pose.y)
        return (*place, float(pose.theta)) if turned else place

    def _compared(self, stamp: float, pose: Pose) -> list[Notice]:
        """Return notices about a message as compared to the last; move the frame on a jump."""
        if self.frame is None or self._last is None:
            return []
        notices = []
        last_stamp, last = self._last
        dt = stamp - last_stamp
        if dt < 0.0:
            notices.append(Notice("backward", f"odometry stamps go back by {-dt:.3g} s"))
        if dt == 0.0:
            notices.append(Notice("repeated", f"an odometry stamp ({stamp:.9g} s) is repeated"))
        if dt > HOLE:
            notices.append(Notice("hole", f"no odometry for {dt:.3g} s by its stamps"))
        moved = last.inverse().compose(pose)
        distance, angle = _size(moved)
        anew = dt > HOLE and max(_size(pose)) <= BEGUN
        driven = 0.0 if anew else dt
        if distance > _possible(JUMP_DISTANCE, self.limits.v, driven) or angle > _possible(
            JUMP_ANGLE, self.limits.omega, driven
        ):
            self.frame = self.frame.compose(last).compose(pose.inverse())
            notices.append(
                Notice(
                    "jump",
                    f"odometry jumped {distance:.3g} m, {angle:.3g} rad in {dt:.3g} s: taken for "
                    "a reset of its frame, the robot for standing still",
                )
            )
        return notices


def _size(pose: Pose) -> tuple[float, float]:
    """Return how far [m] and by how much [rad] a pose is from the origin."""
    return math.hypot(pose.x, pose.y), abs(math.atan2(pose.sin, pose.cos))


def _possible(slack: float, limit: float, dt: float) -> float:
    """Return how far a robot may be seen to move in dt [s], which may be 0 or negative."""
    return slack + 2.0 * limit * dt if dt > 0.0 else slack


def _decoded(reading: Reading) -> Pose:
    """Return the pose in the odometry frame. Raises BadOdometryError."""
    if not all(map(math.isfinite, reading[:-1])):
        raise BadOdometryError(f"odometry is not finite: {_worded(reading)}")
    if max(abs(reading.x), abs(reading.y)) > FAR:
        raise BadOdometryError(f"odometry is impossibly far away: {_worded(reading)}")
    _, _, q_z, q_w = _scaled(reading)
    if not has_heading(q_z, q_w):
        raise BadOdometryError(f"odometry has no heading: {_worded(reading)}")
    return Pose(reading.x, reading.y, *heading(q_z, q_w))


def _tilted(reading: Reading) -> list[Notice]:
    x2, y2, z2, w2 = (component * component for component in _scaled(reading))
    cos_tilt = (w2 + z2 - x2 - y2) / (w2 + z2 + x2 + y2)
    if cos_tilt >= COS_TILT:
        return []
    degrees = math.degrees(math.acos(max(cos_tilt, -1.0)))
    return [Notice("tilt", f"odometry says the robot is tilted by {degrees:.0f} degrees")]


def _scaled(reading: Reading) -> tuple[float, float, float, float]:
    """Return the quaternion with its largest component 1, whatever its norm was."""
    q = reading.q_x, reading.q_y, reading.q_z, reading.q_w
    largest = max(map(abs, q)) or 1.0
    return q[0] / largest, q[1] / largest, q[2] / largest, q[3] / largest


def _worded(reading: Reading) -> str:
    return (
        f"x {reading.x:g}, y {reading.y:g}, quaternion ({reading.q_x:g}, {reading.q_y:g}, "
        f"{reading.q_z:g}, {reading.q_w:g})"
    )

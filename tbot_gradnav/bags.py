# SPDX-License-Identifier: Apache-2.0
"""Recorded robots: what of a bag the controller needs, in order, a message at a time."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.lidar import Sweep
from tbot_gradnav.navigation import State
from tbot_gradnav.odometry import Reading, Route, route
from tbot_gradnav.unicycle import Twist

TOPICS = {
    "/odom": ("nav_msgs/msg/Odometry",),
    "/cmd_vel": ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"),
    "/goal_pose": ("geometry_msgs/msg/PoseStamped",),
    "/waypoints": ("nav_msgs/msg/Path",),
    "/state": ("std_msgs/msg/String",),
    "/scan": ("sensor_msgs/msg/LaserScan",),
}
Content: TypeAlias = Reading | Twist | Route | State | Sweep | GradnavError | None
COMMON_NAMES = ("/waypoints", "/state")  # others use them for other things
STORAGE = (".mcap", ".db3")


class Event(NamedTuple):
    """A message of a bag: when it was recorded [ns], what of it is used, and the whole in CDR."""

    recorded: int
    content: Content
    cdr: bytes


class Bag:
    """An open bag (rosbag2 sqlite3 or mcap, ROS 1), of a robot in any namespace."""

    def __init__(self, path: Path, reader: Any) -> None:
        self._path = path
        self._reader = reader
        self._namespace = _namespace({c.topic for c in reader.connections})
        self._connections = [c for c in reader.connections if self._is_used(c)]
        if not self.count("/odom"):
            topics = ", ".join(sorted({c.topic for c in reader.connections})) or "none"
            raise GradnavError(f"{path}: no messages on topic /odom (topics: {topics})")

    def _is_used(self, connection: Any) -> bool:
        """Return whether a topic matters here. Raises GradnavError if so, but of another type."""
        name, kind = self._name(connection), connection.msgtype
        kinds = TOPICS.get(name, ())
        if kind in kinds:
            return True
        if not kinds or name in COMMON_NAMES:
            return False
        raise GradnavError(
            f"{self._path}: topic {connection.topic} is of type {kind}; must be "
            + " or ".join(kinds)
        )

    def _name(self, connection: Any) -> str:
        """Return the name of a topic as TOPICS has it."""
        return str(connection.topic).removeprefix(self._namespace)

    @property
    def start(self) -> int:
        """The time [ns] of the first message of any topic."""
        return int(self._reader.start_time)

    @property
    def duration(self) -> float:
        """Time [s] from the first to the last message of any topic."""
        return float(self._reader.duration) * 1e-9

    def count(self, topic: str) -> int:
        """Return how many messages a topic has, by the bag's own account."""
        return sum(c.msgcount for c in self._connections if self._name(c) == topic)

    def events(self, scans: bool = False) -> Iterator[Event]:
        """Yield the messages in the order of their recording, those of /scan only if wanted.

        Raises GradnavError if the bag is damaged.
        """
        wanted = [c for c in self._connections if scans or self._name(c) != "/scan"]
        for connection, recorded, data in _undamaged(self._path, self._reader.messages(wanted)):
            try:
                message = self._reader.deserialize(data, connection.msgtype)
                cdr = data if self._reader.is2 else self._cdr(data, connection.msgtype)
            except Exception as error:  # of whatever kind a broken message brings about
                raise _damaged(self._path, error) from error
            try:
                content = _content(self._name(connection), message)
            except GradnavError as error:
                content = error
            yield Event(recorded, content, cdr)

    def _cdr(self, ros1: bytes, kind: str) -> bytes:
        return bytes(self._reader.default_typestore.ros1_to_cdr(ros1, kind))


def _namespace(topics: set[str]) -> str:
    """Return the namespace of the only robot in a bag; "" where there is none, or several."""
    robots = [topic.removesuffix("/odom") for topic in topics if topic.endswith("/odom")]
    return robots[0] if len(robots) == 1 else ""


@contextmanager
def opened(path: Path | str) -> Iterator[Bag]:
    """Give the bag at a path: a rosbag2 folder, a single .mcap or .db3 file, or a ROS 1 .bag.

    Raises GradnavError where there is none, it is damaged, or it has no odometry.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise GradnavError("bags need rosbags: pip install tbot_gradnav[bags]") from error
    target = Path(path)
    if not target.exists():
        raise GradnavError(f"{target}: no such bag")
    # bags of Humble and before hold no type definitions
    reader = AnyReader(_readable(target), default_typestore=get_typestore(Stores.ROS2_HUMBLE))
    try:
        reader.open()
    except Exception as error:  # rosbags, sqlite and mcap have many kinds
        raise _damaged(target, error) from error
    try:
        yield Bag(target, reader)
    finally:
        reader.close()


def _readable(path: Path) -> list[Path]:
    """Return what to open: the folder, or its files where metadata.yaml is missing or wrong."""
    if path.is_file():
        if path.suffix not in (*STORAGE, ".bag"):
            raise GradnavError(f"{path}: no bag; must be a folder, .mcap, .db3 or .bag")
        return [path]
    files = sorted(file for file in path.iterdir() if file.suffix in STORAGE)
    if not files and not (path / "metadata.yaml").is_file():
        raise GradnavError(f"{path}: no bag; it holds no metadata.yaml, .mcap or .db3")
    metadata = path / "metadata.yaml"
    known = metadata.is_file() and all(
        file.name in metadata.read_text(encoding="utf-8", errors="replace") for file in files
    )
    return [path] if known or not files else files


def _undamaged(path: Path, messages: Iterator[Any]) -> Iterator[Any]:
    try:
        yield from messages
    except GradnavError:
        raise
    except Exception as error:  # rosbags, sqlite and mcap have many kinds
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> GradnavError:
    what = " ".join(str(error).split())[:120] or type(error).__name__
    return GradnavError(f"{path}: the bag is damaged or of an unknown kind: {what}")


def _content(topic: str, message: Any) -> Content:
    if topic == "/odom":
        return Reading.of(message)
    if topic == "/scan":
        return Sweep.of(message)
    if topic in ("/goal_pose", "/waypoints"):
        return route(message)
    if topic == "/state":
        return next((state for state in State if state.value == message.data), None)
    twist = message.twist if hasattr(message, "twist") else message
    return Twist(twist.linear.x, twist.angular.z)

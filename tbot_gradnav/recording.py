# SPDX-License-Identifier: Apache-2.0
"""A bag written whole or not at all."""

import math
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.odometry import Reading
from tbot_gradnav.unicycle import Twist


class Recorder:
    """Writes serialised messages to the topics of an open bag."""

    def __init__(self, writer: Any, typestore: Any) -> None:
        self._writer = writer
        self._typestore = typestore
        self._connections: dict[str, Any] = {}

    def write_command(self, stamp: int, twist: Twist) -> None:
        """Append a command to /cmd_vel as Twist at time `stamp` [ns]."""
        types = self._typestore.types
        vector, kind = types["geometry_msgs/msg/Vector3"], "geometry_msgs/msg/Twist"
        message = types[kind](
            linear=vector(float(twist.v), 0.0, 0.0), angular=vector(0.0, 0.0, float(twist.omega))
        )
        data = self._typestore.serialize_cdr(message, kind)
        self.write("/cmd_vel", kind, stamp, bytes(data))

    def write_odometry(self, stamp: int, reading: Reading) -> None:
        """Append a reading to /odom as nav_msgs/Odometry at time `stamp` [ns]."""
        types, kind = self._typestore.types, "nav_msgs/msg/Odometry"
        pose, zero = types["geometry_msgs/msg/Pose"], types["geometry_msgs/msg/Vector3"](0, 0, 0)
        seconds = math.floor(reading.stamp)
        time = types["builtin_interfaces/msg/Time"](
            seconds, min(round((reading.stamp - seconds) * 1e9), 999_999_999)
        )
        message = types[kind](
            header=types["std_msgs/msg/Header"](time, reading.frame),
            child_frame_id="base_footprint",
            pose=types["geometry_msgs/msg/PoseWithCovariance"](
                pose(
                    types["geometry_msgs/msg/Point"](reading.x, reading.y, 0.0),
                    types["geometry_msgs/msg/Quaternion"](*reading[3:7]),
                ),
                np.zeros(36),
            ),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](
                types["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36)
            ),
        )
        self.write("/odom", kind, stamp, bytes(self._typestore.serialize_cdr(message, kind)))

    def write_text(self, topic: str, stamp: int, text: str) -> None:
        """Append a std_msgs/String to a topic at time `stamp` [ns]."""
        kind = "std_msgs/msg/String"
        message = self._typestore.types[kind](text)
        self.write(topic, kind, stamp, bytes(self._typestore.serialize_cdr(message, kind)))

    def write(self, topic: str, kind: str, stamp: int, data: bytes) -> None:
        """Append a message in CDR of type `kind` at time `stamp` [ns]."""
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._typestore
            )
        self._writer.write(self._connections[topic], stamp, data)


def refuse_other_than_bag(path: Path) -> None:
    """Raise GradnavError if there is something at `path` that is no bag."""
    if path.exists() and not (path / "metadata.yaml").is_file():
        raise GradnavError(f"{path}: it exists and is no bag; it is left alone")


@contextmanager
def recording(path: Path | str) -> Iterator[Recorder]:
    """Give a Recorder to a new bag (rosbag2, mcap), which replaces `path` if all goes well.

    Raises GradnavError where rosbags is missing, `path` is something else than a bag, or it
    cannot be written.
    """
    try:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise GradnavError("bags need rosbags: pip install tbot_gradnav[bags]") from error
    target = Path(path)
    refuse_other_than_bag(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".gradnav-", dir=target.parent) as folder:
            unfinished = Path(folder) / target.name
            writer = Writer(unfinished, version=9, storage_plugin=StoragePlugin.MCAP)
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            with writer:
                yield Recorder(writer, get_typestore(Stores.ROS2_JAZZY))
            if target.exists():
                shutil.rmtree(target)
            unfinished.rename(target)
    except OSError as error:
        raise GradnavError(f"{target}: it cannot be written: {error.strerror}") from error

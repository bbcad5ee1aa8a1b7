# SPDX-License-Identifier: Apache-2.0
"""Odometry that other people's robots recorded, played to the navigator in its own time."""

import math
import os
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from conftest import ros_graph

pytest.importorskip("rclpy", reason="needs ROS 2")
rosbags = pytest.importorskip("rosbags", reason="needs rosbags")

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

RECORDINGS = Path(os.environ.get("GRADNAV_RECORDINGS", "recordings"))  # they are not ours to ship

COUNTS = {
    "tb3_waffle_pi_gazebo_walker": 543,
    "tb3_waffle_gazebo_contact": 788,
    "neato_real_square": 194,
}


def odometry(recording):
    """Return (seconds since the first by its stamps, message) of a bag's /odom."""
    with AnyReader([recording], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        connections = [c for c in bag.connections if c.topic == "/odom"]
        data = [data for _, _, data in bag.messages(connections=connections)]
    messages = [deserialize_message(cdr, Odometry) for cdr in data]
    seconds = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in messages]
    return [(s - seconds[0], m) for s, m in zip(seconds, messages, strict=True)]


class Playback:
    """A recording on a graph of its own, with a navigator that drives by it."""

    def __init__(self, graph, name, file):
        self.graph = graph
        self.messages = odometry(RECORDINGS / name)
        self.heard = self.graph.listen(Twist, "cmd_vel")
        self.publisher = self.graph.node.create_publisher(Odometry, "odom", 100)
        self.drive = self.graph.start("navigator", "--ros-args", "--params-file", file)
        self.played = 0

    def wait_for_the_navigator(self):
        node = self.graph.node
        self.graph.until(lambda: self.publisher.get_subscription_count() == 1, "navigator")
        self.graph.until(lambda: node.count_publishers("cmd_vel") == 1, "cmd_vel")

    def advance(self, seconds):
        """Play all that is due; return whether there is more."""
        while self.played < len(self.messages) and self.messages[self.played][0] <= seconds:
            self.publisher.publish(self.messages[self.played][1])
            self.played += 1
        self.graph.spin(0.005)
        return self.played < len(self.messages)


@pytest.fixture
def playbacks(tmp_path, parameter_file):
    """Give every recording, ready to play."""
    if not RECORDINGS.is_dir():
        pytest.skip("GRADNAV_RECORDINGS names no folder")
    file = parameter_file("goal: [40, 30]")
    with ExitStack() as stack:
        found = {}
        for name in COUNTS:
            (tmp_path / name).mkdir()
            graph = stack.enter_context(ros_graph(tmp_path / name))
            found[name] = Playback(graph, name, file)
        yield found


def test_every_message_of_a_recording_gets_a_sound_command(playbacks):
    for playback in playbacks.values():
        playback.wait_for_the_navigator()
    begin = time.monotonic()
    playing = list(playbacks.values())
    while playing:
        playing = [p for p in playing if p.advance(time.monotonic() - begin)]
    for name, playback in playbacks.items():
        playback.graph.spin(0.3)
        assert len(playback.messages) == COUNTS[name]
        assert_sound(playback.heard, COUNTS[name])
        for kind in ("tilted", "by its stamps", "jumped"):
            assert playback.drive.words.count(kind) <= 1


def assert_sound(heard, count):
    driving = [m for m in heard if (m.linear.x, m.angular.z) != (0.0, 0.0)]
    assert len(driving) >= 0.99 * count
    for message in heard:
        v, omega = message.linear.x, message.angular.z
        assert math.isfinite(v)
        assert math.isfinite(omega)
        assert abs(v) <= 0.2097 + 1e-9
        assert abs(omega) <= 2.635 + 1e-9

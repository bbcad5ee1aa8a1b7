# SPDX-License-Identifier: Apache-2.0
"""Hours of driving in fast motion: a new goal every minute, no leak, no touch, every stop made."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from conftest import CONFIG

pytest.importorskip("rclpy", reason="needs ROS 2")

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Twist as TwistMessage

from tbot_gradnav import shipped
from tbot_gradnav.simulate import random_starts

HOURS = float(os.environ.get("GRADNAV_SOAK_HOURS", "0.05"))  # of the robot's time
FACTOR = float(os.environ.get("GRADNAV_SOAK_FACTOR", "20"))  # of fast motion
RATE = 10.0  # [Hz] of odometry
# A delay by the machine is as many times longer in fast motion: the robot stops, keeps away further
# and turns with a gain that stands late commands.
PRUDENCE = {"command_timeout": 0.5, "robot_radius": 0.205, "k_omega": 1.0}
LATE = 0.05  # of the drives may outlast their minute: the machine may have other work
FILE = CONFIG / "nine_attractive_repulsive.yaml"
MINUTE = 60.0  # [s] the longest way of 1,600 simulated ones takes 52 s
OVERSHOOT = 0.21 * 1.0  # [m] driven while a stop is on its way, a second in fast motion
WARM_UP = 0.25  # of the time
LEAK = 1.0  # [MiB] an hour of the robot's time; or altogether, where it is less than an hour


class Witness:
    """Sees where the robot truly is and what it is told."""

    def __init__(self, graph, world):
        self.x = self.y = math.nan
        self.stands = False
        self.command = None
        self.clearance = math.inf
        self.poses = 0
        self._world = world
        self._stamp = self._began = None
        graph.node.create_subscription(PoseStamped, "ground_truth", self._on_truth, 1000)
        graph.node.create_subscription(TwistMessage, "cmd_vel", self._on_command, 1000)

    @property
    def seconds(self):
        """The robot's time."""
        return 0.0 if self._stamp is None else self._stamp - self._began

    def _on_truth(self, message):
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        self._stamp, self._began = stamp, self._began or stamp
        x, y = message.pose.position.x, message.pose.position.y
        self.stands = (x, y) == (self.x, self.y)
        self.x, self.y = x, y
        self.clearance = min(self.clearance, float(self._world.clearance(self.x, self.y)))
        self.poses += 1

    def _on_command(self, message):
        self.command = message


def resident(process):
    """Return the memory [MiB] that a process holds."""
    lines = Path(f"/proc/{process.process.pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def test_hours_of_driving_leak_nothing_touch_nothing_and_end_every_drive_with_a_stop(graph, capsys):
    world = shipped.configuration(str(FILE)).settings.world
    roomy = shipped.configuration(str(FILE), PRUDENCE).settings.world
    witness = Witness(graph, world)
    options = {"real_time_factor": FACTOR, "rate": RATE, **PRUDENCE}
    more = [word for name, value in options.items() for word in ("-p", f"{name}:={value}")]
    nodes = [graph.start("fake_robot", "--ros-args", "--params-file", FILE, *more)]
    graph.until(lambda: witness.poses, "fake robot")
    nodes.append(graph.start("navigator", "--ros-args", "--params-file", FILE, *more))
    goal = graph.node.create_publisher(PoseStamped, "goal_pose", 10)
    graph.until(lambda: goal.get_subscription_count() == 1 and witness.command, "navigator")
    began, poses, memory, late = witness.seconds, witness.poses, [], 0
    goals = random_starts(roomy, round(HOURS * 3600.0 / MINUTE), seed=0)
    for i, (x, y) in enumerate(zip(goals.x, goals.y, strict=True)):
        message = PoseStamped()
        message.pose.position.x, message.pose.position.y = float(x), float(y)
        message.pose.orientation.w = 0.0
        arrived = nodes[1].words.count("arrived")
        goal.publish(message)
        until = began + (i + 1) * MINUTE
        graph.until(lambda t=until: witness.seconds >= t, "minute", patience=20.0 + MINUTE / FACTOR)
        if nodes[1].words.count("arrived") > arrived:
            assert witness.command == TwistMessage(), f"no stop in minute {i}"
            assert witness.stands, f"it rolls on in minute {i}"
            assert math.hypot(witness.x - x, witness.y - y) <= 0.05 + OVERSHOOT, f"minute {i}"
        else:
            late += 1
        memory.append([resident(node) for node in nodes])
    hours, memory = (1 + np.arange(len(memory))) * MINUTE / 3600.0, np.array(memory)
    warm = hours > WARM_UP * HOURS
    slopes = np.polyfit(hours[warm], memory[warm], 1)[0] if HOURS >= 1.0 else []
    growth = memory[-1] - memory[warm][0]
    rate = (witness.poses - poses) / (witness.seconds - began)
    with capsys.disabled():
        print(
            f"\n{witness.seconds - began:.0f} s of the robot's time, {len(memory)} goals, "
            f"{late} late, odometry {rate:.1f} Hz, smallest clearance {witness.clearance:.3f} m; "
            f"fake robot, navigator: {memory[-1].round(1)} MiB, grown by {growth.round(2)} MiB "
            f"after warm-up, slope {np.round(slopes, 3)} MiB/h"
        )
    assert witness.clearance > 0.0
    assert late <= LATE * len(memory)
    assert "stopped: " not in nodes[1].words
    assert rate >= 0.5 * RATE
    assert max(slopes if HOURS >= 1.0 else growth) < LEAK

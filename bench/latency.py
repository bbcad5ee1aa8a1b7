# SPDX-License-Identifier: Apache-2.0
"""Latency and cost of the navigator against a bare relay, over DDS, side by side.

The driver of this module publishes odometry of a robot that runs round a circle and waits for the
command that answers it. Relay and navigators, each a process of its own on the same executor, are
asked in turns of a few hundred messages, since a shared machine drifts within minutes by more than
what is measured here. Every ratio is of what two processes did in the same round.
"""

import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

RATES = (30.0, 200.0)  # [Hz]
MESSAGES = {30.0: 120, 200.0: 400}  # a turn
WARM_UP = 20  # messages at the head of each turn that are not counted
ROUNDS = 3  # turns of each process and rate in a run
ATTEMPTS = 5  # at a turn
PATIENCE = 15.0  # [s] for discovery
SILENCE = 0.8  # [s] after its odometry_timeout, a navigator has stopped the robot
RADIUS = 0.2  # [m] of the circle the robot runs round
SPEED = 0.15  # [m/s]
CONFIG = Path(__file__).parents[1] / "config"
DOMAIN = int(os.environ.get("ROS_DOMAIN_ID", 97))


class LostError(Exception):
    """Not each odometry message was answered by one command."""


class Turn(NamedTuple):
    """What a process did in a turn: round trips [s] and its processor time [s] per message."""

    trips: np.ndarray
    cpu: float


class Driver(Node):
    """Publishes odometry and takes the time until the command comes."""

    def __init__(self, namespace: str) -> None:
        super().__init__("driver", namespace=namespace)
        self.publisher = self.create_publisher(Odometry, "odom", 10)
        self.create_subscription(Twist, "cmd_vel", self._on_command, 100)
        self.sent: list[float] = []
        self.answered: list[float] = []
        self._phase = 0.0

    @property
    def matched(self) -> bool:
        """Whether the process listens and is heard."""
        heard = self.count_publishers("cmd_vel") > 0
        return heard and self.publisher.get_subscription_count() > 0

    @property
    def quiet_since(self) -> float:
        """When a navigator has said all it has to say about the end of odometry."""
        return (self.sent[-1] if self.sent else 0.0) + SILENCE

    def begin(self) -> None:
        """Forget the last turn, whatever was published since."""
        self.sent, self.answered = [], []

    def send(self, period: float) -> None:
        """Publish where the robot is after another period [s]."""
        self._phase += SPEED / RADIUS * period
        message = Odometry()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id, message.child_frame_id = "odom", "base_footprint"
        message.pose.pose.position.x = RADIUS * math.sin(self._phase)
        message.pose.pose.position.y = RADIUS * (1.0 - math.cos(self._phase))
        message.pose.pose.orientation.z = math.sin(self._phase / 2.0)
        message.pose.pose.orientation.w = math.cos(self._phase / 2.0)
        self.sent.append(time.perf_counter())
        self.publisher.publish(message)

    def _on_command(self, _: Twist) -> None:
        self.answered.append(time.perf_counter())


@dataclass
class Process:
    """A relay or a navigator, and the driver that talks to it."""

    child: subprocess.Popen[bytes]
    driver: Driver
    executor: SingleThreadedExecutor
    turns: dict[float, list[Turn]] = field(default_factory=lambda: {rate: [] for rate in RATES})

    def spin(self, until: float) -> None:
        """Hear what comes until a time of perf_counter."""
        while (left := until - time.perf_counter()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def ready(self) -> None:
        """Wait until both sides have found each other and a command has come back."""
        end = time.perf_counter() + PATIENCE
        while time.perf_counter() < end:
            if self.driver.matched:
                self.driver.send(0.02)
            self.spin(time.perf_counter() + 0.05)
            if self.driver.answered:
                return
        raise TimeoutError(f"no command within {PATIENCE:g} s from {self.child.args!r}")

    def turn(self, rate: float) -> None:
        """Drive for a turn; anew if messages were lost, as happens on a machine that is busy."""
        for _ in range(ATTEMPTS):
            try:
                self.turns[rate].append(self._driven(rate))
                return
            except LostError as error:
                lost = error
        raise lost

    def _driven(self, rate: float) -> Turn:
        """Return what came of a turn. Raises LostError."""
        period, n = 1.0 / rate, MESSAGES[rate]
        self.spin(max(self.driver.quiet_since, time.perf_counter() + 0.1))
        self.driver.begin()
        begin = time.perf_counter() + period
        cpu = 0.0
        for i in range(n):
            self.spin(begin + i * period)
            if i == WARM_UP:
                self._settle(WARM_UP)
                cpu = cpu_time(self.child.pid)
                begin = time.perf_counter() - i * period
            self.driver.send(period)
        self._settle(n)
        cpu = cpu_time(self.child.pid) - cpu
        trips = np.subtract(self.driver.answered, self.driver.sent)[WARM_UP:]
        return Turn(trips, cpu / (n - WARM_UP))

    def _settle(self, n: int) -> None:
        """Wait until n commands have come, and no more."""
        end = time.perf_counter() + 1.0
        while len(self.driver.answered) < n and time.perf_counter() < end:
            self.spin(time.perf_counter() + 0.002)
        if len(self.driver.answered) != n:
            raise LostError(f"{n} odometry messages, {len(self.driver.answered)} commands")


def cpu_time(pid: int) -> float:
    """Return the processor time [s] that a process has used, all its threads together."""
    return time.clock_gettime(~pid << 3 | 2)  # the clock of clock_getcpuclockid(3)


def thousand_obstacles(path: Path) -> None:
    """Write a parameter file with 1,000 obstacles in the disc of 4.5 m."""
    side = np.arange(-4.4, 4.4, 0.23)
    points = [(x, y) for x in side for y in side if 0.6 < math.hypot(x, y) < 4.35]
    start = (-3.4, -2.2)
    free = [(x, y) for x, y in points if math.hypot(x - start[0], y - start[1]) > 0.45]
    chosen = free[:1000]
    if len(chosen) < 1000:
        raise AssertionError(f"only {len(chosen)} obstacles fit")
    names = [f"o{i}" for i in range(1000)]
    entries = "".join(
        f"      {name}: {{x: {x:.3f}, y: {y:.3f}, radius: 0.01}}\n"
        for name, (x, y) in zip(names, chosen, strict=True)
    )
    nine = (CONFIG / "nine_attractive_repulsive.yaml").read_text(encoding="utf-8")
    head, _ = nine.split("    obstacles:\n")
    text = head + f"    obstacles:\n      names: [{', '.join(names)}]\n" + entries
    path.write_text(text, encoding="utf-8")


@contextmanager
def processes(files: Mapping[str, Path]) -> Iterator[dict[str, Process]]:
    """Start the relay and a navigator for each parameter file; end them all."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(DOMAIN)
    commands = {"relay": [sys.executable, "-m", "bench.relay", "--ros-args"]}
    for name, file in files.items():
        start = [sys.executable, "-m", "tbot_gradnav.navigator", "--ros-args"]
        commands[name] = [*start, "--params-file", str(file)]
    rclpy.init(args=[])
    found: dict[str, Process] = {}
    try:
        for name, command in commands.items():
            child = subprocess.Popen(
                [*command, "-r", f"__ns:=/{name}"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=Path(__file__).parents[1],
            )
            driver, executor = Driver(f"/{name}"), SingleThreadedExecutor()
            executor.add_node(driver)
            found[name] = Process(child, driver, executor)
        for process in found.values():
            process.ready()
        yield found
    finally:
        for process in found.values():
            process.child.send_signal(signal.SIGTERM)
        for process in found.values():
            process.child.wait(PATIENCE)
        rclpy.try_shutdown()


class Ratios(NamedTuple):
    """A navigator against another process at a rate: of medians, 99th percentiles and CPU."""

    median: float
    p99: float
    cpu: float


def ratios(process: Process, other: Process, rate: float) -> Ratios:
    """Return the ratios, each of all turns pooled."""
    a, b = process.turns[rate], other.turns[rate]
    trips_a, trips_b = (np.concatenate([turn.trips for turn in turns]) for turns in (a, b))
    return Ratios(
        float(np.median(trips_a) / np.median(trips_b)),
        float(np.quantile(trips_a, 0.99) / np.quantile(trips_b, 0.99)),
        sum(turn.cpu for turn in a) / sum(turn.cpu for turn in b),
    )


class Floor(NamedTuple):
    """What a process needs at a rate: median, 99th percentile and CPU a message, all in [ms]."""

    median: float
    p99: float
    cpu: float


def floor(process: Process, rate: float) -> Floor:
    """Return what a process needed, all turns pooled."""
    trips = np.concatenate([turn.trips for turn in process.turns[rate]])
    median, p99 = np.quantile(trips, (0.5, 0.99))
    cpu = np.mean([turn.cpu for turn in process.turns[rate]])
    return Floor(1e3 * float(median), 1e3 * float(p99), 1e3 * float(cpu))


@dataclass(frozen=True)
class Latency:
    """One run: by rate [Hz], for each navigator its ratios to the relay; and absolute times."""

    against_relay: dict[float, dict[str, Ratios]]
    thousand: dict[float, Ratios]  # 1,000 obstacles against 9
    absolute: dict[float, dict[str, Floor]]


def measure(rounds: int = ROUNDS) -> Latency:
    """Measure once, in a couple of minutes."""
    with tempfile.TemporaryDirectory() as folder:
        many = Path(folder) / "thousand.yaml"
        thousand_obstacles(many)
        files = {
            "psi": CONFIG / "nine_navigation_function.yaml",
            "u": CONFIG / "nine_attractive_repulsive.yaml",
            "u_1000": many,
        }
        with processes(files) as found:
            for i in range(rounds):
                for rate in RATES:
                    order = list(found.values())
                    for process in order if i % 2 == 0 else reversed(order):
                        process.turn(rate)
            return Latency(
                {
                    rate: {name: ratios(found[name], found["relay"], rate) for name in ("psi", "u")}
                    for rate in RATES
                },
                {rate: ratios(found["u_1000"], found["u"], rate) for rate in RATES},
                {rate: {name: floor(p, rate) for name, p in found.items()} for rate in RATES},
            )

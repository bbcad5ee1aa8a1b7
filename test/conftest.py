# SPDX-License-Identifier: Apache-2.0
"""Real nodes on a ROS graph of their own, and ways to wait for what they do."""

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# Shared memory left by a process killed on purpose can crash Fast DDS in whoever comes after it.
os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"
DOMAINS = range(1, 100)  # beyond, ports of Fast DDS run into those that Linux hands out
PATIENCE = 15.0  # [s] discovery mostly takes 0.1 s, sometimes 2.4 s
ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "config"


@contextmanager
def ros_domain():
    """Give a ROS domain that no other test of this machine has, whoever runs it."""
    first = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[first:], *DOMAINS[:first]):
        with Path(tempfile.gettempdir(), f"tbot_gradnav_domain_{domain}").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    pytest.fail("no ROS domain is free")


def heed_signals():
    """Undo what a shell or nohup does to the signals of what runs in its background."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP):
        signal.signal(number, signal.SIG_DFL)


class Process:
    """A node of the package in a process of its own; its words go to a file."""

    def __init__(self, name, arguments, domain, log):
        self.log = log
        with log.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-m", f"tbot_gradnav.{name}", *map(str, arguments)],
                start_new_session=True,
                preexec_fn=heed_signals,
                stdout=file,
                stderr=subprocess.STDOUT,
                env=os.environ | {"ROS_DOMAIN_ID": str(domain)},
            )

    @property
    def words(self):
        """All it has said."""
        return self.log.read_text()

    def send(self, number):
        """Send a signal."""
        self.process.send_signal(number)

    def wait(self):
        """Return its exit status once it has ended."""
        return self.process.wait(PATIENCE)

    def end(self):
        """End it whatever it does."""
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Graph:
    """A ROS graph: a node of the test, and processes started on the same domain."""

    def __init__(self, folder, domain):
        import rclpy

        self.domain = domain
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[], domain_id=self.domain)
        self.node = rclpy.create_node("test", context=self.context)
        self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._folder = folder
        self._processes = []

    def start(self, name, *arguments):
        """Start a node of the package as a process."""
        log = self._folder / f"{name}{len(self._processes)}.log"
        self._processes.append(Process(name, arguments, self.domain, log))
        return self._processes[-1]

    def listen(self, kind, topic, depth=1000):
        """Return a list that grows by what is published on a topic."""
        heard = []
        self.node.create_subscription(kind, topic, heard.append, depth)
        return heard

    def spin(self, seconds):
        """Take part in the graph for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=min(left, 0.05))

    def until(self, condition, what, patience=PATIENCE):
        """Take part in the graph until a condition holds; fail if it never does."""
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                words = "\n".join(p.words for p in self._processes)
                pytest.fail(f"no {what} within {patience} s; the nodes said:\n{words}")
            self.executor.spin_once(timeout_sec=0.05)

    def close(self):
        """End everything."""
        for process in self._processes:
            process.end()
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


@contextmanager
def ros_graph(folder):
    """Give a ROS graph on a domain that no other test uses."""
    with ros_domain() as domain:
        graph = Graph(folder, domain)
        yield graph
        graph.close()


@pytest.fixture
def graph(tmp_path):
    """Give a ROS graph."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    with ros_graph(tmp_path) as graph:
        yield graph


@pytest.fixture
def parameter_file(tmp_path):
    """Give a function that writes a parameter file for all nodes and returns its path."""

    def write(text, name="parameters.yaml"):
        path = tmp_path / name
        lines = "".join(f"    {line}\n" for line in text.strip().splitlines())
        path.write_text("/**:\n  ros__parameters:\n" + lines)
        return path

    return write

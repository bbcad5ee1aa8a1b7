# SPDX-License-Identifier: Apache-2.0
"""gradnav demo: navigator and fake robot as two processes, watched by a third."""

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from tbot_gradnav import parameter_file, plots, shipped
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.options import Configuration
from tbot_gradnav.recording import recording, refuse_other_than_bag
from tbot_gradnav.settings import Settings

Processes: TypeAlias = "dict[str, subprocess.Popen[bytes]]"
TIME_LIMIT = 300.0  # [s] of the robot's time
SILENCE = 20.0  # [s] of ours without a message, after which something is wrong
UP = 60.0  # [s] of ours for the nodes to come up; navigation_function.k: 0 may take a while
REPORT_PERIOD = 0.5  # [s] of ours between lines of progress
GRACE = 5.0  # [s] a node has to end
BAR = 30  # characters


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument("file", nargs="?", default="demo.yaml", help="parameter file (%(default)s)")
    parser.add_argument(
        "--out", default="gradnav_demo", metavar="DIR", help="for picture and bag (%(default)s)"
    )


def run(options: argparse.Namespace) -> int:
    """Drive; 0 if the robot arrived without a collision."""
    file, out = shipped.parameter_path(options.file), Path(options.out)
    configuration = shipped.configuration(options.file)
    Configuration.of(parameter_file.read(file, "/fake_robot"))
    if out.exists() and not out.is_dir():
        raise GradnavError(f"--out {out}: it exists and is no folder; it is left alone")
    refuse_other_than_bag(out / "bag")
    keep_to_this_machine()
    observer = watched(file, configuration)
    with recording(out / "bag") as recorder:
        observer.record(recorder, file.read_text(encoding="utf-8"))
    _draw(out / "demo.png", configuration.settings, observer)
    print(f"picture: {out / 'demo.png'}\nbag:     {out / 'bag'}")
    return _verdict(observer)


def keep_to_this_machine() -> None:
    """Choose a ROS domain of our own, so that no real robot hears of what we drive."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    domain = os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    print(f"to look on from another terminal: export ROS_DOMAIN_ID={domain}")


def watched(file: Path, configuration: Configuration) -> Any:
    """Run both nodes until the robot arrives, collides or gives up; return who watched.

    Raises GradnavError where ROS 2 is missing or a node fails.
    """
    try:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from tbot_gradnav.observer import Observer
        from tbot_gradnav.ros import SIGNALS
    except ImportError as error:
        raise GradnavError("driving over ROS needs ROS 2: pip install tbot_gradnav[ros]") from error
    with ExitStack() as stack:
        interrupted = threading.Event()  # raising within rclpy's C code would turn into a TypeError
        for number in SIGNALS:
            before = signal.signal(number, lambda *_: interrupted.set())
            stack.callback(signal.signal, number, before)
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        stack.callback(rclpy.try_shutdown)
        observer = Observer(configuration)
        stack.callback(observer.destroy_node)
        processes: Processes = {}
        stack.callback(_end, processes)
        spin = partial(_spin, observer, processes, interrupted)
        processes["navigator"] = _started("navigator", file)
        spin(observer.hold, "the navigator does not answer")
        processes["fake_robot"] = _started("fake_robot", file)
        spin(lambda: observer.hears_all, "odometry, state or commands are not heard")
        spin(observer.let_go, "the navigator does not answer")
        spin(lambda: observer.done or observer.seconds >= TIME_LIMIT)
    return observer


def _started(name: str, file: Path) -> "subprocess.Popen[bytes]":
    """Start a node of this package."""
    command = [sys.executable, "-m", f"tbot_gradnav.{name}"]
    return subprocess.Popen(
        [*command, "--ros-args", "--params-file", str(file)], start_new_session=True
    )


def _end(processes: Processes) -> None:
    """End the nodes one by one; the navigator, started first, while the robot still hears it."""
    for process in processes.values():
        process.terminate()  # SIGINT while it still imports would be a traceback
        try:
            process.wait(GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _spin(
    observer: Any,
    processes: Processes,
    interrupted: threading.Event,
    until: Callable[[], object],
    lacking: str = "",
) -> None:
    """Listen and show progress until a condition holds; raise GradnavError if something fails.

    What is `lacking` while nodes come up says what is wrong if it stays so.
    """
    import rclpy

    began = heard = time.monotonic()
    reported, count, farthest = 0.0, len(observer.path), 0.0
    while not until():
        rclpy.spin_once(observer, timeout_sec=0.1)
        if interrupted.is_set():
            print("interrupted: neither picture nor bag is written", flush=True)
            raise KeyboardInterrupt
        now = time.monotonic()
        if len(observer.path) > count:
            heard, count = now, len(observer.path)
            farthest = max(farthest, observer.distance)
            if observer.under_way and now - reported > REPORT_PERIOD:
                reported = now
                print(_progress(observer, farthest), flush=True)
        observer.refuse_company()
        if lacking and now - began > UP:
            raise GradnavError(f"{lacking} for {UP:g} s")
        if not lacking and now - heard > SILENCE:
            raise GradnavError(f"the fake robot has been silent for {SILENCE:g} s")
        for name, process in processes.items():
            if process.poll() is not None:
                raise GradnavError(f"the {name} ended by itself with status {process.returncode}")


def _progress(observer: Any, farthest: float) -> str:
    done = round(BAR * (1.0 - observer.distance / max(farthest, 1e-9)))
    v, omega = observer.twist
    near = f", clearance {observer.clearance:.2f} m" if np.isfinite(observer.clearance) else ""
    return (
        f"[{'#' * done}{'.' * (BAR - done)}] {observer.seconds:5.1f} s, goal "
        f"{observer.distance:.2f} m away, v {v:+.2f} m/s, omega {omega:+.2f} rad/s{near}"
    )


def _draw(path: Path, settings: Settings, observer: Any) -> None:
    track = np.array([(p.x, p.y, p.theta) for p in observer.path]).T
    with plots.figure(path) as ax:
        plots.draw_potential(ax, settings.chosen_potential)
        plots.draw_world(ax, settings.world, settings.goal_heading)
        plots.draw_path(ax, track)
        ax.set_title(
            f"law {settings.law}, potential {settings.potential}: {observer.seconds:.1f} s"
        )


def _verdict(observer: Any) -> int:
    if observer.collided:
        print(f"collided after {observer.seconds:.1f} s")
    elif not observer.arrived:
        print(
            f"not arrived after {observer.seconds:.1f} s, {observer.distance:.3f} m from the goal"
        )
    else:
        print(f"arrived after {observer.seconds:.1f} s, {observer.distance:.3f} m from the goal")
        return 0
    return 1

# SPDX-License-Identifier: Apache-2.0
"""gradnav replay: recorded odometry through the controller, against the recorded commands."""

import argparse
import math
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from tbot_gradnav import bags, parameter_file, plots, shipped
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.files import write_json
from tbot_gradnav.options import Configuration
from tbot_gradnav.parameters import Number
from tbot_gradnav.recording import Recorder, recording
from tbot_gradnav.replay import Comparison, Replay, Sample
from tbot_gradnav.settings import Settings

TOLERANCES = {"v": 1e-3, "omega": 1e-3}  # [m/s], [rad/s]
PATIENCE = 2.0  # [s] before a progress bar is shown, and between its updates
BAR = 40  # characters
KEPT = 10_000  # samples in a picture


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument("bag", help="rosbag2 folder, .mcap, .db3, or ROS 1 .bag")
    parser.add_argument("file", help="parameter file")
    parser.add_argument("--out", metavar="BAG", help="write odometry and computed commands")
    parser.add_argument("--json", metavar="OUT", help="write the figures")
    parser.add_argument(
        "--plot", type=plots.picture, metavar="PNG", help="draw commands, differences and path"
    )
    for name, unit in (("v", "m/s"), ("omega", "rad/s")):
        parser.add_argument(
            f"--tolerance-{name}", type=float, default=TOLERANCES[name], metavar="D",
            help=f"largest difference in {name} that counts as equal [{unit}] (%(default)s)",
        )  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Replay; 0 if every recorded command is within tolerance, or there is none."""
    configuration = Configuration.of(parameter_file.read(shipped.parameter_path(options.file)))
    if configuration.settings.awaits_map:
        raise GradnavError(f"{options.file}: map.file is missing, and bags of maps are not read")
    at_least_0 = Number("", at_least=0.0)
    comparison = Comparison(
        at_least_0.check("--tolerance-v", options.tolerance_v),
        at_least_0.check("--tolerance-omega", options.tolerance_omega),
    )
    track = Track()
    if options.out:
        _refuse_input(Path(options.out), Path(options.bag))
    with ExitStack() as stack:
        bag = stack.enter_context(bags.opened(options.bag))
        replay = Replay(configuration, bag, comparison)
        recorder = stack.enter_context(recording(options.out)) if options.out else None
        for sample in _with_progress(replay):
            if options.plot:
                track.add(sample)
            if recorder:
                _record(recorder, sample)
        duration = bag.duration
    print("\n".join(_words(replay, duration)))
    if options.out:
        print(f"bag: {options.out}")
    if options.json:
        write_json(options.json, report(replay, duration))
    if options.plot:
        _plot(options.plot, configuration.settings, track)
    return 0 if comparison.equal else 1


def _refuse_input(out: Path, bag: Path) -> None:
    """Raise GradnavError if writing `out` would replace the bag that is read."""
    if out.resolve() in (bag.resolve(), *bag.resolve().parents):
        raise GradnavError(f"--out {out}: it holds what is to be replayed; it is left alone")


class Track:
    """The samples of a replay for a picture, every nth of a long one."""

    def __init__(self) -> None:
        self.samples: list[Sample] = []
        self._every, self._seen = 1, 0

    def add(self, sample: Sample) -> None:
        """Keep a sample, or not."""
        if self._seen % self._every == 0:
            self.samples.append(sample)
        self._seen += 1
        if len(self.samples) > KEPT:
            self.samples = self.samples[::2]
            self._every *= 2


def report(replay: Replay, duration: float) -> dict[str, Any]:
    """Return the JSON of a replay; an infinite difference is null."""
    found = replay.comparison
    rms_v, rms_omega = found.rms
    figures = {
        "duration": duration,
        "max_v_difference": found.max_v,
        "max_omega_difference": found.max_omega,
        "rms_v_difference": rms_v,
        "rms_omega_difference": rms_omega,
        "first_divergence": found.first_divergence,
    }
    return {
        "odometry": replay.odometry,
        "commands": replay.commands,
        "equal": found.equal,
        "warnings": replay.warnings(),
    } | {key: value if _finite(value) else None for key, value in figures.items()}


def _finite(value: float | None) -> bool:
    return value is not None and math.isfinite(value)


def _with_progress(replay: Replay) -> Iterator[Sample]:
    """Yield the samples; show how far it is on a terminal if it takes long."""
    total = replay.bag.count("/odom") + replay.bag.count("/cmd_vel")
    shown = time.monotonic()
    for n, sample in enumerate(replay.samples(), start=1):
        yield sample
        if sys.stderr.isatty() and time.monotonic() - shown > PATIENCE:
            shown = time.monotonic()
            done = min(BAR, round(BAR * n / max(total, 1)))
            print(f"\r[{'#' * done}{'.' * (BAR - done)}]", end="", file=sys.stderr, flush=True)


def _record(recorder: Recorder, sample: Sample) -> None:
    """Write a message of odometry, and the command computed from it."""
    if sample.recorded is None:
        stamp = sample.event.recorded
        recorder.write("/odom", "nav_msgs/msg/Odometry", stamp, sample.event.cdr)
        if sample.computed is not None:
            recorder.write_command(stamp, sample.computed)


def _words(replay: Replay, duration: float) -> list[str]:
    found = replay.comparison
    lines = [f"{replay.odometry} odometry messages, {replay.commands} commands, {duration:.2f} s"]
    lines += [f"warning: {warning}" for warning in replay.warnings()]
    if not found.matched:
        return [*lines, "no recorded commands to compare with"]
    rms_v, rms_omega = found.rms
    lines += [
        f"v:     largest difference {found.max_v:.4g}, rms {rms_v:.4g} m/s",
        f"omega: largest difference {found.max_omega:.4g}, rms {rms_omega:.4g} rad/s",
    ]
    if found.first_divergence is None:
        return [*lines, f"equal: {found.matched} recorded commands within tolerance"]
    return [
        *lines,
        f"NOT equal: beyond tolerance from {found.first_divergence:.3f} s into the bag",
    ]


def _plot(path: str, settings: Settings, track: Track) -> None:
    """Draw v and omega with their differences on the left, the path on the right."""
    with plots.figure(path, width=11.0, height=6.5, ncols=2, nrows=4, sharex="col") as axes:
        _draw_commands(axes[:, 0], track.samples)
        grid = axes[0, 1].get_gridspec()
        for ax in axes[:, 1]:
            ax.remove()
        ax = axes[0, 0].figure.add_subplot(grid[:, 1])
        plots.draw_potential(ax, settings.chosen_potential)
        plots.draw_world(ax, settings.world)
        poses = [s.pose for s in track.samples if s.pose is not None]
        if poses:
            plots.draw_path(ax, np.array([(p.x, p.y, p.theta) for p in poses]).T)


def _draw_commands(axes: Any, samples: list[Sample]) -> None:
    driven = [s for s in samples if s.recorded is None and s.computed is not None]
    paired = [s for s in samples if s.recorded is not None]
    for row, (part, unit) in enumerate((("v", "m/s"), ("omega", "rad/s"))):
        above, below = axes[2 * row], axes[2 * row + 1]
        computed = [(s.t, getattr(s.computed, part)) for s in driven]
        recorded = [(s.t, getattr(s.recorded, part)) for s in paired]
        differences = [(s.t, getattr(s.recorded, part) - getattr(s.computed, part)) for s in paired]
        above.step(*_columns(computed), where="post", color="#0072b2", lw=1.0, label="computed")
        above.plot(*_columns(recorded), ".", ms=3, color="#d55e00", label="recorded")
        below.plot(*_columns(differences), ".", ms=3, color="black")
        above.set_ylabel(f"{part} [{unit}]")
        below.set_ylabel(f"difference\n[{unit}]")
        below.set_ylim(*_at_least(below.get_ylim(), TOLERANCES[part]))
    axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, ncols=2)
    axes[-1].set_xlabel("time since the bag began [s]")


def _at_least(limits: tuple[float, float], size: float) -> tuple[float, float]:
    """Return limits of an axis that are not so narrow that rounding looks like something."""
    return min(limits[0], -size), max(limits[1], size)


def _columns(pairs: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [t for t, _ in pairs], [value for _, value in pairs]

# SPDX-License-Identifier: Apache-2.0
"""Recorded odometry through the controller, and what comes out against what was recorded."""

import math
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from tbot_gradnav.bags import Bag, Event
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.lidar import Sweep
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.odometry import BadOdometryError, Notice, Reading, Route
from tbot_gradnav.options import Configuration
from tbot_gradnav.unicycle import STOP, Pose, Twist

CANDIDATES = 5  # a command may still be on its way when the next odometry is recorded
NS = 1e-9


class Sample(NamedTuple):
    """A message of the bag and what the controller made of it.

    With odometry: the pose in the world and the computed command; with a recorded command: that,
    and the computed one it is compared with.
    """

    t: float  # [s] since the bag began
    event: Event
    pose: Pose | None
    computed: Twist | None
    recorded: Twist | None


@dataclass
class Comparison:
    """Differences between recorded and computed commands, kept as running figures."""

    tolerance_v: float
    tolerance_omega: float
    matched: int = 0
    max_v: float = 0.0
    max_omega: float = 0.0
    sum_v2: float = 0.0
    sum_omega2: float = 0.0
    first_divergence: float | None = None  # [s] since the bag began

    def add(self, t: float, recorded: Twist, computed: Twist) -> None:
        """Take note of a pair."""
        dv, domega = _difference(recorded, computed)
        self.matched += 1
        self.max_v, self.max_omega = max(self.max_v, dv), max(self.max_omega, domega)
        self.sum_v2 += dv * dv
        self.sum_omega2 += domega * domega
        beyond = not (dv <= self.tolerance_v and domega <= self.tolerance_omega)
        if beyond and self.first_divergence is None:
            self.first_divergence = t

    @property
    def equal(self) -> bool:
        """Whether every pair agrees within the tolerances."""
        return self.first_divergence is None

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square of the differences in v [m/s] and omega [rad/s]."""
        n = max(self.matched, 1)
        return math.sqrt(self.sum_v2 / n), math.sqrt(self.sum_omega2 / n)


@dataclass
class Replay:
    """A replay of a bag: iterate `samples` once; the figures are complete after it.

    A recorded command is compared with those computed from the last few odometry messages before
    it, the `candidates`, whichever is nearest.
    """

    configuration: Configuration
    bag: Bag
    comparison: Comparison
    candidates: int = CANDIDATES
    odometry: int = 0
    commands: int = 0
    notices: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)  # the first notice of each kind

    def samples(self) -> Iterator[Sample]:
        """Feed every message, in the order of its recording, and yield what came of it.

        A recorded command is judged when the next odometry comes, since what explains a stop, a
        goal or a pause, may be recorded after it.
        """
        options = self.configuration.navigator
        navigation = Navigation(self.configuration.settings, options.world_frame)
        recent: deque[Twist] = deque(maxlen=self.candidates)
        commands: list[tuple[float, Event, bool]] = []  # since the last odometry; whether too late
        heard = -math.inf  # [s] when the last good odometry was recorded
        scans = navigation.settings.chosen_potential.looks
        for event in self.bag.events(scans):
            t = (event.recorded - self.bag.start) * NS
            content = event.content
            if isinstance(content, Reading):
                yield from self._judged(commands, recent)
                self.odometry += 1
                repeats = navigation.odometry.repeats(content)
                pose, twist = self._fed(navigation, content)
                if not repeats:
                    heard = t if pose is not None else -math.inf
                recent.append(twist or STOP)
                yield Sample(t, event, pose, twist, None)
            elif isinstance(content, list):
                self._set_out(navigation, content)
                recent.append(STOP)  # while it looks whether it can
            elif isinstance(content, State):
                if _pause_or_resume(navigation, content):
                    recent.append(STOP)
            elif isinstance(content, Sweep):
                navigation.see(content)
            elif isinstance(content, GradnavError):
                self._note(Notice(type(content).__name__, str(content)))
            elif isinstance(content, Twist):
                if not navigation.settings.has_goal:
                    self._note(Notice("no goal", "a command, but no goal in the file or the bag"))
                commands.append((t, event, t - heard > options.odometry_timeout))
        yield from self._judged(commands, recent)

    def _judged(
        self, commands: list[tuple[float, Event, bool]], recent: Iterable[Twist]
    ) -> Iterator[Sample]:
        """Compare recorded commands with recent computed ones, and forget them."""
        for t, event, stale in commands:
            assert isinstance(event.content, Twist)
            self.commands += 1
            computed = _nearest(event.content, [STOP] if stale else list(recent))
            self.comparison.add(t, event.content, computed)
            yield Sample(t, event, None, computed, event.content)
        commands.clear()

    def warnings(self) -> list[str]:
        """Return what stood out, a line for each kind with its count."""
        return [
            f"{self.examples[kind]}" + (f" (and {n - 1} more like it)" if n > 1 else "")
            for kind, n in self.notices.items()
            if kind not in ("arrived", "waypoint")
        ]

    def _fed(self, navigation: Navigation, reading: Reading) -> tuple[Pose | None, Twist | None]:
        """Return pose and command for a message; no pose and a stop where it is unusable."""
        try:
            pose, twist, notices = navigation.update(reading)
        except BadOdometryError as error:
            self._note(Notice("bad odometry", str(error)))
            return None, STOP
        except Exception as error:  # as the node, which stops the robot
            self._note(Notice("error", f"{type(error).__name__}: {error}"))
            return None, STOP
        for notice in notices:
            self._note(notice)
        return pose, twist

    def _set_out(self, navigation: Navigation, route: Route) -> None:
        try:
            goal, waypoints = navigation.odometry.in_world(route)
            settings = replace(navigation.settings, goal=goal, waypoints=waypoints)
            pose = navigation.pose or settings.start
            settings.refuse_unreachable(float(pose.x), float(pose.y))
        except GradnavError as error:
            self._note(Notice("goal", f"a goal was refused: {error}"))
            return
        navigation.change(settings)
        navigation.restart()

    def _note(self, notice: Notice) -> None:
        self.notices[notice.kind] += 1
        self.examples.setdefault(notice.kind, notice.text)


def _pause_or_resume(navigation: Navigation, recorded: State) -> bool:
    """Pause where the recorded navigator did, go on where it did; return whether it was paused."""
    paused = navigation.state is State.PAUSED
    if recorded is State.PAUSED and not paused:
        navigation.pause()
        return True
    if recorded is not State.PAUSED and paused:
        navigation.resume()
    return False


def _nearest(recorded: Twist, candidates: list[Twist]) -> Twist:
    return min(candidates, key=lambda twist: sum(_difference(recorded, twist)), default=STOP)


def _difference(a: Twist, b: Twist) -> tuple[float, float]:
    """Return |dv| [m/s] and |domega| [rad/s]; inf where a recorded command is not a number."""
    dv, domega = abs(float(a.v) - float(b.v)), abs(float(a.omega) - float(b.omega))
    return (dv if math.isfinite(dv) else math.inf), (domega if math.isfinite(domega) else math.inf)

# SPDX-License-Identifier: Apache-2.0
"""The paper's figures 2-8, each from a parameter file of its own, config/figure_*.yaml.

A file's first section holds one group of runs, for initial_pose and for each of starts; a section
for another node name, as /forward, changes what it says for a second group.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav import closed_form, parameter_file, plots, shipped
from tbot_gradnav.controller import Controller
from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.options import Configuration
from tbot_gradnav.settings import Settings
from tbot_gradnav.simulate import CONTROL_PERIOD, simulate
from tbot_gradnav.unicycle import Pose

FINE = 0.005  # [s] control period of Fig. 3, which the paper simulates in continuous time
BOTH_SIGNS = ("/navigator", "/forward")  # node names of the sections
BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"  # Okabe-Ito
PARTS = ("(a) negative gains", "(b) positive gains")
STYLES: tuple[dict[str, Any], ...] = ({"color": BLUE, "ls": "-"}, {"color": VERMILION, "ls": "--"})
RHO_SHOWN = 2.5  # [m] in the phase portraits
BETA_SHOWN = 3.5  # [pi] likewise


@dataclass(frozen=True)
class Run:
    """One robot's way: x, y [m] and theta [rad] at the times t [s], shape (3, steps)."""

    settings: Settings
    t: NDArray[np.float64]
    path: NDArray[np.float64]
    outcome: str  # arrived, collided, or not arrived

    @property
    def polar(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distance rho [m] and beta = theta - alpha [rad], continuous over time."""
        x, y = self.path[0] - self.settings.goal[0], self.path[1] - self.settings.goal[1]
        return np.hypot(x, y), self.path[2] - np.unwrap(np.arctan2(y, x))

    @property
    def potential(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The potential and the norm of its gradient, over time."""
        at = self.settings.chosen_potential(self.path[0], self.path[1])
        return np.asarray(at.phi), np.asarray(at.polar[0])


Group: TypeAlias = Sequence[Run]


@dataclass(frozen=True)
class Picture:
    """How a figure comes about: node names of its file, a group of runs each, and the drawing."""

    title: str
    draw: Callable[[Any, Sequence[Group]], None]
    nodes: tuple[str, ...] = ("/navigator",)
    period: float = CONTROL_PERIOD  # [s]
    starts: int = 0  # how many a section must have for the drawing; 0: any number
    height: float = 7.6  # [in], where the width is 7
    grid: Mapping[str, Any] = field(default_factory=dict)


def scenario(figure: str, node: str = "/navigator") -> Settings:
    """Return what the file of a figure, as "4a", says to a node. Raises GradnavError."""
    path = scenario_path(figure)
    try:
        settings = Configuration.of(parameter_file.read(path, node)).settings
    except ParameterError as error:
        raise GradnavError(f"{path}: {error}") from error
    if not settings.has_goal:
        raise GradnavError(f"{path}: goal is missing")
    return settings


def scenario_path(figure: str) -> Path:
    """Return the path of the parameter file of a figure. Raises GradnavError."""
    return shipped.parameter_path(f"figure_{figure}.yaml")


def drive(figure: str) -> list[Group]:
    """Simulate all runs of a figure, a group for each of its sections. Raises GradnavError."""
    picture = PICTURES[figure]
    sections = [scenario(figure, node) for node in picture.nodes]
    for settings in sections:
        if picture.starts not in (0, len(settings.all_starts)):
            raise GradnavError(
                f"{scenario_path(figure)}: starts: there must be {picture.starts} of them, "
                f"initial_pose included, for Fig. {figure}"
            )
    return [_simulated(settings, picture.period) for settings in sections]


def draw(figure: str, groups: Sequence[Group], path: Path, remark: str = "") -> None:
    """Draw a figure of these runs to `path`. Raises GradnavError."""
    picture = PICTURES[figure]
    with plots.figure(path, height=picture.height, **picture.grid) as axes:
        picture.draw(axes, groups)
        title, colour = f"Fig. {figure}{remark}: {picture.title}", "black"
        if failures := failed(groups):
            title, colour = f"{title}\n{fill(failures)}", VERMILION
        np.ravel(axes)[0].figure.suptitle(title, color=colour, fontsize=10)


def failed(groups: Sequence[Group]) -> str:
    """Return which runs, counted through all groups, did not arrive; empty if all did."""
    runs = [run for group in groups for run in group]
    return "; ".join(
        f"{outcome}: {', '.join(str(i) for i, run in enumerate(runs, 1) if run.outcome == outcome)}"
        for outcome in sorted({run.outcome for run in runs} - {"arrived"})
    )


def run_of(
    settings: Settings,
    t: NDArray[np.float64],
    path: NDArray[np.float64],
    outcome: str,
    yaw: float,
) -> Run:
    """Return a run with its heading made continuous from `yaw` [rad], which it starts with."""
    theta = np.unwrap(path[2])
    turns = np.round((yaw - theta[0]) / (2.0 * np.pi))
    return Run(settings, t, np.array([path[0], path[1], theta + 2.0 * np.pi * turns]), outcome)


def _simulated(settings: Settings, period: float) -> Group:
    x, y, yaw = np.array(settings.all_starts).T
    runs = simulate(Controller.of(settings), Pose.at(x, y, yaw), period, record=True)
    group = []
    for i, time in enumerate(runs.time):
        t = period * np.arange(round(time / period) + 1)
        outcome = (
            "collided" if runs.collided[i] else "arrived" if runs.arrived[i] else "not arrived"
        )
        group.append(run_of(settings, t, runs.recorded[:, : t.size, i], outcome, yaw[i]))
    return group


def _draw_portraits(axes: Any, groups: Sequence[Group]) -> None:
    """Fig. 2: the flow of eqs. (10)-(11) in the (rho, beta) plane, and runs in it."""
    for ax, group, part in zip(axes, groups, PARTS, strict=True):
        k_v, k_omega = group[0].settings.k_v, group[0].settings.k_omega
        _draw_flow(ax, k_v, k_omega)
        for run in group:
            rho, beta = run.polar
            (line,) = ax.plot(rho, beta / np.pi, color=BLUE, lw=1.8, zorder=4)
            (start,) = ax.plot(rho[0], beta[0] / np.pi, "o", ms=4, color="black", zorder=5)
        line.set_label("run")
        start.set_label("start")
        _draw_equilibria(ax, k_v)
        ax.set_title(f"{part}\n$k_v = {k_v:g}$, $k_\\omega = {k_omega:g}$", fontsize=10)
        ax.set(xlabel=r"$\rho$ [m]", xlim=(-0.1, RHO_SHOWN), ylim=(-BETA_SHOWN, BETA_SHOWN))
    n = np.arange(-3, 4)
    axes[0].set_yticks(n, [_multiple_of_pi(i) for i in n.tolist()])
    axes[0].set_ylabel(r"$\beta = \theta - \alpha$ [rad]")
    handles = axes[0].get_legend_handles_labels()
    axes[0].figure.legend(*handles, loc="outside lower center", ncols=3, frameon=False)


def _draw_flow(ax: Any, k_v: float, k_omega: float) -> None:
    rho, beta = np.meshgrid(
        np.linspace(0.0, RHO_SHOWN, 60), np.linspace(-BETA_SHOWN, BETA_SHOWN, 180) * np.pi
    )
    rho_dot = k_v * rho * np.cos(beta)  # eq. (10)
    beta_dot = (k_omega - k_v) * np.sin(beta)  # eq. (11)
    ax.streamplot(
        rho,
        beta / np.pi,
        rho_dot,
        beta_dot / np.pi,
        color="0.65",
        linewidth=0.7,
        density=(0.7, 1.6),
    )


def _draw_equilibria(ax: Any, k_v: float) -> None:
    """Mark beta = n pi on rho = 0: stable for even n if the gains are negative, else for odd n."""
    n = np.arange(-3, 4)
    stable = (n % 2 == 0) == (k_v < 0.0)
    for i in n[~stable]:
        line = ax.axhline(i, color=VERMILION, ls="--", lw=1.2, zorder=3)
    line.set_label(r"$\rho \to \infty$ exactly on it (Remark IV.4)")
    zeros = np.zeros(n.size)
    ax.plot(
        zeros[stable],
        n[stable],
        "o",
        ms=9,
        color=GREEN,
        mec="black",
        zorder=6,
        label="stable equilibrium",
    )
    ax.plot(
        zeros[~stable],
        n[~stable],
        "o",
        ms=9,
        mfc="white",
        mec="black",
        zorder=6,
        label="unstable equilibrium",
    )


def _multiple_of_pi(n: int) -> str:
    return "0" if n == 0 else f"${'-' if n < 0 else ''}{abs(n) if abs(n) > 1 else ''}\\pi$"


def _draw_twelve(ax: Any, groups: Sequence[Group]) -> None:
    """Fig. 3: the position law from twelve starts."""
    plots.draw_world(ax, groups[0][0].settings.world)
    number = 0
    for group, style, part in zip(groups, STYLES, PARTS, strict=True):
        first = number + 1
        for run in group:
            number += 1
            plots.draw_path(ax, run.path, arrows=5, **style)
            plots.label_start(ax, run.path, str(number))
        ax.plot([], [], **style, label=f"{first}-{number}: {part[4:]}")
    ax.set(xlim=(-3.2, 3.2), ylim=(-3.2, 3.2))
    ax.legend(loc="lower left")


def _draw_avoidance(ax: Any, groups: Sequence[Group]) -> None:
    """Figs. 4 and 7: runs among obstacles, over the potential."""
    (group,) = groups
    settings = group[0].settings
    plots.draw_potential(ax, settings.chosen_potential)
    plots.draw_world(ax, settings.world)
    for number, run in enumerate(group, start=1):
        plots.draw_path(ax, run.path, arrows=8, path_effects=plots.casing())
        if len(group) > 1:
            plots.label_start(ax, run.path, str(number))
    ax.set_title(
        f"law {settings.law}; eq. (22) as printed does not avoid obstacles\n"
        "lines: contours of the potential; dotted: obstacles inflated by the robot's radius",
        fontsize=10,
    )


def _draw_scenarios(axes: Any, groups: Sequence[Group]) -> None:
    """Fig. 5: scenarios 1 and 2 from top to bottom, negative and positive gains side by side."""
    for column, group, style, part in zip(axes.T, groups, STYLES, PARTS, strict=True):
        for number, (ax, run) in enumerate(zip(column, group, strict=True), start=1):
            plots.draw_world(ax, run.settings.world)
            plots.draw_path(ax, run.path, arrows=3, color=style["color"])
            ax.set_title(f"{part}, scenario {number}", fontsize=10)
            ax.set(xlim=(-1.9, 1.9), ylim=(-0.6, 1.7))
            ax.label_outer()


def _draw_distances(ax: Any, groups: Sequence[Group]) -> None:
    """Fig. 6: rho over time, with the robot's limits and, exactly, without any: eq. (20)."""
    for group, style, part in zip(groups, STYLES, PARTS, strict=True):
        for number, (run, marker) in enumerate(zip(group, ("o", "^"), strict=True), start=1):
            mark = {"marker": marker, "markevery": 0.1, "color": style["color"]}
            mark["mfc"] = "white" if style["ls"] == "--" else style["color"]
            rho, beta = run.polar
            ax.plot(run.t, rho, **mark, label=f"{part}, scenario {number}")
            gains = run.settings.k_v, run.settings.k_omega
            exact = closed_form.rho(run.t, rho[0], beta[0], *gains)
            ax.plot(run.t, exact, color=style["color"], ls="--", lw=1.2)
    ax.plot([], [], color="black", ls="--", lw=1.2, label="exact, without limits")
    ax.set(xlabel="t [s]", ylabel=r"$\rho$ [m]", xlim=(0.0, None), ylim=(0.0, None))
    ax.grid(alpha=0.3)
    ax.legend()


def _draw_potentials(axes: Any, groups: Sequence[Group]) -> None:
    """Fig. 8: phi above and the norm of its gradient below, over time."""
    units = ((r"\psi", "1", "1/m"), ("U", "m$^2$/s", "m/s"))
    for (above, below), (run,), (name, unit, slope) in zip(axes.T, groups, units, strict=True):
        phi, mu = run.potential
        above.plot(run.t, phi, color=BLUE)
        below.plot(run.t, mu, color=VERMILION)
        above.set_title(rf"$\varphi = {name}$", fontsize=10)
        above.set(ylabel=rf"${name}$ [{unit}]")
        below.set(xlabel="t [s]", ylabel=rf"$\|\nabla {name}\|$ [{slope}]")
    for ax in axes.flat:
        ax.set(xlim=(0.0, None), ylim=(0.0, None))
        ax.grid(alpha=0.3)


PICTURES: Mapping[str, Picture] = {
    "2": Picture(
        "phase portraits of the position law",
        _draw_portraits,
        BOTH_SIGNS,
        grid={"ncols": 2, "sharey": True},
    ),
    "3": Picture(
        "position law from 12 starts\n"
        "4 and 6 face exactly away from the goal, 7 and 10 exactly towards it",
        _draw_twelve,
        BOTH_SIGNS,
        FINE,
        height=7.4,
    ),
    "4a": Picture(r"navigation function $\psi$", _draw_avoidance),
    "4b": Picture("attractive-repulsive potential $U$", _draw_avoidance),
    "5": Picture(
        "position law with the limits of a TurtleBot3",
        _draw_scenarios,
        BOTH_SIGNS,
        starts=2,
        height=5.0,
        grid={"nrows": 2, "ncols": 2, "sharex": True, "sharey": True},
    ),
    "6": Picture(
        "distance to the goal in Fig. 5", _draw_distances, BOTH_SIGNS, starts=2, height=4.5
    ),
    "7a": Picture(r"navigation function $\psi$", _draw_avoidance),
    "7b": Picture("attractive-repulsive potential $U$", _draw_avoidance),
    "8": Picture(
        "potential and gradient along the runs of Fig. 7",
        _draw_potentials,
        ("/navigator", "/attractive_repulsive"),
        starts=1,
        height=5.0,
        grid={"nrows": 2, "ncols": 2, "sharex": "col"},
    ),
}

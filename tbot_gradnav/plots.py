# SPDX-License-Identifier: Apache-2.0
"""Pictures of worlds, potentials and paths. Every function draws on the axes it is given."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.certify import Landscape, basins
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.files import written_whole
from tbot_gradnav.potentials import Potential
from tbot_gradnav.simulate import extent
from tbot_gradnav.world import World

GRID = 301  # points a side of the contours' grid
LEVELS = 24
PATH_COLOUR = "#d55e00"  # vermilion of the Okabe-Ito palette, safe for the colour-blind
GOAL_COLOUR = "#009e73"
START_COLOUR = "black"
OBSTACLE_COLOUR = "0.35"
INFLATION_COLOUR = "0.35"


@contextmanager
def figure(path: Path | str, width: float = 7.0, height: float = 7.0, **grid: Any) -> Iterator[Any]:
    """Give the axes of a new figure (an array of them if `grid` has rows), saved to `path` after.

    Raises GradnavError where matplotlib is missing or the picture cannot be written.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise GradnavError("pictures need matplotlib: pip install tbot_gradnav[plot]") from error
    drawing = Figure(figsize=(width, height), layout="constrained")
    kind, kinds = Path(path).suffix.lstrip("."), drawing.canvas.get_supported_filetypes()
    if kind not in kinds:
        raise GradnavError(f"{path}: no such kind of picture; it must end in .{', .'.join(kinds)}")
    yield drawing.subplots(**grid)
    with written_whole(path) as temporary:
        drawing.savefig(temporary, dpi=130, format=kind)


def draw_world(ax: Any, world: World) -> None:
    """Draw obstacles, their inflation, boundary and goal; axes in metres, equal scale."""
    from matplotlib.patches import Circle

    for name, circle in world.obstacles.items():
        centre = (circle.x, circle.y)
        ax.add_patch(Circle(centre, circle.radius, color=OBSTACLE_COLOUR, zorder=3))
        ax.add_patch(
            Circle(
                centre,
                circle.radius + world.robot_radius,
                fill=False,
                ls=":",
                color=INFLATION_COLOUR,
                zorder=3,
            )
        )
        ax.annotate(name, centre, color="white", ha="center", va="center", fontsize=7, zorder=4)
    c_x, c_y, radius = extent(world)
    if world.bounded:
        ax.add_patch(Circle((c_x, c_y), radius, fill=False, color="black", lw=1.5, zorder=3))
    ax.plot(
        *world.goal,
        marker="*",
        ms=14,
        color=GOAL_COLOUR,
        mec="black",
        mew=0.7,
        zorder=6,
        ls="",
        label="goal",
    )
    ax.set(
        xlabel="x [m]",
        ylabel="y [m]",
        aspect="equal",
        xlim=(c_x - 1.05 * radius, c_x + 1.05 * radius),
        ylim=(c_y - 1.05 * radius, c_y + 1.05 * radius),
    )


def draw_potential(ax: Any, potential: Potential) -> None:
    """Draw contours of a potential over the free space, as many points between any two levels."""
    world = potential.world
    c_x, c_y, radius = extent(world)
    steps = np.linspace(-1.05 * radius, 1.05 * radius, GRID)
    x, y = np.meshgrid(c_x + steps, c_y + steps)
    free = np.greater(world.clearance(x, y), 0.0)
    phi = np.ma.masked_where(~free, potential(x, y).phi)
    levels = np.unique(np.quantile(phi.compressed(), np.linspace(0.0, 1.0, LEVELS)))
    if levels.size > 1:
        ranks = np.ma.masked_array(np.interp(phi, levels, np.linspace(0, 1, levels.size)), ~free)
        shades = np.linspace(0.0, 1.0, LEVELS)
        ax.contourf(x, y, ranks, shades, cmap="Blues_r", alpha=0.55, zorder=0)
        ax.contour(x, y, ranks, shades, colors="white", linewidths=0.5, zorder=1)


def draw_path(ax: Any, path: NDArray[np.float64], arrows: int = 12, **line: Any) -> None:
    """Draw a path of shape (3, steps): x, y [m] and theta [rad], the heading as arrows."""
    style = {"color": PATH_COLOUR, "lw": 1.8, "zorder": 5} | line
    x, y, theta = path
    ax.plot(x, y, **style)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.unique(np.searchsorted(travelled, np.linspace(0.0, travelled[-1], arrows)))
    ax.quiver(
        x[at],
        y[at],
        np.cos(theta[at]),
        np.sin(theta[at]),
        angles="xy",
        scale=28,
        width=0.0035,
        color=style["color"],
        zorder=style["zorder"],
    )
    ax.plot(x[0], y[0], marker="o", ms=6, color=START_COLOUR, zorder=6, ls="")
    ax.quiver(
        x[0],
        y[0],
        np.cos(theta[0]),
        np.sin(theta[0]),
        angles="xy",
        scale=18,
        width=0.005,
        color=START_COLOUR,
        zorder=6,
    )


def draw_landscape(ax: Any, found: Landscape) -> None:
    """Draw critical points; where there are spurious minima, mark what flows into them."""
    if found.spurious:
        x, y, owner = basins(found)
        lost = [p in found.spurious for p in found.minima]
        stranded = np.array([*lost, True])[owner]  # -1, reaching none, is the last
        ax.plot(
            x[stranded],
            y[stranded],
            "x",
            ms=4,
            mew=0.8,
            color=PATH_COLOUR,
            zorder=2,
            label="starts that end elsewhere than at the goal",
        )
    styles = {
        "minimum": ("v", "white", "minimum other than the goal"),
        "saddle": ("D", "none", "saddle"),
        "maximum": ("^", "none", "maximum"),
        "degenerate": ("s", "none", "degenerate"),
    }
    shown = [p for p in found.points if p.kind != "minimum" or p in found.spurious]
    for kind, (marker, fill, label) in styles.items():
        at = np.array([(p.x, p.y) for p in shown if p.kind == kind]).reshape(-1, 2)
        if len(at):
            ax.plot(*at.T, marker, ms=9, mfc=fill, mec="black", mew=1.3, zorder=6, label=label)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, -0.16), ncols=2, frameon=False)

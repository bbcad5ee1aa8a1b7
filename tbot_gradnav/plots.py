# SPDX-License-Identifier: Apache-2.0
"""Pictures of worlds, potentials and paths. Every function draws on the axes it is given."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.certify import Landscape, basins
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.files import written_whole
from tbot_gradnav.lattice import Lattice
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.potentials import Potential
from tbot_gradnav.shapes import Circle
from tbot_gradnav.simulate import extent
from tbot_gradnav.world import Boundary, World

GRID = 301  # points a side of the contours' grid
LEVELS = 24
PATH_COLOUR = "#d55e00"  # vermilion of the Okabe-Ito palette, safe for the colour-blind
GOAL_COLOUR = "#009e73"
START_COLOUR = "black"
OBSTACLE_COLOUR = "0.35"
INFLATION_COLOUR = "0.35"
TITLE = 0.2  # [in] what title and labels take more of the height than of the width
WALL_SHADE, UNKNOWN_SHADE = 0.2, 0.75  # 0 is black


def picture(path: Path | str) -> Path:
    """Return the path of a picture to be drawn.

    Raises GradnavError where matplotlib is missing, or for a kind of file that it cannot write.
    """
    try:
        from matplotlib.backend_bases import FigureCanvasBase
    except ImportError as error:
        raise GradnavError("pictures need matplotlib: pip install tbot_gradnav[plot]") from error
    kind, kinds = Path(path).suffix.lstrip("."), FigureCanvasBase.get_supported_filetypes()
    if kind not in kinds:
        raise GradnavError(f"{path}: no such kind of picture; it must end in .{', .'.join(kinds)}")
    return Path(path)


@contextmanager
def figure(path: Path | str, width: float = 7.0, height: float = 7.0, **grid: Any) -> Iterator[Any]:
    """Give the axes of a new figure (an array of them if `grid` has rows), saved to `path` after.

    Raises GradnavError where matplotlib is missing or the picture cannot be written.
    """
    target = picture(path)
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(width, height), layout="constrained")
    yield drawing.subplots(**grid)
    with written_whole(target) as temporary:
        drawing.savefig(temporary, dpi=130, format=target.suffix.lstrip("."))


def draw_world(ax: Any, world: World, goal_heading: tuple[float, float] | None = None) -> None:
    """Draw obstacles, their inflation, boundary and goal; axes in metres, equal scale.

    `goal_heading` (cos, sin) is drawn as an arrow, if the goal asks for one.
    """
    if goal_heading is not None:
        ax.quiver(
            *world.goal,
            *goal_heading,
            angles="xy",
            scale=14,
            width=0.008,
            color=GOAL_COLOUR,
            ec="black",
            lw=0.7,
            zorder=6,
        )
    for name, shape in world.obstacles.items():
        ax.fill(*shape.outline, color=OBSTACLE_COLOUR, lw=0, zorder=3)
        ax.annotate(
            name, shape.centre, color="white", ha="center", va="center", fontsize=7, zorder=4
        )
    if world.bounded:
        x, y = world.boundary.region.outline
        ax.plot(np.append(x, x[0]), np.append(y, y[0]), color="black", lw=1.5, zorder=3)
    if world.walls is not None:
        _draw_map(ax, world.walls.occupancy)
    (edge_x, edge_y), margin = _edge(world), 0.05 * extent(world)[2]
    if world.obstacles or world.walls is not None:
        _draw_inflation(ax, world)
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
        xlim=(np.min(edge_x) - margin, np.max(edge_x) + margin),
        ylim=(np.min(edge_y) - margin, np.max(edge_y) + margin),
    )


def _edge(world: World) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points (x, y) [m] about what is worth seeing."""
    if world.bounded:
        return world.boundary.region.outline
    return Circle(*extent(world)).outline if world.walls is None else world.walls.corners


def height(world: World, width: float = 7.0) -> float:
    """Return the height [in] of a figure of some width [in] that a world fills."""
    x, y = _edge(world)
    return float(np.clip(width * np.ptp(y) / np.ptp(x) + TITLE, 0.4 * width, 1.6 * width))


def _draw_map(ax: Any, occupancy: Occupancy) -> None:
    """Draw the cells of a map that are not free, unknown ones lighter."""
    rows, columns = occupancy.cells.shape
    corners = Lattice(*occupancy.origin, occupancy.resolution, rows + 1, columns + 1)
    shade = np.where(occupancy.cells < 0, UNKNOWN_SHADE, WALL_SHADE)
    ax.pcolormesh(
        *corners.nodes,
        np.ma.masked_where(occupancy.free, shade),
        cmap="gray",
        vmin=0.0,
        vmax=1.0,
        rasterized=True,
        zorder=2,
    )


def _draw_inflation(ax: Any, world: World) -> None:
    """Draw where the robot's centre may not go, as a dotted line around each obstacle."""
    obstacles = replace(world, boundary=Boundary())
    x, y = _grid(world)
    ax.contour(
        x,
        y,
        obstacles.clearance(x, y),
        [0.0],
        colors=INFLATION_COLOUR,
        linestyles="dotted",
        linewidths=1.0,
        zorder=3,
    )


def _grid(world: World) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    c_x, c_y, radius = extent(world)
    steps = np.linspace(-1.05 * radius, 1.05 * radius, GRID)
    x, y = np.meshgrid(c_x + steps, c_y + steps)
    return x, y


def draw_potential(ax: Any, potential: Potential) -> None:
    """Draw contours of a potential over the free space, as many points between any two levels."""
    world = potential.world
    x, y = _grid(world)
    free = np.greater(world.clearance(x, y), 0.0)
    phi = np.ma.masked_where(~free, potential.all_seen()(x, y).phi)
    levels = np.unique(np.quantile(phi.compressed(), np.linspace(0.0, 1.0, LEVELS)))
    if levels.size > 1:
        ranks = np.ma.masked_array(np.interp(phi, levels, np.linspace(0, 1, levels.size)), ~free)
        shades = np.linspace(0.0, 1.0, LEVELS)
        ax.contourf(x, y, ranks, shades, cmap="Blues_r", alpha=0.55, zorder=0)
        ax.contour(x, y, ranks, shades, colors="white", linewidths=0.5, zorder=1)


def draw_path(ax: Any, path: NDArray[np.float64], arrows: int = 12, **line: Any) -> None:
    """Draw a path of shape (3, steps): x, y [m] and theta [rad], the heading as arrows."""
    style = {"color": PATH_COLOUR, "lw": 1.8, "zorder": 5} | line
    x, y = path[:2]
    ax.plot(x, y, **style)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.unique(np.searchsorted(travelled, np.linspace(0.0, travelled[-1], arrows + 2)[1:-1]))
    _draw_headings(ax, path[:, at], 0.23, color=style["color"], zorder=style["zorder"])
    ax.plot(x[0], y[0], marker="o", ms=6, color=START_COLOUR, zorder=6, ls="")
    _draw_headings(ax, path[:, :1], 0.36, color=START_COLOUR, zorder=6)


def casing() -> list[Any]:
    """Return the path_effects of a line that stands out on a shaded ground, in grey too."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=3.6, foreground="white")]


def _draw_headings(ax: Any, path: NDArray[np.float64], length: float, **style: Any) -> None:
    """Draw an arrow of some length [in] along the heading at each pose of `path`."""
    x, y, theta = path
    inches = {"units": "inches", "scale_units": "inches", "angles": "xy"}
    shape = {"scale": 1.0 / length, "width": 0.09 * length}
    ax.quiver(x, y, np.cos(theta), np.sin(theta), **inches, **shape, **style)


def label_start(ax: Any, path: NDArray[np.float64], text: str) -> None:
    """Write a word beside the start of a path, where neither its heading nor its course is."""
    theta = path[2, 0]
    side = np.array([-np.sin(theta), np.cos(theta)])
    course = path[:2, path.shape[1] // 8] - path[:2, 0]
    offset = -11.0 * side if side @ course > 0.0 else 11.0 * side
    ax.annotate(
        text,
        path[:2, 0],
        offset,
        textcoords="offset points",
        ha="center",
        va="center",
        fontweight="bold",
        zorder=7,
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

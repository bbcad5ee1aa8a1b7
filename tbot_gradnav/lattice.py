# SPDX-License-Identifier: Apache-2.0
"""Values at the nodes of a square lattice, and what is between them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.elementwise import choose, larger, smaller
from tbot_gradnav.unicycle import Floats

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lattice:
    """A lattice of rows along its own y axis and columns along its own x axis.

    x, y: the first node [m]; yaw [rad] by which the axes are turned; spacing [m] of the nodes.
    """

    x: float
    y: float
    yaw: float
    spacing: float
    rows: int
    columns: int

    @cached_property
    def nodes(self) -> tuple[Array, Array]:
        """The nodes (x, y) [m], of shape (rows, columns)."""
        u, w = np.meshgrid(np.arange(float(self.columns)), np.arange(float(self.rows)))
        return self.world(u, w)

    def world(self, column: Floats, row: Floats) -> tuple[Array, Array]:
        """Return the points (x, y) [m] of fractional columns and rows."""
        cos, sin = self._turn
        u, w = self.spacing * np.asarray(column), self.spacing * np.asarray(row)
        return self.x + cos * u - sin * w, self.y + sin * u + cos * w

    def place(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the fractional column and row of points (x, y) [m]."""
        (cos, sin), dx, dy = self._turn, x - self.x, y - self.y
        return (cos * dx + sin * dy) / self.spacing, (cos * dy - sin * dx) / self.spacing

    def sampled(
        self, values: Array, x: Floats, y: Floats, beyond: float
    ) -> tuple[Floats, Floats, Floats]:
        """Return value and gradient of `values` (one a node), bilinear, at points (x, y) [m].

        Outside the lattice the value at its nearest point goes on with slope `beyond` [1/m].
        """
        u, w = self.place(x, y)
        in_u = smaller(larger(u, 0.0), self.columns - 1.0)
        in_w = smaller(larger(w, 0.0), self.rows - 1.0)
        i, j = _whole(smaller(in_u, self.columns - 1.5)), _whole(smaller(in_w, self.rows - 1.5))
        s, t, k = in_u - i, in_w - j, j * self.columns + i
        flat, n = values.reshape(-1), self.columns
        a, b, c, d = flat[k], flat[k + 1], flat[k + n], flat[k + n + 1]
        left, right = a + t * (c - a), b + t * (d - b)
        g_u, g_w = right - left, (c - a) + s * (a - b - c + d)
        out_u, out_w = u - in_u, w - in_w
        out = (out_u * out_u + out_w * out_w) ** 0.5
        steep = beyond * self.spacing / larger(out, 1e-150)
        g_u = choose(out_u != 0.0, 0.0, g_u) + steep * out_u
        g_w = choose(out_w != 0.0, 0.0, g_w) + steep * out_w
        cos, sin = self._turn
        return (
            left + s * (right - left) + beyond * self.spacing * out,
            (cos * g_u - sin * g_w) / self.spacing,
            (sin * g_u + cos * g_w) / self.spacing,
        )

    @cached_property
    def _turn(self) -> tuple[float, float]:
        return float(np.cos(self.yaw)), float(np.sin(self.yaw))


def _whole(a: Floats) -> Any:
    """Return the whole part of a, to index with."""
    return a.astype(np.intp) if isinstance(a, np.ndarray) else int(a)

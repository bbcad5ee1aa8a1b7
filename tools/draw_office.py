# SPDX-License-Identifier: Apache-2.0
"""Draw the plan config/maps/office.pgm, as map_server would have saved it, with its YAML file.

usage: python tools/draw_office.py
"""

import math
from pathlib import Path

import numpy as np

MAPS = Path(__file__).parents[1] / "config" / "maps"
RESOLUTION = 0.05  # [m]
WIDTH, HEIGHT, AROUND = 12.0, 8.0, 0.5  # [m] of the building, and of what is unknown around it
WALL = 0.1  # [m]
OCCUPIED, UNKNOWN, FREE = 0, 205, 254  # shades that map_server saves

INNER_WALLS = [  # x, y, width, height [m] from the building's lower left corner
    (0.0, 3.2, 12.0, WALL),
    (0.0, 4.8, 12.0, WALL),
    (3.6, 0.0, WALL, 3.3),
    (7.4, 0.0, WALL, 3.3),
    (4.6, 4.8, WALL, 3.2),
    (9.0, 4.8, WALL, 3.2),
]
DOORS = [
    (1.2, 3.2, 0.8, WALL),
    (5.2, 3.2, 0.8, WALL),
    (10.2, 3.2, 0.8, WALL),
    (2.2, 4.8, 0.9, WALL),
    (6.4, 4.8, 0.9, WALL),
    (10.4, 4.8, 0.7, WALL),
    (9.0, 6.2, WALL, 0.8),
]
FURNITURE = [
    (0.1, 0.1, 0.6, 1.6),
    (1.4, 0.9, 1.4, 0.7),
    (4.4, 0.1, 1.6, 0.7),
    (6.6, 1.3, 0.8, 1.6),
    (8.4, 1.2, 2.2, 1.0),
    (11.3, 0.1, 0.6, 2.4),
    (0.1, 7.2, 2.6, 0.7),
    (3.4, 5.6, 1.2, 0.7),
    (5.3, 6.1, 2.6, 0.9),
    (9.8, 7.2, 2.1, 0.7),
    (3.2, 3.9, 0.3, 0.3),
    (7.9, 3.8, 0.3, 0.3),
]
ROUND = [(11.2, 5.6, 0.25), (1.2, 5.9, 0.3), (6.1, 2.2, 0.2)]  # x, y, radius [m]


def plan() -> np.ndarray:
    """Return the shades, the first row on top."""
    columns, rows = (math.ceil((side + 2 * AROUND) / RESOLUTION) for side in (WIDTH, HEIGHT))
    x, y = np.meshgrid(np.arange(columns), np.arange(rows)[::-1])
    x, y = ((cell + 0.5) * RESOLUTION - AROUND for cell in (x, y))

    def inside(left: float, low: float, width: float, height: float) -> np.ndarray:
        return (x > left) & (x < left + width) & (y > low) & (y < low + height)

    shades = np.full(x.shape, UNKNOWN, dtype=np.uint8)
    shades[inside(0.0, 0.0, WIDTH, HEIGHT)] = OCCUPIED
    shades[inside(WALL, WALL, WIDTH - 2 * WALL, HEIGHT - 2 * WALL)] = FREE
    for rectangle in INNER_WALLS:
        shades[inside(*rectangle)] = OCCUPIED
    for rectangle in DOORS:
        shades[inside(*rectangle)] = FREE
    for rectangle in FURNITURE:
        shades[inside(*rectangle)] = OCCUPIED
    for c_x, c_y, radius in ROUND:
        shades[np.hypot(x - c_x, y - c_y) < radius] = OCCUPIED
    return shades


def main() -> None:
    """Write both files."""
    shades = plan()
    header = f"P5\n{shades.shape[1]} {shades.shape[0]}\n255\n"
    (MAPS / "office.pgm").write_bytes(header.encode() + shades.tobytes())
    (MAPS / "office.yaml").write_text(
        "# SPDX-License-Identifier: Apache-2.0\n"
        "# A map as map_server saves one, for map_office.yaml; drawn by tools/draw_office.py.\n"
        "image: office.pgm\n"
        "mode: trinary\n"
        f"resolution: {RESOLUTION}\n"
        f"origin: [{-AROUND}, {-AROUND}, 0]\n"
        "negate: 0\n"
        "occupied_thresh: 0.65\n"
        "free_thresh: 0.196\n"
    )


if __name__ == "__main__":
    main()

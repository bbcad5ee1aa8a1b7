# SPDX-License-Identifier: Apache-2.0
"""Maps in files as ROS 2's map_server reads and writes them: YAML beside PGM or PNG.

What the keys mean is documented at https://docs.nav2.org (map server); values are compared with
the thresholds as map_server does, strictly.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav import parameter_file
from tbot_gradnav.errors import GradnavError, ParameterError
from tbot_gradnav.occupancy import FREE, OCCUPIED, UNKNOWN, Occupancy, refuse_size
from tbot_gradnav.parameters import (
    Checked,
    Choice,
    Flag,
    Number,
    Numbers,
    Text,
    build,
    field,
    parameters_of,
    refuse_unknown,
)

Array = NDArray[np.float64]

HEADER = re.compile(rb"(P[25])" + 3 * rb"(?:\s+|#[^\n]*\n)+(\d+)" + rb"(\s|#[^\n]*\n)")
LARGEST_FILE = 200_000_000  # bytes
IGNORED = ("map_load_time", "cost_translation_table")  # harmless keys seen beside map_server's


class Image(NamedTuple):
    """Brightness 0 (black) to 1 (white) and opacity 0 to 1 of each pixel, the first row on top."""

    shade: Array
    opacity: Array | None  # where the image knows of it


@dataclass(frozen=True)
class Description(Checked):
    """What a map's YAML file says."""

    image: str = field("", Text("image file, relative to this file"))
    resolution: float = field(0.0, Number("side of a pixel", "m", above=0.0))
    origin: tuple[float, ...] = field(
        (), Numbers("lower left corner", "m, m, rad", (3,), poses=True)
    )
    occupied_thresh: float = field(0.65, Number("occupied above", at_least=0.0, at_most=1.0))
    free_thresh: float = field(0.25, Number("free below", at_least=0.0, at_most=1.0))
    negate: bool = field(False, Flag("whether white is occupied"))
    mode: str = field("trinary", Choice("what shades mean", ("trinary", "scale", "raw")))

    def __post_init__(self) -> None:
        """Check each value, then the thresholds."""
        super().__post_init__()
        if self.free_thresh >= self.occupied_thresh:
            raise ParameterError(
                "free_thresh",
                self.free_thresh,
                f"must be below occupied_thresh {self.occupied_thresh:g}",
            )

    def cells(self, image: Image) -> NDArray[np.int8]:
        """Return the cells, the first row lowest, of an image."""
        shade = image.shade
        if self.mode == "raw":
            level = np.rint(255.0 * shade)
            cells = np.where(level <= OCCUPIED, level, UNKNOWN)
        else:
            if self.mode == "trinary" and image.opacity is not None:  # one channel among others
                shade = (3.0 * shade + image.opacity) / 4.0
            cells = self._judged(shade if self.negate else 1.0 - shade)
            if self.mode == "scale" and image.opacity is not None:
                cells = np.where(image.opacity < 1.0, UNKNOWN, cells)
        return np.ascontiguousarray(cells[::-1].astype(np.int8))

    def _judged(self, occupied: Array) -> Array:
        """Return the cells for how occupied each is, 0 to 1."""
        low, high = self.free_thresh, self.occupied_thresh
        between = np.rint((occupied - low) / (high - low) * OCCUPIED)
        unclear = between if self.mode == "scale" else UNKNOWN
        return np.where(occupied > high, OCCUPIED, np.where(occupied < low, FREE, unclear))


def read(path: Path | str) -> Occupancy:
    """Return the map that a YAML file describes. Raises GradnavError.

    Read again only when it or its image has changed.
    """
    path = Path(path)
    description = _description(path, _age(path))
    image = path.parent / description.image
    return _read(path, _age(path), image, _age(image))


@lru_cache(maxsize=4)
def _description(path: Path, _: int) -> Description:
    values = parameter_file.load_yaml(path)
    if not isinstance(values, dict):
        raise GradnavError(f"{path}: it is not a map's YAML file: no names and values")
    if isinstance(values.get("negate"), int):
        values["negate"] = bool(values["negate"])
    for name in ("image", "resolution", "origin"):
        if name not in values:
            raise GradnavError(f"{path}: {name} is missing")
    try:
        known = {name: value for name, value in values.items() if name not in IGNORED}
        description = build(Description, known)
        refuse_unknown(known, parameters_of(Description))
    except ParameterError as error:
        raise GradnavError(f"{path}: {error}") from error
    return description


@lru_cache(maxsize=4)
def _read(path: Path, _: int, image: Path, __: int) -> Occupancy:
    description = _description(path, _)
    try:
        pixels = _reader(image)(image)
        refuse_size(*reversed(pixels.shade.shape))
    except OSError as error:
        raise GradnavError(f"{image}: {error.strerror or error}") from error
    except GradnavError as error:
        raise GradnavError(f"{image}: {error}") from error
    try:
        return Occupancy(description.cells(pixels), description.resolution, *description.origin)
    except GradnavError as error:
        raise GradnavError(f"{path}: {error}") from error


def _age(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except (OSError, ValueError) as error:
        raise GradnavError(f"{path}: {getattr(error, 'strerror', error)}") from error


def _reader(path: Path) -> Callable[[Path], Image]:
    readers: Mapping[str, Callable[[Path], Image]] = {".pgm": _pgm, ".png": _png}
    if path.suffix.lower() not in readers:
        raise GradnavError("maps are read from .pgm and .png images")
    return readers[path.suffix.lower()]


def _pgm(path: Path) -> Image:
    """Read a portable graymap, plain (P2) or binary (P5)."""
    if path.stat().st_size > LARGEST_FILE:
        raise GradnavError(f"it is larger than {LARGEST_FILE} bytes")
    data = path.read_bytes()
    header = HEADER.match(data)
    if header is None:
        raise GradnavError("it is not a PGM image: no header P2 or P5, width, height and maximum")
    width, height, largest = (int(number[:20]) for number in header.groups()[1:4])
    refuse_size(width, height)
    if not 1 <= largest <= 65535:
        raise GradnavError(f"its maximum {largest} is not allowed; must be from 1 to 65535")
    body = data[header.end() :]
    values = _plain(body) if header[1] == b"P2" else _binary(body, largest, width * height)
    if values.size < width * height:
        raise GradnavError(f"it ends after {values.size} of {width} x {height} pixels")
    shade = values[: width * height].reshape(height, width) / largest
    if shade.max() > 1.0:
        raise GradnavError(f"a pixel is above its maximum {largest}")
    return Image(shade, None)


def _plain(body: bytes) -> Array:
    words = re.sub(rb"#[^\n]*", b" ", body).split()
    try:
        return np.array([int(word[:20]) for word in words if word[:1] != b"-"], dtype=float)
    except ValueError as error:
        raise GradnavError("a pixel is not a number") from error


def _binary(body: bytes, largest: int, pixels: int) -> Array:
    kind = np.dtype(">u2" if largest > 255 else "u1")
    count = min(pixels, len(body) // kind.itemsize)
    return np.frombuffer(body, kind, count).astype(float)


def _png(path: Path) -> Image:
    try:
        from matplotlib.image import imread
    except ImportError as error:
        raise GradnavError("PNG maps need matplotlib: pip install tbot_gradnav[plot]") from error
    try:
        pixels: Any = imread(path)  # of shape (height, width) or (height, width, 2 to 4), 0 to 1
    except (ValueError, SyntaxError) as error:  # whatever Pillow says of what is no PNG
        raise GradnavError(f"it is not a PNG image: {error}") from error
    if pixels.ndim == 2:
        return Image(pixels.astype(float), None)
    channels = pixels.shape[2]
    opacity = pixels[..., -1].astype(float) if channels in (2, 4) else None
    return Image(pixels[..., : channels - (channels in (2, 4))].mean(axis=2, dtype=float), opacity)

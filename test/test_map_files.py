# SPDX-License-Identifier: Apache-2.0
"""Maps from files, as map_server reads them, and from messages; and what is wrong with some."""

from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CONFIG
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.map_files import read
from tbot_gradnav.occupancy import Occupancy
from tbot_gradnav.settings import Settings
from tbot_gradnav.walls import Walls

SHADES = [0, 49, 89, 90, 100, 127, 128, 191, 192, 205, 206, 254, 255]


@pytest.fixture
def map_file(tmp_path):
    """Give a function that writes a map of some bytes or shades and returns its path."""

    def write(content, yaml="", name="plan.pgm", **keys):
        if not isinstance(content, bytes):
            shades = np.atleast_2d(np.array(content, dtype=np.uint8))
            content = b"P5\n%d %d\n255\n" % shades.shape[::-1] + shades.tobytes()
        (tmp_path / name).write_bytes(content)
        entries = {"image": name, "resolution": 0.1, "origin": [-1.0, 2.0, 0.0]} | keys
        lines = [f"{key}: {value}\n" for key, value in entries.items() if value is not None]
        path = tmp_path / "plan.yaml"
        path.write_text("".join(lines) + yaml)
        return path

    return write


def cell(shade, mode, negate=False, occupied=0.65, free=0.25):
    """Return what map_server makes of a grey pixel, said in other words than the code's."""
    p = shade / 255 if negate else (255 - shade) / 255
    if mode == "raw":
        return shade if shade <= 100 else -1
    if p > occupied:
        return 100
    if p < free:
        return 0
    return -1 if mode == "trinary" else round((p - free) / (occupied - free) * 100)


@pytest.mark.parametrize("negate", [0, 1, "true", "false"])
@pytest.mark.parametrize("mode", ["trinary", "scale", "raw", None])
def test_each_shade_means_what_it_means_to_map_server(map_file, mode, negate):
    occupancy = read(map_file(SHADES, mode=mode, negate=negate))
    wanted = [cell(s, mode or "trinary", negate in (1, "true")) for s in SHADES]
    assert occupancy.cells.tolist() == [wanted]


def test_thresholds_are_heeded_strictly(map_file):
    path = map_file([51, 153, 204], negate=1, occupied_thresh=0.6, free_thresh=0.2)
    assert read(path).cells.tolist() == [[-1, -1, 100]]  # 0.2, 0.6, 0.8


def test_the_last_row_of_the_image_is_the_lowest_and_the_origin_its_corner(map_file):
    walls = Walls(read(map_file([[254, 254, 0], [254, 254, 254], [254, 254, 254]])))
    assert walls.distance(-0.75, 2.25).d == pytest.approx(-0.05)  # the only occupied cell
    assert walls.distance(-0.75, 2.15).d == pytest.approx(0.05)
    assert walls.distance(-0.85, 2.15).d == pytest.approx(0.05 * 2**0.5)
    assert walls.distance(-1.2, 2.15).d == pytest.approx(-0.2)


def test_plain_and_binary_images_with_comments_and_of_either_depth_are_the_same(map_file):
    plain = b"P2 # plain\n# a comment\n3 2\n255\n0 254 205 # more\n254 0 205\n"
    binary = b"P5\n#by hand\n3 2\n255\n" + bytes([0, 254, 205, 254, 0, 205])
    deep = b"P5 3 2 65535\n" + np.array([0, 65278, 52685, 65278, 0, 52685], ">u2").tobytes()
    found = [
        read(map_file(image, free_thresh=0.196)).cells.tolist() for image in (plain, binary, deep)
    ]
    assert found[0] == found[1] == found[2] == [[0, 100, -1], [100, 0, -1]]


def test_png_images_of_grey_and_colour_with_and_without_opacity(map_file, tmp_path):
    image = pytest.importorskip("matplotlib.image", reason="needs matplotlib")
    grey = np.array([[0.0, 1.0, 0.5]])
    opaque = np.stack([grey, grey, grey, np.ones_like(grey)], axis=-1)
    clear = opaque * [1.0, 1.0, 1.0, 0.0]
    path = map_file(b"", name="plan.png")
    image.imsave(tmp_path / "plan.png", opaque[..., :3])
    assert read(path).cells.tolist() == [[100, 0, -1]]
    image.imsave(tmp_path / "plan.png", clear)
    # map_server counts opacity as a fourth channel unless mode is scale
    assert read(path).cells.tolist() == [[100, -1, -1]]
    assert read(map_file((tmp_path / "plan.png").read_bytes(), name="plan.png", mode="scale"))
    assert read(tmp_path / "plan.yaml").cells.tolist() == [[-1, -1, -1]]


def test_unknown_and_doubtful_cells_are_not_free():
    cells = np.array([[-1, 0, 49, 50, 100]], dtype=np.int8)
    assert Occupancy(cells, 0.1).free.tolist() == [[False, True, True, False, False]]


def test_a_changed_file_is_read_again(map_file):
    path = map_file([0, 254])
    assert read(path).cells.tolist() == [[100, 0]]
    assert read(path) is read(path)
    map_file([254, 0, 0])
    assert read(path).cells.tolist() == [[0, 100, 100]]


def message(occupancy):
    """Return the nav_msgs/OccupancyGrid of a map, as far as it is read."""
    rows, columns = occupancy.cells.shape
    position = SimpleNamespace(x=occupancy.x, y=occupancy.y, z=0.0)
    q = SimpleNamespace(x=0.0, y=0.0, z=np.sin(occupancy.yaw / 2), w=np.cos(occupancy.yaw / 2))
    origin = SimpleNamespace(position=position, orientation=q)
    resolution = float(np.float32(occupancy.resolution))
    info = SimpleNamespace(width=columns, height=rows, resolution=resolution, origin=origin)
    return SimpleNamespace(info=info, data=occupancy.cells.ravel().tolist())


def test_a_message_and_a_file_are_the_same_map():
    office = read(CONFIG / "maps" / "office.yaml")
    turned = Occupancy(office.cells, office.resolution, 1.0, -2.0, 2.5)
    for occupancy in (office, turned):
        heard = Occupancy.of(message(occupancy))
        assert np.array_equal(heard.cells, occupancy.cells)
        assert heard.resolution == pytest.approx(occupancy.resolution)
        assert heard.origin == pytest.approx(occupancy.origin)


def test_a_message_with_too_few_cells_is_refused():
    wrong = message(read(CONFIG / "maps" / "office.yaml"))
    wrong.data = wrong.data[:-1]
    with pytest.raises(GradnavError, match="cells are not the 260 x 180"):
        Occupancy.of(wrong)


PGM = b"P5 2 1 255\n\x00\xfe"
MISTAKES = {
    "resolution: 0": (PGM, {"resolution": 0}, "resolution: 0"),
    "no resolution": (PGM, {"resolution": None}, "resolution is missing"),
    "resolution of text": (PGM, {"resolution": "fine"}, "resolution: 'fine'"),
    "huge cells": (PGM, {"resolution": 1000}, "resolution 1000 m"),
    "origin of two": (PGM, {"origin": [0, 0]}, "origin: .0, 0. is not allowed"),
    "origin nan": (PGM, {"origin": "[.nan, 0, 0]"}, "origin"),
    "no image": (PGM, {"image": None}, "image is missing"),
    "another image": (PGM, {"image": "other.pgm"}, "other.pgm: No such file"),
    "kind of image": (PGM, {"image": "plan.yaml"}, r"from \.pgm and \.png"),
    "mode": (PGM, {"mode": "grey"}, "mode: 'grey'"),
    "thresholds": (PGM, {"free_thresh": 0.7}, "free_thresh: 0.7 is not allowed; must be below"),
    "misspelt": (PGM, {"resolutoin": 1}, "did you mean resolution"),
    "truncated": (PGM[:-1], {}, "ends after 1 of 2 x 1 pixels"),
    "truncated plain": (b"P2 2 2 255 1 2 3", {}, "ends after 3 of 2 x 2 pixels"),
    "not a PGM": (b"hello", {}, "not a PGM image"),
    "colour": (b"P6 1 1 255\n\x00\x00\x00", {}, "not a PGM image"),
    "empty": (b"", {}, "not a PGM image"),
    "absurd": (b"P5 999999 999999 255\n\x00", {}, "999999 x 999999 cells are not allowed"),
    "endless": (b"P5 " + 5000 * b"9" + b" 1 255\n\x00", {}, "cells are not allowed"),
    "no pixels": (b"P5 0 0 255\n", {}, "0 x 0 cells are not allowed"),
    "maximum": (b"P5 1 1 99999\n\x00", {}, "maximum 99999"),
    "above": (b"P2 1 1 100\n101", {}, "above its maximum 100"),
    "words": (b"P2 1 1 255\nblack", {}, "a pixel is not a number"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_in_one_line(map_file, mistake):
    image, keys, words = MISTAKES[mistake]
    with pytest.raises(GradnavError, match=words) as caught:
        read(map_file(image, **keys))
    assert "\n" not in str(caught.value)
    assert "plan" in str(caught.value) or "other" in str(caught.value)


def test_a_mistake_is_named_with_its_parameter(tmp_path):
    values = {"potential": "quadratic", "map.file": str(tmp_path / "none.yaml")}
    with pytest.raises(GradnavError, match=r"^map\.file: .*none\.yaml: No such file"):
        Settings.of(values)


def complaint(path):
    """Return what is wrong with a map, empty where nothing is."""
    try:
        return "" if read(path).cells.size else "no cells"
    except GradnavError as error:
        return str(error)


@given(st.binary(max_size=60), st.sampled_from([b"", b"P5 2 2 255\n", b"P2 2 2 9\n", b"P5"]))
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_a_map_or_a_mistake(map_file, body, head):
    assert complaint(map_file(head + body)).count("\n") == 0


@given(st.text(max_size=80))
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_a_map_or_a_mistake(map_file, text):
    path = map_file(PGM, yaml="\n" + text.replace("\x00", ""))
    assert complaint(path).count("\n") == 0

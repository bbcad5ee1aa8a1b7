# SPDX-License-Identifier: Apache-2.0
"""Parameter files as careless hands, editors and disks leave them; output onto disks that fail."""

import math
import os
import random
import resource
import signal
import subprocess
import sys
from contextlib import suppress

import pytest
from conftest import CONFIG, ROOT

from tbot_gradnav import parameter_file
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.navigation import Navigation
from tbot_gradnav.odometry import Reading
from tbot_gradnav.options import Configuration

FILES = int(os.environ.get("GRADNAV_MUTATIONS", "500"))
AT_REST = Reading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
PATIENCE = 10  # [s] for one file
AWKWARD = [
    *(
        "nan",
        ".inf",
        "-.inf",
        "1e999",
        "-1e308",
        "1e-320",
        "9999999999999999999999",
        "-0",
        "0",
        "1",
    ),
    *("true", "null", "~", "[]", "{}", "[[[1]]]", "{a: 1}", '""', "'text'", "[1, [2]]", "[1, nan]"),
    *("!!binary aGk=", "!!set {a}", "&a 1", "*a", "2001-01-01", "0x10", "1_000", "1:30", "<<"),
    *("descent", "polygon", "box", "navigation_function", "[0, 0, 1, 0, 0, 1]", "[a, b]", "[a, a]"),
    *("-", ":", "|", ">", "%", "@", "`", "\t"),
]


def truncated(text, rng):
    return text[: rng.randrange(len(text))]


def replaced_value(text, rng):
    """Put something else in the place of a value."""
    lines = text.splitlines()
    i = rng.choice([i for i, line in enumerate(lines) if ": " in line and "#" not in line[:2]])
    places = [j for j in range(len(lines[i])) if lines[i].startswith(": ", j)]
    j = rng.choice(places) + 2
    end = min((k for k in (lines[i].find(c, j) for c in ",}") if k > 0), default=len(lines[i]))
    lines[i] = lines[i][:j] + rng.choice(AWKWARD) + lines[i][end:]
    return "\n".join(lines)


def huge_number(text, rng):
    digits = [i for i, c in enumerate(text) if c.isdigit()]
    i = rng.choice(digits)
    return text[:i] + "9" * rng.choice([5, 12, 30, 400, 5000]) + text[i:]


def nested(text, rng):
    depth = rng.choice([10, 100, 1000, 3000])
    return text + "\n    deep: " + rng.choice("[{") * depth


def anchored(text, rng):
    """Bombs of references, each ten times the one before."""
    bomb = ["a0: &a0 [x]"] + [
        f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)
    ]
    place = rng.choice(["top", "bottom"])
    return "\n".join([*bomb, text] if place == "top" else [text, *bomb])


def noisy(text, rng):
    data = bytearray(text.encode())
    for _ in range(rng.choice([1, 3, 30])):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def without_a_line(text, rng):
    lines = text.splitlines()
    del lines[rng.randrange(len(lines))]
    return "\n".join(lines)


def with_a_line_twice(text, rng):
    lines = text.splitlines()
    i = rng.randrange(len(lines))
    return "\n".join([*lines[:i], lines[i], *lines[i:]])


def indented(text, rng):
    lines = text.splitlines()
    i = rng.randrange(len(lines))
    lines[i] = rng.choice([" ", "\t", "  - "]) + lines[i]
    return "\n".join(lines)


def swapped(text, rng):
    """Exchange two characters, as in a misspelt word."""
    i = rng.randrange(len(text) - 1)
    return text[:i] + text[i + 1] + text[i] + text[i + 2 :]


MUTATIONS = [
    truncated, replaced_value, replaced_value, replaced_value, huge_number, nested, anchored,
    noisy, without_a_line, with_a_line_twice, indented, swapped,
]  # fmt: skip


def mutant(seed):
    """Return a shipped file spoilt in one to three ways, as bytes."""
    rng = random.Random(seed)
    path = rng.choice(sorted(CONFIG.glob("*.yaml")))
    content = path.read_text()
    for mutate in rng.sample(MUTATIONS, rng.choice([1, 1, 2, 3])):
        if isinstance(content, bytes) or len(content) < 50:
            break
        with suppress(IndexError):  # where nothing is left that it could spoil
            content = mutate(content, rng)
    return content if isinstance(content, bytes) else content.encode()


@pytest.fixture
def alarm():
    """Fail whatever takes too long."""

    def ring(*_):
        raise TimeoutError("it hangs")

    before = signal.signal(signal.SIGALRM, ring)
    yield lambda: signal.alarm(PATIENCE)
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def complaint_about(path, seed):
    """Return why a file is refused; nothing where it is not and a robot can drive by it."""
    try:
        configuration = Configuration.of(parameter_file.read(path))
        parameter_file.rewritten(path)
        twist = Navigation(configuration.settings).update(AT_REST).twist
        assert twist is None or all(map(math.isfinite, twist))
    except GradnavError as error:
        return str(error)
    except Exception as error:
        raise AssertionError(f"mutant {seed}") from error
    return ""


def test_mutated_files_are_worlds_or_refused_in_one_line(tmp_path, monkeypatch, alarm):
    monkeypatch.chdir(ROOT)  # where files that a file names are found
    path, valid, refused = tmp_path / "mutant.yaml", 0, 0
    for seed in range(FILES):
        path.write_bytes(mutant(seed))
        alarm()
        complaint = complaint_about(path, seed)
        assert len(complaint.splitlines()) <= 1, seed
        assert len(complaint) < 500, seed
        valid, refused = valid + (not complaint), refused + bool(complaint)
    assert min(valid, refused) > FILES // 20


def gradnav(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "tbot_gradnav.cli", *map(str, arguments)],
        capture_output=True, text=True, timeout=60, check=False, **options,
    )  # fmt: skip


def test_a_command_refuses_mutated_files_in_one_line_and_never_hangs(tmp_path):
    for seed in range(FILES // 60):
        path = tmp_path / f"{seed}.yaml"
        path.write_bytes(mutant(seed))
        result = gradnav("simulate", path)
        assert "Traceback" not in result.stderr, seed
        assert result.returncode in (0, 1, 2), seed
        assert len(result.stderr.splitlines()) == (result.returncode == 2), seed


# Output: whole or not at all


def disk_full_after(size):
    """Return what makes every file of a child process end at so many bytes, as a full disk does."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


def tree(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


BAG = ROOT / "test" / "data" / "descent_attractive_repulsive"
BEFORE = "what was there before"


@pytest.mark.parametrize("size", [0, 300, 5000])
@pytest.mark.parametrize(
    ("option", "arguments"),
    [
        ("--json", ["simulate", "nine_attractive_repulsive.yaml", "--random", "200"]),
        ("--plot", ["simulate", "nine_attractive_repulsive.yaml"]),
    ],
)
def test_a_full_disk_leaves_the_file_that_was_there(tmp_path, option, arguments, size):
    out = tmp_path / ("out" + {"--json": ".json", "--plot": ".png"}[option])
    out.write_text(BEFORE)
    result = gradnav(*arguments, option, out, preexec_fn=disk_full_after(size))
    assert result.returncode == 2, result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert str(out) in result.stderr
    assert out.read_text() == BEFORE
    assert tree(tmp_path) == [out.name]


def replay(out, **options):
    pytest.importorskip("rosbags", reason="needs rosbags")
    file = CONFIG / "nine_attractive_repulsive.yaml"
    return gradnav("replay", BAG, file, "--out", out, **options)


@pytest.mark.parametrize("size", [0, 1000, 10000])
def test_a_full_disk_leaves_the_bag_that_was_there(tmp_path, size):
    out = tmp_path / "bag"
    assert replay(out).returncode in (0, 1)
    before = {name: (tmp_path / name).stat().st_mtime_ns for name in tree(tmp_path)}
    result = replay(out, preexec_fn=disk_full_after(size))
    assert result.returncode == 2, result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in tree(tmp_path)} == before


def test_a_folder_that_cannot_be_is_refused_for_a_bag_too():
    result = replay("/proc/none/bag")
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert "/proc/none/bag" in result.stderr


def test_a_picture_whose_command_is_killed_is_whole_or_not_there(tmp_path):
    image = pytest.importorskip("matplotlib.image", reason="needs matplotlib")
    command = [sys.executable, "-m", "tbot_gradnav.cli", "figures", "--out", str(tmp_path)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as child:
        while child.poll() is None and not any(tmp_path.iterdir()):
            pass
        child.kill()
    for out in tmp_path.glob("*.png"):
        assert image.imread(out).size > 0

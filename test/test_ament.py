# SPDX-License-Identifier: Apache-2.0
"""The linters of ROS 2, where they are installed; and the licence of every file."""

import subprocess

import pytest
from conftest import ROOT

CODE = [str(ROOT / name) for name in ("launch", "setup.py", "tbot_gradnav", "test", "tools")]
COMMENTED = (".py", ".yaml", ".rviz", ".xml", ".toml", "Makefile")
WITHOUT_COMMENTS_OF_OURS = ("metadata.yaml", "package.xml", "pyproject.toml")


@pytest.mark.linter
def test_ament_flake8():
    flake8 = pytest.importorskip("ament_flake8.main", reason="needs ament_flake8")
    status, errors = flake8.main_with_errors(["--config", str(ROOT / "setup.cfg"), *CODE])
    assert status == 0, "\n".join(errors)


@pytest.mark.linter
def test_ament_pep257():
    """D401 takes properties for commands and D402 brackets for code; D213 excludes ament's D212."""
    pep257 = pytest.importorskip("ament_pep257.main", reason="needs ament_pep257")
    assert pep257.main(["--add-ignore", "D213", "D401", "D402", "--", *CODE]) == 0


@pytest.mark.linter
def test_ament_copyright():
    """It knows no SPDX lines, so of ours it can check the licence only."""
    main = pytest.importorskip("ament_copyright.main", reason="needs ament_copyright").main
    assert main([str(ROOT / "LICENSE")]) == 0


def test_every_file_names_its_licence():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    files = [ROOT / name for name in listed.stdout.splitlines() if name.endswith(COMMENTED)]
    files = [f for f in files if f.exists() and f.name not in WITHOUT_COMMENTS_OF_OURS]
    assert len(files) > 50
    lacking = [f for f in files if "SPDX-License-Identifier: Apache-2.0" not in head(f)]
    assert lacking == []


def head(file):
    return "".join(file.read_text(encoding="utf-8").splitlines(keepends=True)[:3])

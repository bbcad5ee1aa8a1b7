# SPDX-License-Identifier: Apache-2.0
"""The package as colcon and a reader of the README find it."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from conftest import CONFIG, ROOT


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Build the package with colcon; give the prefix it is installed in."""
    colcon = Path(sys.executable).with_name("colcon")
    if not colcon.exists():
        pytest.skip("colcon-common-extensions is not installed")
    work = tmp_path_factory.mktemp("workspace")
    ignored = shutil.ignore_patterns(".venv", ".git", "build", "install", "log", "out", ".*cache")
    shutil.copytree(ROOT, work / "src" / "tbot_gradnav", ignore=ignored)
    run = {"cwd": work, "capture_output": True, "text": True, "timeout": 100}
    listed = subprocess.run([colcon, "list"], check=True, **run).stdout
    assert "(ros.ament_python)" in listed
    subprocess.run([colcon, "build"], check=True, **run)
    return work / "install" / "tbot_gradnav"


def test_ros2_run_finds_the_executables(installed):
    for name in ("navigator", "fake_robot", "cmd_vel_watchdog", "gradnav"):
        assert os.access(installed / "lib" / "tbot_gradnav" / name, os.X_OK)


def test_the_ament_index_knows_the_package(installed):
    index = installed / "share" / "ament_index" / "resource_index" / "packages"
    assert (index / "tbot_gradnav").is_file()
    assert (installed / "share" / "tbot_gradnav" / "package.xml").is_file()


def test_every_parameter_and_launch_file_is_installed(installed):
    share = installed / "share" / "tbot_gradnav"
    for folder, pattern in (
        ("config", "*.*"),
        ("config/maps", "*"),
        ("launch", "*.launch.py"),
    ):
        assert {f.name for f in (share / folder).glob(pattern)} == {
            f.name for f in (ROOT / folder).glob(pattern)
        }
    assert list((share / "config").iterdir())


def test_the_installed_command_runs_from_anywhere(installed, tmp_path):
    command = f'. "{installed}/share/tbot_gradnav/package.sh" && gradnav simulate minimal.yaml'
    environment = os.environ | {
        "COLCON_CURRENT_PREFIX": str(installed),
        "PATH": f"{installed}/lib/tbot_gradnav:{os.environ['PATH']}",
    }
    result = subprocess.run(
        command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "1 of 1 arrived" in result.stdout


def test_the_minimal_file_is_no_longer_than_its_promise():
    assert len((CONFIG / "minimal.yaml").read_text().splitlines()) <= 10


def test_the_docs_list_the_parameters_as_the_code_has_them():
    check = [sys.executable, ROOT / "tools" / "parameter_table.py", "--check"]
    assert subprocess.run(check, check=False).returncode == 0, "run tools/parameter_table.py"


DEBIAN = {
    "numpy": "python3-numpy",
    "yaml": "python3-yaml",
    "matplotlib": "python3-matplotlib",
    "tf2_ros": "tf2_ros_py",
}
NOT_IN_ROSDEP = {"rosbags", "skfmm"}  # asked for where they are missed


def imported(path):
    """Return the names of the top-level packages that a Python file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.partition(".")[0]


def test_package_xml_names_what_is_imported_and_nothing_else():
    files = [*(ROOT / "tbot_gradnav").rglob("*.py"), *(ROOT / "launch").glob("*.py")]
    names = {name for file in files for name in imported(file)}
    foreign = names - sys.stdlib_module_names - {"tbot_gradnav"} - NOT_IN_ROSDEP
    package = ElementTree.parse(ROOT / "package.xml")  # noqa: S314 (our own file)
    listed = {element.text for element in package.iter("exec_depend")}
    executed = {"ros2bag"}  # by a launch file
    assert listed == {DEBIAN.get(name, name) for name in foreign} | executed

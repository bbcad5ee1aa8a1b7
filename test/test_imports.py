# SPDX-License-Identifier: Apache-2.0
"""The core knows nothing of ROS, plots, bags or fast marching: importing it imports none of them.

Modules that are not listed as belonging to the outside are core, so that a new one is tested too.
"""

import subprocess
import sys
from pathlib import Path

import pytest

import tbot_gradnav

PACKAGE = Path(tbot_gradnav.__file__).parent
OUTSIDE = {
    "tbot_gradnav.cmd_vel_watchdog",
    "tbot_gradnav.command_publisher",
    "tbot_gradnav.commands.demo",
    "tbot_gradnav.company",
    "tbot_gradnav.fake_robot",
    "tbot_gradnav.goals",
    "tbot_gradnav.health",
    "tbot_gradnav.journal",
    "tbot_gradnav.markers",
    "tbot_gradnav.map_topic",
    "tbot_gradnav.navigator",
    "tbot_gradnav.observer",
    "tbot_gradnav.plots",
    "tbot_gradnav.recording",
    "tbot_gradnav.ros",
    "tbot_gradnav.supervision",
    "tbot_gradnav.transforms",
    "tbot_gradnav.visuals",
}
FOREIGN = ("rclpy", "matplotlib", "rosbags", "skfmm")
PROBE = """
import importlib, sys
importlib.import_module(sys.argv[1])
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def modules():
    """Return the names of all modules of the package."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


CORE = [name for name in modules() if name not in OUTSIDE]


@pytest.mark.parametrize("name", CORE)
def test_importing_a_core_module_imports_nothing_optional(name):
    probe = [sys.executable, "-c", PROBE, name]
    run = subprocess.run(probe, capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    imported = run.stdout.split()
    assert "tbot_gradnav" in imported
    assert set(imported).isdisjoint(FOREIGN)

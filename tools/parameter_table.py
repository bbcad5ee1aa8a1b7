# SPDX-License-Identifier: Apache-2.0
"""Write the table of docs/parameters.md from the code that checks them.

usage: python tools/parameter_table.py [--check]
"""

import re
import sys
from pathlib import Path

from tbot_gradnav.options import FakeRobotOptions, NavigatorOptions, WatchdogOptions
from tbot_gradnav.parameters import Parameter, parameters_of
from tbot_gradnav.settings import settings_parameters
from tbot_gradnav.shapes import SHAPES

PAGE = Path(__file__).parents[1] / "docs" / "parameters.md"
BEGIN, END = "<!-- parameters -->", "<!-- end of parameters -->"
EXAMPLE = {"obstacles.names": ["NAME"]}
PREFIX = "obstacles.NAME."


def table() -> str:
    """Return the table in Markdown, a section for each user of the parameters."""
    sections = {
        "Law, potential and world": settings_parameters(EXAMPLE),
        **{
            f"Obstacle of shape {name} (besides, see {PREFIX}shape)": {
                PREFIX + key: entry for key, entry in parameters_of(shape).items()
            }
            for name, shape in SHAPES.items()
            if name != "circle"
        },
        "Navigator": parameters_of(NavigatorOptions),
        "cmd_vel_watchdog": parameters_of(WatchdogOptions),
        "Fake robot": parameters_of(FakeRobotOptions),
    }
    lines = [
        "| parameter | default | unit | what it is; what is allowed |",
        "| --- | --- | --- | --- |",
    ]
    for title, parameters in sections.items():
        lines.append(f"| **{title}** | | | |")
        lines += [_row(name, *entry) for name, entry in parameters.items()]
    return "\n".join(lines)


def _row(name: str, parameter: Parameter, default: object) -> str:
    allowed = parameter.allowed().removesuffix(f" [{parameter.unit}]")
    shown = str(list(default) if isinstance(default, tuple) else default)
    if isinstance(default, bool):
        shown = shown.lower()
    if name.startswith(PREFIX) and not name.endswith(("shape", "yaw")):
        shown = ""
    about = parameter.about.replace("|", "\\|")
    return f"| `{name}` | {shown} | {parameter.unit} | {about}; {allowed} |"


def main(arguments: list[str]) -> int:
    """Rewrite the page, or with --check say whether it would change."""
    before = PAGE.read_text(encoding="utf-8")
    block = f"{BEGIN}\n{table()}\n{END}"
    after = re.sub(f"{BEGIN}.*{END}", lambda _: block, before, flags=re.DOTALL)
    if "--check" in arguments:
        return int(before != after or BEGIN not in before)
    PAGE.write_text(after, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

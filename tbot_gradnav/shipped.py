# SPDX-License-Identifier: Apache-2.0
"""The parameter files that come with the package."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from tbot_gradnav import parameter_file
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.options import Configuration

NAME = "tbot_gradnav"


def parameter_path(file: str) -> Path:
    """Return the path of a parameter file: one of the user's, or a shipped one by its bare name.

    Raises GradnavError where there is neither.
    """
    path = Path(file)
    if path.exists():
        return path
    folders = reversed(list(_folders()))  # of two files of a name the nearer
    shipped = {entry.name: entry for folder in folders for entry in folder.glob("*.yaml")}
    if file in shipped:
        return shipped[file]
    raise GradnavError(
        f"{file}: no such file, nor one shipped with the package ({', '.join(sorted(shipped))})"
    )


def configuration(file: str, overrides: Mapping[str, object] | None = None) -> Configuration:
    """Return what a parameter file, one of the user's or a shipped one, says to a command.

    Some of its values can be overridden. Raises GradnavError, also where no goal is set.
    """
    path = parameter_path(file)
    found = Configuration.of(parameter_file.read(path) | dict(overrides or {}))
    if not found.settings.has_goal:
        raise GradnavError(f"{path}: goal is missing")
    if found.settings.awaits_map:
        raise GradnavError(f"{path}: map.file is missing; a map by a topic is for the navigator")
    return found


def _folders() -> Iterator[Path]:
    """Yield where config/ may be, nearest first: beside the source, or in share/ when installed."""
    for here in (Path(__file__), Path(__file__).resolve()):
        for root in here.parents:
            if (root / "package.xml").is_file():
                yield root / "config"
            yield root / "share" / NAME / "config"

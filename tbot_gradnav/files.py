# SPDX-License-Identifier: Apache-2.0
"""Files written whole or not at all."""

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tbot_gradnav.errors import GradnavError


@contextmanager
def written_whole(path: Path | str) -> Iterator[Path]:
    """Give a temporary path beside `path` that takes its place if all goes well.

    Raises GradnavError where it cannot be written.
    """
    target = Path(os.path.realpath(path))  # a link stays, what it points to is replaced
    if target.exists() and not target.is_file():
        raise GradnavError(f"{path}: it exists and is no file; it is left alone")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".gradnav-", dir=target.parent) as folder:
            temporary = Path(folder) / target.name
            yield temporary
            os.replace(temporary, target)
    except OSError as error:
        raise GradnavError(f"{target}: it cannot be written: {error.strerror}") from error


def write_json(path: Path | str, content: Mapping[str, Any]) -> None:
    """Write a JSON file, whole or not at all. Raises GradnavError.

    What is there already is replaced only if it, too, is called .json.
    """
    if Path(path).is_file() and Path(path).suffix != ".json":
        raise GradnavError(f"{path}: it exists and is not called .json; it is left alone")
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

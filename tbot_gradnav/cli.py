# SPDX-License-Identifier: Apache-2.0
"""The command gradnav."""

import argparse
import os
import re
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from typing import Any, NoReturn

from tbot_gradnav.errors import GradnavError

COMMANDS = {
    "check": "certify a world before a robot moves in it",
    "demo": "drive a fake robot to its goal: two nodes, a picture and a bag",
    "figures": "draw the figures of the paper",
    "replay": "recorded odometry through the controller, against the recorded commands",
    "simulate": "drive one robot or thousands without ROS",
    "study": "compare the laws over thousands of random starts",
}
INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"^-\.?\d")  # -1e-1 is a number, too

    def error(self, message: str) -> NoReturn:
        """Raise GradnavError."""
        raise GradnavError(f"{message} (see {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0: done; 1: done, and the answer is no; 2: the input is wrong, said in one line.
    """
    given = sys.argv[1:] if arguments is None else arguments
    try:
        options = _parsed(given)
        return int(options.run(options))
    except GradnavError as error:
        print(f"gradnav: {error}", file=sys.stderr)
        return 2
    except MemoryError:
        print("gradnav: not enough memory for so much", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("gradnav: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    parser = _Parser(
        prog="gradnav", description="Gradient-based navigation for a TurtleBot3 Burger."
    )
    parser.add_argument("--version", action="version", version=version("tbot_gradnav"))
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    chosen = _command_in(arguments)
    for name, summary in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=summary, description=summary.capitalize())
        if name == chosen:  # only then import what it needs
            module = import_module(f"tbot_gradnav.commands.{name}")
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
    return parser.parse_args(arguments)


def _command_in(arguments: Sequence[str]) -> str | None:
    return next((word for word in arguments if word in COMMANDS), None)


if __name__ == "__main__":
    sys.exit(main())

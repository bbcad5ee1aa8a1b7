# SPDX-License-Identifier: Apache-2.0
"""ROS 2 parameter files, read the same by nodes and commands.

Sections, wildcards and their order mean what they mean to rcl. On top of rcl's own reader, a list
may mix integers and floats, a key given twice is refused, and errors are one line.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.parameters import flatten

PARAMETERS = "ros__parameters"
FILES = ("map.file",)  # parameters that name a file, looked for beside the parameter file first
NOT_YAML = (  # all that PyYAML raises at text that is none, or at tags that do not fit
    yaml.YAMLError,
    ValueError,
    RecursionError,
    LookupError,
    TypeError,
    AttributeError,
)


def read(path: Path | str, node: str = "/navigator") -> dict[str, object]:
    """Return the parameters that a file holds for a node, under dotted names.

    Raises GradnavError where the file cannot be read or has nothing for the node.
    """
    values: dict[str, object] = {}
    sections = _sections(load(path), path)
    matching = [body for name, body in sections if _matches(name, node)]
    if not matching:
        names = ", ".join(name for name, _ in sections) or "none"
        raise GradnavError(f"{path}: it has no section for {node} (sections: {names})")
    for body in matching:
        values.update(flatten(body))
    return {name: value for name, value in values.items() if value not in (None, [])}


def load(path: Path | str) -> dict[str, Any]:
    """Return the tree of a parameter file. Raises GradnavError."""
    tree = load_yaml(path)
    if not isinstance(tree, dict):
        raise GradnavError(f"{path}: it is not a ROS 2 parameter file: no '/**:' at its top")
    for _, body in _sections(tree, path):
        _anchor(body, Path(path).parent)
    return tree


def load_yaml(path: Path | str) -> Any:
    """Return what a YAML file holds. Raises GradnavError."""
    try:
        return yaml.load(Path(path).read_text(encoding="utf-8"), Loader=_Loader)  # noqa: S506 (a SafeLoader)
    except OSError as error:
        raise GradnavError(f"{path}: {error.strerror}") from error
    except NOT_YAML as error:
        raise GradnavError(f"{path}: it is not a YAML file: {_one_line(error)}") from error


def _anchor(tree: Any, folder: Path, prefix: str = "") -> None:
    """Make the names of files in a section whole, where they are beside the parameter file."""
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            _anchor(value, folder, f"{name}.")
        elif name in FILES and isinstance(value, str) and value and (folder / value).is_file():
            tree[key] = str((folder / value).absolute())


def rewritten(path: Path | str) -> str:
    """Return a parameter file's text in the dialect of rcl. Raises GradnavError."""
    tree = load(path)
    for name, body in _sections(tree, path):
        for key, value in flatten(body):
            if value is not None:
                _refuse_untyped(f"{path}: {name}: {key}", value)
    return _dumped(tree)


def _refuse_untyped(where: str, value: object) -> None:
    """Raise GradnavError for a value that has no type in ROS."""
    items = value if isinstance(value, list) else [value]
    kinds = {float if type(item) is int else type(item) for item in items}
    if len(kinds) > 1 or not kinds <= {bool, float, str}:
        raise GradnavError(
            f"{where}: {' '.join(str(value).split())[:60]} is not allowed; must be a number, text, "
            "true or false, or a list of one of these"
        )


def rewritten_rule(rule: str) -> str:
    """Return a rule NAME:=VALUE of the command line in the dialect of rcl."""
    name, assign, text = rule.partition(":=")
    try:
        value = yaml.load(text, Loader=_Loader)  # noqa: S506 (a SafeLoader)
    except NOT_YAML:
        return rule  # rcl has its own words for it
    return f"{name}{assign}{_dumped(value).strip()}" if isinstance(value, list) else rule


def _sections(tree: Mapping[str, Any], path: Path | str) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the node name patterns of a file with their parameters, in order."""
    found: list[tuple[str, Mapping[str, Any]]] = []
    for key, body in tree.items():
        if not isinstance(body, Mapping):
            raise GradnavError(f"{path}: {key}: expected a node name with '{PARAMETERS}:' below it")
        if PARAMETERS in body:
            parameters = body[PARAMETERS] or {}
            if not isinstance(parameters, Mapping):
                raise GradnavError(f"{path}: {key}: '{PARAMETERS}:' must hold names and values")
            found.append(("/" + str(key).strip("/"), parameters))
        else:
            found += [
                ("/" + str(key).strip("/") + name, parameters)
                for name, parameters in _sections(body, path)
            ]
    return found


def _matches(pattern: str, node: str) -> bool:
    """Return whether a pattern with * (one token) and ** (any number) is the node's name."""
    tokens = {"/**": "(/[^/]+)*", "/*": "/[^/]+"}
    parts = re.findall(r"/[^/]*", pattern)
    return (
        re.fullmatch("".join(tokens.get(part, re.escape(part)) for part in parts), node) is not None
    )


def _dumped(value: Any) -> str:
    return yaml.dump(
        _for_rcl(value), Dumper=_Dumper, default_flow_style=True, sort_keys=False, width=10**9
    )


def _for_rcl(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _for_rcl(item) for k, item in value.items() if item not in (None, [])}
    if isinstance(value, list):
        numbers = all(type(item) in (int, float) for item in value)
        if numbers and any(isinstance(item, float) for item in value):
            return [float(item) for item in value]
    return value


def _one_line(error: Exception) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"{error.problem} (line {mark.line + 1}, column {mark.column + 1})"
    return " ".join(str(error).split()) or type(error).__name__


class _Loader(yaml.SafeLoader):
    """YAML as rcl reads it: 1e-3 is a number; anchors and repeated keys are refused."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            raise yaml.MarkedYAMLError(
                problem="anchors and aliases are not supported", problem_mark=event.start_mark
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            if key_node.value in seen if isinstance(key_node.value, str) else False:
                raise yaml.MarkedYAMLError(
                    problem=f"{key_node.value} is given twice", problem_mark=key_node.start_mark
                )
            seen.add(str(key_node.value))
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


class _Dumper(yaml.SafeDumper):
    """YAML that rcl reads as it is meant: text quoted, numbers plain."""


_Dumper.add_representer(
    str, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"')
)

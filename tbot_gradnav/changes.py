# SPDX-License-Identifier: Apache-2.0
"""Parameters that change at run time, and obstacles among them.

An obstacle is there while it is in obstacles.names. What belongs to one that is not (yet, or any
more) is kept but has no effect: so an obstacle is added by its numbers first and its name last, in
as many requests as one likes or in one, and removed by taking its name away.
"""

from collections.abc import Iterable, Mapping

from tbot_gradnav.errors import ParameterError
from tbot_gradnav.parameters import Parameter, did_you_mean, parameters_of
from tbot_gradnav.settings import OBSTACLES, SHAPE
from tbot_gradnav.shapes import SHAPES

ENTRIES: Mapping[str, Parameter] = {
    key: parameter
    for shape in SHAPES.values()
    for key, (parameter, _) in parameters_of(shape).items()
} | {"shape": SHAPE}


def merged(present: Mapping[str, object], changes: Mapping[str, object]) -> dict[str, object]:
    """Return the parameters that hold after some have changed; None unsets one.

    Left out is what belongs to an obstacle that is not there, or what a present one's shape has
    no use for, unless it is that which changes. Raises ParameterError.
    """
    together = {k: v for k, v in (dict(present) | dict(changes)).items() if v is not None}
    for name in waiting(changes, together):
        if name in together:
            entry(name, together[name]).check(name, together[name])
    apart = set(waiting(together, together)) | {
        name for name in together if name not in changes and _useless(name, together)
    }
    return {name: value for name, value in together.items() if name not in apart}


def waiting(names: Iterable[str], values: Mapping[str, object]) -> list[str]:
    """Return those names that belong to an obstacle which is not in obstacles.names."""
    listed = values.get("obstacles.names", [])
    there = listed if isinstance(listed, list) else []
    return [name for name in entries(names) if name.split(".")[1] not in there]


def entries(names: Iterable[str]) -> list[str]:
    """Return those names that belong to an obstacle, in it or not in obstacles.names."""
    return [name for name in names if _is_entry(name)]


def entry(name: str, value: object) -> Parameter:
    """Return what is known of a parameter obstacles.NAME.KEY. Raises ParameterError."""
    key = name.split(".", 2)[2]
    if key not in ENTRIES:
        raise ParameterError(
            name, value, "no obstacle has such a parameter" + did_you_mean(key, ENTRIES)
        )
    return ENTRIES[key]


def _is_entry(name: str) -> bool:
    return name.startswith(OBSTACLES) and name.count(".") >= 2


def _useless(name: str, values: Mapping[str, object]) -> bool:
    """Return whether a parameter belongs to another shape than its obstacle has."""
    if not _is_entry(name):
        return False
    obstacle, key = name.split(".", 2)[1:]
    shape = SHAPES.get(str(values.get(f"{OBSTACLES}{obstacle}.shape", "circle")))
    return (
        key in ENTRIES and key != "shape" and shape is not None and key not in parameters_of(shape)
    )

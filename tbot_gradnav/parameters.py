# SPDX-License-Identifier: Apache-2.0
"""Parameters as fields of frozen dataclasses that check themselves.

A field made with `field` carries its default, unit, range and description. From that one place
come the checks, the error messages, the ROS parameter descriptors and the table in
docs/parameters.md.
"""

import dataclasses
import difflib
import math
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

from tbot_gradnav.errors import ParameterError

LARGEST = 1e9  # of finite numbers; squares and products of such stay finite
LARGEST_INTEGER = 2**63 - 1  # of ROS
KEY = "parameter"  # of a dataclass field's metadata


class Parameter(Protocol):
    """What is known of a parameter besides its name and default."""

    @property
    def about(self) -> str:
        """One line for people."""
        ...

    @property
    def unit(self) -> str:
        """Unit, empty where there is none."""
        ...

    def allowed(self) -> str:
        """Return what may be given, as the end of a sentence."""
        ...

    def check(self, name: str, value: object) -> object:
        """Return the value in its proper type, or raise ParameterError."""
        ...


@dataclass(frozen=True)
class Number:
    """A finite float; integers are welcome."""

    about: str
    unit: str = ""
    above: float = -math.inf
    at_least: float = -math.inf
    at_most: float = math.inf
    infinite: bool = False

    @property
    def closed(self) -> tuple[float, float] | None:
        """The range, if it is closed and finite."""
        closed = math.isfinite(self.at_least) and math.isfinite(self.at_most)
        return (self.at_least, self.at_most) if closed else None

    def allowed(self) -> str:
        """Return the range in words."""
        bounds = [
            f"above {self.above:g}" if self.above > -math.inf else "",
            f"at least {self.at_least:g}" if self.at_least > -math.inf else "",
            f"at most {self.at_most:g}" if self.at_most < math.inf else "",
        ]
        words = " and ".join(bound for bound in bounds if bound)
        kind = "a number" if self.infinite else "a finite number"
        return f"must be {kind} {words}".rstrip() + (f" [{self.unit}]" if self.unit else "")

    def check(self, name: str, value: object) -> float:
        """Return the value as a float."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ParameterError(name, value, self.allowed())
        if isinstance(value, int) and abs(value) > 1e300:  # float(value) would overflow
            raise ParameterError(name, value, self.allowed())
        number = float(value)
        if math.isfinite(number) and abs(number) > LARGEST:
            raise ParameterError(name, value, f"must be at most {LARGEST:g} in size")
        inside = number > self.above and self.at_least <= number <= self.at_most
        if math.isnan(number) or not (inside and (self.infinite or math.isfinite(number))):
            raise ParameterError(name, value, self.allowed())
        return number


# Whoever gives 90 means degrees; figures of the paper show two turns.
YAW = Number("by which it is turned", "rad", at_least=-12.57, at_most=12.57)


@dataclass(frozen=True)
class Integer:
    """An integer."""

    about: str
    unit: str = ""
    at_least: int = 0

    @property
    def closed(self) -> tuple[int, int]:
        """The range."""
        return self.at_least, LARGEST_INTEGER

    def allowed(self) -> str:
        """Return the range in words."""
        return f"must be an integer at least {self.at_least}"

    def check(self, name: str, value: object) -> int:
        """Return the value."""
        if isinstance(value, bool) or not isinstance(value, int) or value < self.at_least:
            raise ParameterError(name, value, self.allowed())
        if value > LARGEST_INTEGER:
            raise ParameterError(name, value, "must fit in 64 bits")
        return value


@dataclass(frozen=True)
class Flag:
    """True or false."""

    about: str
    unit: str = ""

    def allowed(self) -> str:
        """Return what may be given."""
        return "must be true or false"

    def check(self, name: str, value: object) -> bool:
        """Return the value."""
        if not isinstance(value, bool):
            raise ParameterError(name, value, self.allowed())
        return value


@dataclass(frozen=True)
class Choice:
    """One of some words."""

    about: str
    options: tuple[str, ...]
    unit: str = ""

    def allowed(self) -> str:
        """Return the words."""
        return "must be one of " + ", ".join(self.options)

    def check(self, name: str, value: object) -> str:
        """Return the word."""
        if not isinstance(value, str) or value not in self.options:
            raise ParameterError(name, value, self.allowed() + did_you_mean(value, self.options))
        return value


@dataclass(frozen=True)
class Text:
    """Any word."""

    about: str
    unit: str = ""

    def allowed(self) -> str:
        """Return what may be given."""
        return "must be text"

    def check(self, name: str, value: object) -> str:
        """Return the text."""
        if not isinstance(value, str):
            raise ParameterError(name, value, self.allowed())
        return value


@dataclass(frozen=True)
class Numbers:
    """A list of finite numbers of one of some lengths; none given: any multiple of `rows`."""

    about: str
    unit: str
    lengths: tuple[int, ...] = ()
    rows: int = 1
    at_most: int | None = None  # rows
    poses: bool = False  # whether every third is a yaw [rad]

    def allowed(self) -> str:
        """Return the lengths in words."""
        lengths = " or ".join(str(length) for length in self.lengths) or f"n times {self.rows}"
        bound = "" if self.at_most is None else f", n at most {self.at_most}"
        yaw = f", any yaw at most {YAW.at_most:g} in size" if self.poses else ""
        return f"must be a list of {lengths} finite numbers{bound}{yaw} [{self.unit}]"

    def check(self, name: str, value: object) -> tuple[float, ...]:
        """Return the numbers as a tuple of floats."""
        if not isinstance(value, (list, tuple)) or not self._fits(len(value)):
            raise ParameterError(name, value, self.allowed())
        element = Number(self.about, self.unit)
        try:
            numbers = tuple(element.check(name, item) for item in value)
            for yaw in numbers[2::3] if self.poses else ():
                YAW.check(name, yaw)
        except ParameterError as error:
            raise ParameterError(name, list(value), self.allowed()) from error
        return numbers

    def _fits(self, length: int) -> bool:
        if self.lengths:
            return length in self.lengths
        few = self.at_most is None or length <= self.at_most * self.rows
        return few and length % self.rows == 0


@dataclass(frozen=True)
class Names:
    """A list of different names."""

    about: str
    unit: str = ""

    def allowed(self) -> str:
        """Return what may be given."""
        return "must be a list of different names without dots"

    def check(self, name: str, value: object) -> tuple[str, ...]:
        """Return the names as a tuple."""
        if not isinstance(value, (list, tuple)) or not all(isinstance(n, str) for n in value):
            raise ParameterError(name, value, self.allowed())
        names = tuple(value)
        if len(set(names)) < len(names) or any("." in item or not item for item in names):
            raise ParameterError(name, list(value), self.allowed())
        return names


def field(default: Any, parameter: Parameter) -> Any:
    """Return a dataclass field that is `parameter`, for use in a subclass of Checked."""
    return dataclasses.field(default=default, metadata={KEY: parameter})


class Checked:
    """A frozen dataclass whose fields made with `field` check themselves.

    Raises ParameterError.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]  # of the subclass, which is a dataclass

    def __post_init__(self) -> None:
        """Check every parameter and bring it into its type."""
        for f in dataclasses.fields(self):
            if KEY in f.metadata:
                value = f.metadata[KEY].check(f.name, getattr(self, f.name))
                object.__setattr__(self, f.name, value)


def parameters_of(cls: type) -> dict[str, tuple[Parameter, Any]]:
    """Return the parameters of a dataclass with their defaults, by name, nested ones dotted."""
    found: dict[str, tuple[Parameter, Any]] = {}
    for f in dataclasses.fields(cls):
        if KEY in f.metadata:
            found[f.name] = (f.metadata[KEY], f.default)
        elif isinstance(f.default_factory, type) and issubclass(f.default_factory, Checked):
            nested = parameters_of(f.default_factory)
            found.update({f"{f.name}.{name}": entry for name, entry in nested.items()})
    return found


T = TypeVar("T", bound=Checked)


def build(cls: type[T], values: MutableMapping[str, object], prefix: str = "", **more: Any) -> T:
    """Return a `cls` made of those `values` whose names begin with `prefix`, taking them out.

    `more` are arguments for fields that are not parameters. Raises ParameterError.
    """
    arguments: dict[str, Any] = dict(more)
    for f in dataclasses.fields(cls):
        name = prefix + f.name
        if KEY in f.metadata:
            if name in values:
                arguments[f.name] = values.pop(name)
        elif isinstance(f.default_factory, type) and issubclass(f.default_factory, Checked):
            arguments[f.name] = build(f.default_factory, values, name + ".")
    try:
        return cls(**arguments)
    except ParameterError as error:
        raise error.within(prefix) from error


def refuse_unknown(values: Mapping[str, object], known: Iterable[str]) -> None:
    """Raise ParameterError for the first name of `values` that is not `known`."""
    known = set(known)
    for name, value in values.items():
        if name not in known:
            raise ParameterError(
                name, value, "no parameter has this name" + did_you_mean(name, known)
            )


def flatten(tree: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the leaves of nested mappings under dotted names, as ROS parameters are named."""
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def did_you_mean(word: object, options: Iterable[str]) -> str:
    """Return a hint at the nearest of `options`, empty where none is near."""
    if not isinstance(word, str):
        return ""
    near = difflib.get_close_matches(word, list(options), n=1)
    return f" (did you mean {near[0]}?)" if near else ""

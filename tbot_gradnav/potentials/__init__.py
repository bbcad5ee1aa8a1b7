# SPDX-License-Identifier: Apache-2.0
"""Potentials by name: the package's own and those that other packages install."""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.parameters import Parameter, parameters_of
from tbot_gradnav.potentials.attractive_repulsive import AttractiveRepulsive
from tbot_gradnav.potentials.field import Field, Points, Potential
from tbot_gradnav.potentials.map import Map
from tbot_gradnav.potentials.map_scan import MapScan
from tbot_gradnav.potentials.navigation_function import NavigationFunction
from tbot_gradnav.potentials.quadratic import Quadratic
from tbot_gradnav.potentials.scan import Scan

__all__ = [
    "GROUP",
    "AttractiveRepulsive",
    "Field",
    "Map",
    "MapScan",
    "NavigationFunction",
    "Points",
    "Potential",
    "Quadratic",
    "Scan",
    "gains_of",
    "potentials",
]

GROUP = "tbot_gradnav.potentials"  # entry points of potentials installed by others


@cache
def potentials() -> Mapping[str, type[Potential]]:
    """Return the class of every potential by its name in a parameter file.

    Raises GradnavError where an installed one is not a subclass of Potential.
    """
    own: dict[str, type[Potential]] = {
        "quadratic": Quadratic,
        "navigation_function": NavigationFunction,
        "attractive_repulsive": AttractiveRepulsive,
        "scan": Scan,
        "map_scan": MapScan,
        "map": Map,
    }
    return own | {entry.name: _load(entry) for entry in entry_points(group=GROUP)}


def gains_of(name: str) -> dict[str, tuple[Parameter, Any]]:
    """Return the parameters of a potential with their defaults, by name."""
    potential = potentials()[name]
    return {} if potential.borrows else parameters_of(potential)


def _load(entry: EntryPoint) -> type[Potential]:
    where = f"potential {entry.name} ({entry.value})"
    try:
        potential = entry.load()
    except Exception as error:  # whatever another package's import may raise
        raise GradnavError(f"{where} cannot be imported: {error}") from error
    if not (isinstance(potential, type) and issubclass(potential, Potential)):
        raise GradnavError(f"{where} is not a subclass of tbot_gradnav.potentials.Potential")
    return potential

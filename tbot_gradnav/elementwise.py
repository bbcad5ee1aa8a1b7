# SPDX-License-Identifier: Apache-2.0
"""Maximum, minimum, magnitude and choice of floats or arrays.

For arrays they are numpy's, which need a microsecond for a single float: as long as all the rest
of a command. With these, and with `** 0.5`, one robot is as cheap as it should be and has the same
formulas as thousands. A nan stays a nan, as numpy has it.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = float | NDArray[np.float64]
Bools: TypeAlias = bool | np.bool_ | NDArray[np.bool_]


def larger(a: Floats, b: Floats) -> Floats:
    """Return the larger of a and b."""
    if isinstance(a, float) and isinstance(b, float):
        return a if a >= b or a != a else b
    return np.maximum(a, b)


def smaller(a: Floats, b: Floats) -> Floats:
    """Return the smaller of a and b."""
    if isinstance(a, float) and isinstance(b, float):
        return a if a <= b or a != a else b
    return np.minimum(a, b)


def magnitude(a: Floats) -> Floats:
    """Return |a|."""
    return abs(a) if isinstance(a, float) else np.abs(a)


def choose(condition: Bools, a: Floats, b: Floats) -> Floats:
    """Return a where the condition holds, b elsewhere."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    return a if condition else b

# SPDX-License-Identifier: Apache-2.0
"""Random messages by the million through the decoder and the controller."""

import math
import os

import numpy as np
import pytest
from arenas import ATTRACTIVE_REPULSIVE, NAVIGATION_FUNCTION, NINE, assert_sound

from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.odometry import BadOdometryError, Reading
from tbot_gradnav.settings import Settings

MESSAGES = int(os.environ.get("GRADNAV_MESSAGES", "100000"))

WORLDS = {
    "circles, navigation function": {**NINE, **NAVIGATION_FUNCTION},
    "circles, U, with an orientation": {**NINE, **ATTRACTIVE_REPULSIVE, "goal": [0.0, 0.0, 1.0]},
    "open, as printed": {"goal": [0.0, 0.0], "speed_shaping": "none", "potential": "quadratic"},
    "eq. 22": {**NINE, **NAVIGATION_FUNCTION, "law": "radial", "k_omega": 1.0},
}
AWKWARD = np.array(
    [
        *(0.0, -0.0, 1.0, -1.0, 1e-9, 5e-324, 1e-300, 1e6, -1e6, 1e9, 1e308, -1e308),
        *(math.nan, math.inf, -math.inf),
    ]
)


def garbage(n, seed):
    """Return n messages: a robot's track, with awkward numbers at random in part of them."""
    rng = np.random.default_rng(seed)
    values = rng.normal(scale=3.0, size=(n, 7))
    values[:, 0] = np.cumsum(rng.choice([0.05, 0.0, -0.05, 1e4, -1e4], size=n))
    values[: n // 2, 1:3] = 0.3 * rng.normal(size=2) + np.cumsum(
        rng.normal(scale=0.005, size=(n // 2, 2)), axis=0
    )
    awkward = rng.random((n, 7)) < rng.choice([0.0, 0.05, 0.4], size=(n, 1))
    values[awkward] = rng.choice(AWKWARD, size=np.count_nonzero(awkward))
    return [Reading(*row) for row in values.tolist()]


@pytest.mark.parametrize("world", WORLDS.values(), ids=WORLDS.keys())
def test_every_message_is_answered_by_a_sound_command_or_called_bad(world):
    track, answered, bad = Navigation(Settings.of({**world, "initial_pose": [0.0, 3.5, 1.0]})), 0, 0
    for seed in range(10):
        for message in garbage(MESSAGES // len(WORLDS) // 10, seed):
            try:
                v, omega = track.update(message).twist
            except BadOdometryError:
                bad += 1
                continue
            answered += 1
            assert_sound(v, omega)
            if track.state is not State.DRIVING:
                track.restart()
    assert min(answered, bad) > MESSAGES // len(WORLDS) // 10

# SPDX-License-Identifier: Apache-2.0
"""Fields made in a process of its own: in which order, and what if it fails."""

import threading

import numpy as np
import pytest

pytest.importorskip("skfmm", reason="needs scikit-fmm: pip install tbot_gradnav[map]")

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.fast_marching import Task, march
from tbot_gradnav.marching_process import Marching

PATIENCE = 20.0


def task(size=20):
    ones = np.ones((size, size))
    return Task(ones, ones > 0.0, (10.0, 10.0), 0.1, 0.2, 0.5, 1.0)


def test_the_newest_is_made_first_and_what_nobody_waits_for_never():
    asked, begun, go_on = [], threading.Event(), threading.Event()

    def ask(name):
        asked.append(name)
        if name == "busy":
            begun.set()
            assert go_on.wait(PATIENCE)
        return task()

    marchings = {name: Marching(lambda n=name: ask(n)) for name in ("busy", "old", "dropped")}
    marchings["new"] = Marching(lambda: ask("new"))
    marchings["busy"].begin()
    assert begun.wait(PATIENCE)
    for name in ("old", "dropped", "new"):
        marchings[name].begin()
    del marchings["dropped"]
    assert not marchings["new"].ready
    go_on.set()
    for marching in marchings.values():
        np.testing.assert_array_equal(marching.phi, march(task()))
    assert asked == ["busy", "new", "old"]


def test_a_process_that_fails_is_tried_again_then_said_to_fail_and_hinders_no_other():
    impossible = Marching(lambda: task()._replace(free=None))
    impossible.begin()
    with pytest.raises(GradnavError, match="no field"):
        _ = impossible.phi
    assert impossible.ready
    assert impossible.failed
    possible = Marching(task)
    possible.begin()
    np.testing.assert_array_equal(possible.phi, march(task()))
    assert not possible.failed

# SPDX-License-Identifier: Apache-2.0
"""Fast marching in a process of its own: scikit-fmm lets no other thread run meanwhile.

The process ends when its standard input does, so with whoever started it, however that ends.
"""

import contextlib
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from functools import cached_property
from queue import LifoQueue
from typing import BinaryIO
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from tbot_gradnav.errors import GradnavError
from tbot_gradnav.fast_marching import Task, march

Array = NDArray[np.float64]


class Marching:
    """The field of a task: found when first asked for, or in the background once begun."""

    def __init__(self, ask: Callable[[], Task]) -> None:
        self._ask = ask
        self._begun: Future[Array] | None = None

    def begin(self) -> None:
        """Begin in the background."""
        if self._begun is None and "phi" not in self.__dict__:
            self._begun = _worker.ask(self)

    @property
    def ready(self) -> bool:
        """Whether nothing goes on in the background."""
        return self._begun is None or self._begun.done()

    @property
    def failed(self) -> bool:
        """Whether what went on in the background came to nothing."""
        return (
            self._begun is not None and self._begun.done() and self._begun.exception() is not None
        )

    @cached_property
    def task(self) -> Task:
        """What is asked for."""
        return self._ask()

    @cached_property
    def phi(self) -> Array:
        """The field, of shape (rows, columns); see fast_marching.march. Raises GradnavError."""
        return march(self.task) if self._begun is None else self._begun.result()


class _Worker:
    """The process and the thread that asks it: the newest task first, none that is not waited for.

    The process is started at the first task, and once more should it end over one. A field is
    never made in our own process instead: it would stop for as long as that takes.
    """

    def __init__(self) -> None:
        self._tasks: LifoQueue[tuple[ref[Marching], Future[Array]]] = LifoQueue()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._process: subprocess.Popen[bytes] | None = None

    def ask(self, marching: Marching) -> "Future[Array]":
        """Return the field to come."""
        future: Future[Array] = Future()
        self._tasks.put((ref(marching), future))
        if self._thread.ident is None:
            self._thread.start()
        return future

    def _work(self) -> None:
        while True:
            waiting, future = self._tasks.get()
            if (marching := waiting()) is None:
                continue
            try:
                future.set_result(self._marched(marching.task))
            except Exception as error:
                future.set_exception(error)
            del marching  # while we wait for another

    def _marched(self, task: Task) -> Array:
        """Return the field. Raises GradnavError."""
        for _ in range(2):
            with contextlib.suppress(OSError, EOFError, pickle.PickleError):
                return self._asked(task)
        raise GradnavError("no field: the process that makes it ends at once; not enough memory?")

    def _asked(self, task: Task) -> Array:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __spec__.name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,  # away from the terminal's signals
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(task, self._process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self._process.stdin.flush()
            phi: Array = pickle.load(self._process.stdout)  # noqa: S301 (our own process)
        except BaseException:
            self._process.kill()  # what is left in its pipes answers no later question
            self._process = None
            raise
        return phi


_worker = _Worker()


def serve(questions: BinaryIO, answers: BinaryIO) -> None:
    """Answer each Task by its field until there are no more, or whoever asks has ended."""
    with contextlib.suppress(EOFError, pickle.UnpicklingError, BrokenPipeError):
        while True:
            task: Task = pickle.load(questions)  # noqa: S301 (of the process that started us)
            pickle.dump(march(task), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


if __name__ == "__main__":
    serve(sys.stdin.buffer, sys.stdout.buffer)

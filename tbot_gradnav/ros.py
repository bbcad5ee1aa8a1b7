# SPDX-License-Identifier: Apache-2.0
"""What the nodes of this package share: starting, stopping and parameters."""

import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import rclpy
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tbot_gradnav import parameter_file
from tbot_gradnav.changes import entry
from tbot_gradnav.errors import GradnavError
from tbot_gradnav.options import Configuration, known_parameters
from tbot_gradnav.parameters import Integer, Number, Parameter

# All that a terminal or a supervisor sends; suspended by Ctrl-Z, a node leaves the robot driving.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
POLL = 0.1  # [s] at most between a signal and its effect
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # late joiners hear it


N = TypeVar("N", bound=Node)


def run(make: Callable[[], N], close: Callable[[N], None], arguments: Sequence[str]) -> int:
    """Run a node until one of SIGNALS; `close` it and return the exit status.

    Signals only set a flag: nothing interrupts the zero velocity on its way out, however many
    come. rclpy's own handlers would invalidate the publisher first.
    """
    stop = threading.Event()
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN or number == signal.SIGINT:
            signal.signal(number, lambda *_: stop.set())
    try:
        _init(arguments)
        node = make()
    except GradnavError as error:
        rclpy.try_shutdown()
        print(f"{Path(arguments[0]).stem}: {error}", file=sys.stderr)
        return 2
    try:
        executor = EventsExecutor()  # half the processor time of SingleThreadedExecutor
        executor.add_node(node)
        while not stop.is_set():
            executor.spin_once(timeout_sec=POLL)
    finally:
        close(node)
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def declare(
    node: Node, names: Collection[str] | None = None, fixed: Collection[str] | None = None
) -> Configuration:
    """Declare the parameters in `names` (None: all) and return what the file configures.

    Those in `fixed` (None: all) cannot be changed later. Raises ParameterError about anything in
    the node's overrides that is not allowed.
    """
    given = values(node)
    configuration = Configuration.of(given)
    for name, (parameter, default) in known_parameters(given).items():
        if node.has_parameter(name):
            node.undeclare_parameter(name)
        if names is None or name in names:
            value = _for_ros(parameter.check(name, given.get(name, default)))
            about = descriptor(parameter, read_only=fixed is None or name in fixed)
            node.declare_parameter(name, value, about, ignore_override=True)
    return configuration


def values(node: Node) -> dict[str, object]:
    """Return the parameters of a node that have a value, by name."""
    found = {name: p.value for name, p in node.get_parameters_by_prefix("").items()}
    return {name: plain(value) for name, value in found.items() if value is not None}


def descriptor(parameter: Parameter, read_only: bool) -> ParameterDescriptor:
    """Return what `ros2 param describe` shows."""
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    return ParameterDescriptor(
        description=parameter.about + unit,
        additional_constraints=parameter.allowed(),
        read_only=read_only,
        dynamic_typing=True,  # an integer is welcome where a number is meant
        **_ranges(parameter),
    )


def _ranges(parameter: Parameter) -> dict[str, list[Any]]:
    """Return the closed range of a parameter as a descriptor holds it; empty where there is none.

    Others are in additional_constraints: ROS has no half-open ranges.
    """
    if isinstance(parameter, Number) and parameter.closed:
        low, high = parameter.closed
        return {"floating_point_range": [FloatingPointRange(from_value=low, to_value=high)]}
    if isinstance(parameter, Integer):
        least, most = parameter.closed
        return {"integer_range": [IntegerRange(from_value=least, to_value=most)]}
    return {}


def describe(node: Node, names: Iterable[str]) -> None:
    """Describe parameters of obstacles that came at run time as those of the start are."""
    for name in names:
        about = descriptor(entry(name, None), read_only=False)
        present = node.describe_parameter(name)  # set_descriptor would call us back
        present.description = about.description
        present.additional_constraints = about.additional_constraints


def plain(value: Any) -> object:
    """Return a parameter's value with its arrays as lists."""
    return value.tolist() if hasattr(value, "tolist") else value


def _for_ros(value: object) -> object:
    """Return a parameter's value as rclpy takes it; an empty list has no type and is unset."""
    return (list(value) or None) if isinstance(value, tuple) else value


def _init(arguments: Sequence[str]) -> None:
    """Initialise rclpy with the command line. Raises GradnavError."""
    try:
        with _readable_by_rcl(arguments) as readable:
            for word in remove_ros_args(readable)[1:]:
                raise GradnavError(
                    f"{word}: unexpected; parameters are given with --ros-args --params-file FILE"
                )
            rclpy.init(args=readable, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # of rcl, about the words behind --ros-args
        raise GradnavError(f"--ros-args: {error}") from error


@contextmanager
def _readable_by_rcl(arguments: Sequence[str]) -> Iterator[list[str]]:
    """Replace --params-file and -p by the same in rcl's dialect (see parameter_file)."""
    readable = list(arguments)
    with tempfile.TemporaryDirectory(prefix="gradnav-") as folder:
        for i, (option, word) in enumerate(pairwise(arguments), start=1):
            if option == "--params-file":
                readable[i] = f"{folder}/{i}.yaml"
                Path(readable[i]).write_text(parameter_file.rewritten(word), encoding="utf-8")
            elif option in ("-p", "--param"):
                readable[i] = parameter_file.rewritten_rule(word)
        yield readable

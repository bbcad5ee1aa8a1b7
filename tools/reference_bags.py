# SPDX-License-Identifier: Apache-2.0
"""The reference bags in test/data: a drive for each law and potential, by the fake robot's plant.

usage: python tools/reference_bags.py            show what the code does otherwise than recorded
       python tools/reference_bags.py --accept   record them anew, after having looked
"""

import sys
import tempfile
from pathlib import Path

import yaml

from tbot_gradnav import bags, parameter_file
from tbot_gradnav.navigation import Navigation, State
from tbot_gradnav.options import Configuration
from tbot_gradnav.plant import Plant
from tbot_gradnav.recording import recording
from tbot_gradnav.replay import Comparison, Replay

DATA = Path(__file__).parents[1] / "test" / "data"
LAWS = {"position": (0.5, 1.5), "radial": (-0.5, -1.0), "heading": (0.5, 1.5), "descent": (0.5, 3)}
POTENTIALS = ("quadratic", "navigation_function", "attractive_repulsive")
TOLERANCE = 1e-9  # [m/s], [rad/s]: the same arithmetic on another machine
PERIOD = 0.1  # [s] between odometry messages
LIMIT = 30.0  # [s] of a drive
WORLD = {
    "goal": [0.2, -0.1],
    "initial_pose": [-1.8, 0.5, 1.2],
    "boundary": {"x": 0.0, "y": 0.0, "radius": 2.5},
    "obstacles": {
        "names": ["a", "b", "c"],
        "a": {"x": -0.8, "y": 0.3, "radius": 0.2},
        "b": {"x": 0.3, "y": 0.9, "radius": 0.25},
        "c": {"x": 0.1, "y": -1.1, "radius": 0.2},
    },
    "driver_quirks": True,
    "command_latency": 0.04,
    "position_noise": 0.002,
    "heading_noise": 0.005,
    "seed": 1,
}


def scenarios() -> dict[str, str]:
    """Return the parameter file of each bag, by the bag's name."""
    found = {}
    for law, (k_v, k_omega) in LAWS.items():
        for potential in POTENTIALS:
            parameters = {"law": law, "k_v": k_v, "k_omega": k_omega, "potential": potential}
            tree = {"/**": {"ros__parameters": parameters | WORLD}}
            found[f"{law}_{potential}"] = yaml.safe_dump(tree, sort_keys=False)
    return found


def configured(text: str) -> Configuration:
    """Return what a parameter file's text configures."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "parameters.yaml"
        path.write_text(text, encoding="utf-8")
        return Configuration.of(parameter_file.read(path))


def record(path: Path, text: str) -> None:
    """Drive the plant and write odometry, commands and parameters."""
    configuration = configured(text)
    navigation = Navigation(configuration.settings)
    plant = Plant(configuration.fake_robot, configuration.settings.start)
    with recording(path) as recorder:
        recorder.write_text("/parameters", 0, text)
        for tick in range(round(LIMIT / PERIOD)):
            plant.advance(tick * PERIOD)
            reading, now = plant.read(), round(tick * PERIOD * 1e9)
            outcome = navigation.update(reading)
            recorder.write_odometry(now, reading)
            assert outcome.twist is not None
            recorder.write_command(now, outcome.twist)
            plant.receive(tick * PERIOD, outcome.twist)
            if navigation.state is not State.DRIVING:
                break


def compared(path: Path, text: str) -> Comparison:
    """Replay a bag with the code as it is; differences are in `comparison`."""
    with bags.opened(path) as bag:
        comparison = Comparison(TOLERANCE, TOLERANCE)
        replay = Replay(configured(text), bag, comparison, candidates=1)
        for _ in replay.samples():
            pass
    return comparison


def verdict(name: str, found: Comparison) -> str:
    """Return by how much and where a bag differs."""
    if found.equal:
        return f"{name}: equal, {found.matched} commands"
    return (
        f"{name}: differs from {found.first_divergence:.2f} s on, v by up to {found.max_v:.3g} m/s,"
        f" omega by up to {found.max_omega:.3g} rad/s; {found.matched} commands"
    )


def main(arguments: list[str]) -> int:
    """Show the differences; with --accept record anew."""
    differs = False
    for name, text in scenarios().items():
        found = compared(DATA / name, text) if (DATA / name).exists() else None
        differs |= found is None or not found.equal
        print(f"{name}: new" if found is None else verdict(name, found))
        if "--accept" in arguments and (found is None or not found.equal):
            record(DATA / name, text)
    return int(differs and "--accept" not in arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

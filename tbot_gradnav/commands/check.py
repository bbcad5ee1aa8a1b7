# SPDX-License-Identifier: Apache-2.0
"""gradnav check: whether a world is sound, before a robot moves in it."""

import argparse
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tbot_gradnav import certify, plots, shipped
from tbot_gradnav.certify import Landscape
from tbot_gradnav.files import write_json
from tbot_gradnav.potentials import AttractiveRepulsive, Map, NavigationFunction, Potential
from tbot_gradnav.settings import Settings

CONTACT = 0.01  # [m] from the boundary: furniture
SPECK = 0.01  # of the free area: a corner behind furniture
NEAREST = 0.05  # [m] a smaller influence distance is within a few control periods' travel


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a world, and what was found in it."""

    settings: Settings
    found: Landscape
    problems: list[str]
    notes: list[str]
    shares: list[float]  # of the free area, one for each minimum
    smallest_k: int | None

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument("file", help="parameter file")
    parser.add_argument("--json", metavar="OUT", help="write the verdict")
    parser.add_argument(
        "--plot", type=plots.picture, metavar="PNG", help="draw critical points and basins"
    )


def run(options: argparse.Namespace) -> int:
    """Certify; 0 if the world is sound."""
    verdict = judge(shipped.configuration(options.file).settings)
    print(f"{options.file}: {'sound' if verdict.sound else 'NOT sound'}")
    print("\n".join(_words(verdict)))
    if options.json:
        write_json(options.json, report(verdict))
    if options.plot:
        _plot(options.plot, verdict)
    return 0 if verdict.sound else 1


def judge(settings: Settings) -> Verdict:
    """Return the verdict on the world, the potential and the law of a file."""
    potential = settings.chosen_potential.all_seen()
    tolerance = settings.xy_goal_tolerance
    if isinstance(potential, Map):
        found = certify.on_lattice(potential, tolerance)
    else:
        found = certify.landscape(potential, tolerance)
    owner = certify.basins(found)[2] if found.spurious else np.zeros(1)
    shares = [float(np.mean(owner == i)) for i in range(len(found.minima))]
    k = None
    if isinstance(potential, NavigationFunction):
        k = certify.smallest_k(potential.world)
    tight, notes = _tight(settings)
    problems = [*settings.cautions, *tight, *_goal(found), *_missed(found)]
    problems += _minima(found, shares)
    if found.spurious:
        problems[-1] += _advice(potential, k)
    return Verdict(settings, found, problems, notes, shares, k)


def report(verdict: Verdict) -> dict[str, Any]:
    """Return the JSON of a verdict."""
    return {
        "sound": verdict.sound,
        "problems": verdict.problems,
        "spurious_minima": [[p.x, p.y] for p in verdict.found.spurious],
        "smallest_k": verdict.smallest_k,
        "critical_points": [[p.x, p.y, p.kind] for p in verdict.found.points],
        "count_agrees": verdict.found.agrees,
    }


def _tight(settings: Settings) -> tuple[list[str], list[str]]:
    """Return problems and notes about what the robot does not fit between.

    What stands at the boundary is furniture, unless there is no way behind it.
    """
    pairs = certify.overlaps(settings.world)
    touching = [b for a, b, gap in pairs if a == "boundary" and gap <= CONTACT]
    problems = [
        f"{a} and {b} are {gap:.3f} m apart, and the robot is {2 * settings.robot_radius:g} m "
        "wide: no way between them. Move them apart, or make one obstacle of them"
        for a, b, gap in pairs
        if b not in touching or a != "boundary"
    ]
    lost = certify.cut_off(settings.world) if pairs else 0.0
    if lost > SPECK:
        problems.append(f"from {lost:.1%} of the free area there is no way to the goal")
    return problems, [f"{name} stands at the boundary" for name in touching]


def _goal(found: Landscape) -> list[str]:
    if found.goal_is_minimum:
        return []
    near = min(found.minima, key=lambda p: _from_goal(found, p.x, p.y), default=None)
    text = "the goal is not a minimum of the potential"
    if near is not None:
        text += f"; the nearest is {_from_goal(found, near.x, near.y):.3f} m from it"
    if isinstance(found.potential, AttractiveRepulsive) and not found.potential.goal_scaled:
        text += ". Set attractive_repulsive.goal_scaled: true"
    return [text]


def _missed(found: Landscape) -> list[str]:
    if found.agrees is not False:
        return []
    return [
        "the number of critical points found is not what the topology of the free space asks for: "
        "some were missed, or the potential does not rise towards all obstacles"
    ]


def _minima(found: Landscape, shares: list[float]) -> list[str]:
    """Return one problem for all spurious minima, if there are any."""
    places = ", ".join(
        f"({p.x:.3f}, {p.y:.3f}) m, to which {share:.0%} of the free area flows"
        for p, share in zip(found.minima, shares, strict=True)
        if p in found.spurious
    )
    return [f"minima other than the goal, where a robot stays: {places}"] if places else []


def _advice(potential: Potential, k: int | None) -> str:
    """Return what would leave no minimum but the goal, as a sentence."""
    if isinstance(potential, NavigationFunction) and k is not None:
        return f". navigation_function.k: {k} is the smallest integer that leaves none"
    if isinstance(potential, AttractiveRepulsive):
        while potential.influence_distance >= 2.0 * NEAREST:
            potential = replace(
                potential,
                influence_distance=0.5 * potential.influence_distance,
                k_repulsive=0.5 * potential.k_repulsive,
            )
            if not certify.landscape(potential).spurious:
                return (
                    f". influence_distance: {potential.influence_distance:.3g} with k_repulsive: "
                    f"{potential.k_repulsive:.3g} leaves none"
                )
    return ". Move the goal or the obstacles, or use another potential"


def _words(verdict: Verdict) -> list[str]:
    """Return the verdict for people, a line each."""
    found, lines = verdict.found, [f"  - {problem}" for problem in verdict.problems]
    lines += [f"  {note}" for note in verdict.notes]
    if isinstance(found.potential, Map):
        return lines + _map_words(found.potential)
    if found.potential.looks:
        lines.append("  this is the landscape for a robot that has seen everything")
    kinds = [p.kind for p in found.points]
    counted = ", ".join(f"{kind}: {kinds.count(kind)}" for kind in sorted(set(kinds)))
    lines.append(f"  critical points found: {counted}")
    lines.append(
        {
            True: "  their number is what the topology of the free space asks for (Poincare-Hopf):"
            " good evidence, not proof, that none was missed",
            False: "  so do not rely on what else this verdict says",
            None: "  where inflated obstacles overlap, theory gives no number to compare with",
        }[found.agrees]
    )
    if isinstance(found.potential, NavigationFunction):
        lines.append(f"  smallest integer k without a minimum but the goal: {verdict.smallest_k}")
    return lines


def _map_words(potential: Map) -> list[str]:
    free, led = potential.counts
    return [
        f"  {led} of {free} free nodes of the map's lattice have a way to the goal",
        "  each of them has a lower one beside it but for the minima named above, if any: between"
        " nodes there are none",
    ]


def _from_goal(found: Landscape, x: float, y: float) -> float:
    goal_x, goal_y = found.potential.world.goal
    return float(np.hypot(x - goal_x, y - goal_y))


def _plot(path: str, verdict: Verdict) -> None:
    with plots.figure(path) as ax:
        plots.draw_potential(ax, verdict.found.potential)
        plots.draw_world(ax, verdict.settings.world)
        plots.draw_landscape(ax, verdict.found)
        ax.set_title(f"{'sound' if verdict.sound else 'NOT sound'}: {verdict.settings.potential}")

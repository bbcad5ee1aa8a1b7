# SPDX-License-Identifier: Apache-2.0
"""All benchmarks: `make bench`. Writes results.md for people and results.json for machines."""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from bench import latency, quality, stepping
from bench.report import Results, as_json, as_text

HERE = Path(__file__).parent
RUNS = 3


def pinned(function: Any, *arguments: Any) -> Any:
    """Return what a function returns in a process of its own that is kept on one core."""
    pool = ProcessPoolExecutor(1, get_context("spawn"), initializer=stepping.one_core)
    with pool:
        return pool.submit(function, *arguments).result()


def say(text: str) -> None:
    """Show how far it is."""
    print(text, file=sys.stderr, flush=True)


def main() -> None:
    """Measure everything and write it down."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help="of what depends on the machine")
    parser.add_argument("--worlds", type=int, default=quality.worlds.WORLDS, help="random worlds")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the results")
    options = parser.parse_args()
    results = Results()
    for run in range(options.runs):
        say(f"run {run + 1} of {options.runs}: latency")
        results.latency.append(latency.measure())
        say(f"run {run + 1} of {options.runs}: simulation")
        results.batches.append(pinned(stepping.batches))
        results.irsim.append({n: pinned(stepping.irsim, n) for n in stepping.IRSIM_ROBOTS})
        results.solver.append({n: pinned(stepping.against_solver, n) for n in stepping.TOGETHER})
    for name in quality.NAMES:
        say(f"quality: {name}")
        results.quality |= quality.measure([name], options.worlds)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "results.json").write_text(
        json.dumps(as_json(results), indent=1) + "\n", encoding="utf-8"
    )
    (options.out / "results.md").write_text(as_text(results), encoding="utf-8")
    say(f"{options.out / 'results.md'}, {options.out / 'results.json'}")


if __name__ == "__main__":
    main()

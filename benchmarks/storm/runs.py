"""The storm's command: draw missions, run them, have them judged, print what was found."""

from __future__ import annotations

import argparse
import json
import random
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import marsupial
from benchmarks.storm.oracle import Oracle
from benchmarks.storm.worlds import scenario
from marsupial.errors import MarsupialError

LEADS_ROVERS = ("temporal", "heuristic", "heuristic-plus", "assignment", "clairvoyant")
LEADS_CARRIERS = ("closest-frontier", "segmentation", "bidding", "sheng", "covering", "orientation", "widest-frontier")
LEADS_ONE = ("orientation", "widest-frontier")
PLANNERS = ("auto", "anytime", "greedy", "exact")

AGAIN = 5
"""Every so many missions one is run a second time: its log has to be the same, byte for byte."""


@dataclass(frozen=True)
class Judged:
    """What came of one mission: how it ended (or was refused), and which rules it broke."""

    number: int
    label: str
    end: str
    findings: tuple[str, ...]


def mission(seed: int, number: int) -> Judged:
    """Draw, run and judge mission `number` of the storm with that seed."""
    rng = random.Random(f"{seed}/{number}")
    strategy = rng.choice((*LEADS_ROVERS, "temporal", "temporal", *LEADS_CARRIERS))
    rovers = strategy in LEADS_ROVERS and rng.random() < 0.9
    kind, document = scenario(rng, rovers=rovers, most_robots=1 if strategy in LEADS_ONE else None)
    planner, steps, draw = rng.choice(PLANNERS), rng.choice((1, 2, 8, 20)), rng.randrange(1, 10**6)
    label = f"{strategy} {planner} steps={steps} seed={draw} map={kind}"
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file, log = Path(folder, "world.json"), Path(folder, "log.jsonl")
        file.write_text(json.dumps(document), encoding="utf-8")
        explore = partial(marsupial.explore, file, strategy, planner, seed=draw, steps=steps)
        try:
            result = explore(log=log)
            lines = log.read_text(encoding="ascii").splitlines()
            findings = Oracle(document, lines, result.as_dict()).judge()
            if number % AGAIN == 0:
                explore(log=Path(folder, "again.jsonl"))
                if Path(folder, "again.jsonl").read_bytes() != log.read_bytes():
                    findings.append("the same mission again has another log")
        except MarsupialError as error:
            # A drawn team may not fit on its map: that is a refusal, as long as it is not an internal error.
            internal = type(error).__name__ == "InternalError"
            return Judged(number, label, "refused", (f"internal error: {error}",) if internal else ())
        except Exception as error:
            return Judged(number, label, "crashed", (f"{type(error).__name__}: {error}",))
    return Judged(number, label, result.status, tuple(findings))


def storm(seed: int, numbers: Sequence[int], workers: int) -> Iterator[Judged]:
    """Yield missions as they are judged."""
    judge = partial(mission, seed)
    if workers == 1:
        yield from map(judge, numbers)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(judge, numbers)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code: 1 if a mission broke a rule."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks storm", description=__doc__)
    parser.add_argument("--missions", type=int, default=2000, help="missions to run (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="draws the missions (default %(default)s)")
    parser.add_argument("--only", type=int, metavar="NUMBER", help="run this mission alone and print all findings")
    parser.add_argument("--workers", type=int, default=2, help="processes (default %(default)s)")
    chosen = parser.parse_args(arguments)
    numbers = range(chosen.missions) if chosen.only is None else (chosen.only,)
    began, ends, bad = time.monotonic(), Counter[str](), 0
    for judged in storm(chosen.seed, numbers, 1 if chosen.only is not None else chosen.workers):
        ends[judged.end] += 1
        if judged.findings:
            bad += 1
            shown = judged.findings if chosen.only is not None else judged.findings[:3]
            print(f"mission {judged.number}: {judged.label}: {judged.end}", *shown, sep="\n    ", flush=True)
    print(f"{sum(ends.values())} missions in {time.monotonic() - began:.0f} s:", end=" ")
    print(", ".join(f"{count} {end}" for end, count in ends.most_common()) + f"; {bad} with findings")
    return 1 if bad else 0

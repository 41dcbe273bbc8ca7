"""The storm's command: draw missions, run and judge them, print the findings."""

from __future__ import annotations

import argparse
import json
import random
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import marsupial
from benchmarks.storm.additions import (
    draw_batteries,
    draw_faults,
    draw_ranges,
    draw_seats,
    draw_zones,
    lost_late,
    zone_ahead,
)
from benchmarks.storm.ground import Document
from benchmarks.storm.oracle import judge_simulated
from benchmarks.storm.reported import Reporters, StormOutcome
from benchmarks.storm.worlds import scenario
from marsupial.errors import MarsupialError
from marsupial.model import Budget
from marsupial.planning.engines import ENGINES
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import RULES, STRATEGIES, frontier_rule

LEADS_ROVERS = (*(name for name in STRATEGIES if name not in RULES), CLAIRVOYANT)
LEADS_CARRIERS = tuple(RULES)
LEADS_ONE = ("orientation", "widest-frontier")

IN_STEPS = tuple(name for name, make in ENGINES.items() if make().info.deterministic_steps)
IN_SECONDS = tuple(name for name, make in ENGINES.items() if make().info.missing is None)
"""Planners that can count steps, which are drawn more often, and all planners installed here."""

REPORTED = 0.4
"""Share of missions whose robots report their own map."""

AGAIN = 5
"""One in this many missions runs twice; both logs must be equal, byte for byte."""


@dataclass(frozen=True)
class Judged:
    """The result of one mission: how it ended (or was refused), and which rules it broke."""

    number: int
    label: str
    end: str
    findings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Drawn:
    """A mission that is drawn; `rngs` draw what is added to it after a first run."""

    label: str
    document: Document
    run: Callable[[Path], StormOutcome]
    rngs: dict[str, random.Random]
    foresees: bool  # whether the strategy knows everything but faults beforehand
    timed: bool  # whether it depends on the machine


def mission(seed: int, number: int) -> Judged:
    """Draw, run and judge mission `number` of the storm with that seed."""
    drawn = _draw(seed, number)
    label, document = drawn.label, drawn.document
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        try:
            for what, share, draw in (("zones", 0.2, zone_ahead), ("faults", 0.15, lost_late)):
                rng = drawn.rngs[what]
                if rng.random() < share and not drawn.foresees:
                    more = draw(rng, drawn.run(folder).lines, document)
                    document[what] = [*document.get(what, []), *more]
                    label += f" {more}"
            outcome = drawn.run(folder)
            findings = outcome.judge()
            if number % AGAIN == 0 and not drawn.timed and drawn.run(folder).lines != outcome.lines:
                findings.append("the same mission again has another log")
        except MarsupialError as error:
            # A drawn team may not fit on its map: any error other than an internal one counts as a refusal.
            internal = type(error).__name__ == "InternalError"
            return Judged(number, label, "refused", (f"internal error: {error}",) if internal else ())
        except Exception as error:
            at = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(at.filename).name}:{at.lineno}"
            return Judged(number, label, "crashed", (f"{type(error).__name__} at {where}: {error}",))
    return Judged(number, f"{label} {outcome.label}", outcome.status, tuple(findings))


def _draw(seed: int, number: int) -> _Drawn:
    rng = random.Random(f"{seed}/{number}")
    strategy = rng.choice((*LEADS_ROVERS, "temporal", "temporal", *LEADS_CARRIERS))
    rovers, foresees = strategy in LEADS_ROVERS and rng.random() < 0.9, strategy == CLAIRVOYANT
    kind, document = scenario(rng, rovers=rovers, most_robots=1 if strategy in LEADS_ONE else None)
    draw = rng.randrange(1, 10**6)
    # the other draws are the same with and without these
    apart, ahead, radio, reports, late = (
        random.Random(f"{seed}/{number}/{what}") for what in ("seats", "ahead", "radio", "reports", "late")
    )
    if apart.random() < 0.3:
        draw_seats(apart, document)
    if apart.random() < 0.35 and not foresees:
        draw_batteries(apart, document)
    if rng.random() < 0.5 and not foresees:
        document["faults"] = draw_faults(rng, document)
    if rng.random() < 0.4 and not foresees:
        document["zones"] = draw_zones(rng, document)
    if radio.random() < 0.2 and not foresees:
        draw_ranges(radio, document)
    budget: dict[str, Any] = {"steps": rng.choice((1, 2, 8, 20))}
    planner = rng.choice(IN_STEPS)
    if rng.random() < 0.15:
        planner, budget = rng.choice(IN_SECONDS), {"budget": rng.choice((0.05, 0.2))}
    strategy = _with_parameters(rng, strategy)
    timed = "seconds=" in strategy or "budget" in budget or document["planning_time"] == "charged"
    more = {key: document[key] for key in ("faults", "zones") if key in document}
    seats = [kind["seats"] for kind in document["robot_types"] if "seats" in kind]
    label = (
        f"{strategy} {planner} {budget} {document['planning_time']} seed={draw} map={kind} {seats or ''} {more or ''}"
    )
    run: Callable[[Path], StormOutcome] = partial(_simulated, document, strategy, planner, draw, budget)
    if reports.random() < REPORTED and not foresees:
        most = Budget(steps=budget.get("steps"), seconds=budget.get("budget"))
        how = {"strategy": strategy, "planner": planner, "budget": most, "seed": draw}
        run = Reporters(reports, document, how).run
    return _Drawn(label, document, run, {"zones": ahead, "faults": late}, foresees, timed)


def _simulated(
    document: Document, strategy: str, planner: str, seed: int, budget: dict[str, Any], folder: Path
) -> StormOutcome:
    """Run a mission in the simulator."""
    file, log = Path(folder, "world.json"), Path(folder, "log.jsonl")
    file.write_text(json.dumps(document), encoding="utf-8")
    result = marsupial.explore(file, strategy, planner, seed=seed, log=log, **budget)
    lines = log.read_text(encoding="ascii").splitlines()
    drawn = deepcopy(document)
    return StormOutcome(lines, result.status, partial(judge_simulated, drawn, lines, result.as_dict()))


def _with_parameters(rng: random.Random, strategy: str) -> str:
    """Return a rule, sometimes with values for its parameters; return any other strategy unchanged."""
    if strategy not in RULES:
        return strategy
    known = [each.name for each in fields(frontier_rule(strategy)) if each.init]  # type: ignore[arg-type]
    chosen = [f"{name}={rng.choice((0, 0.5, 1, 3))}" for name in known if rng.random() < 0.3]
    return "/".join((strategy, *chosen))


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
            again = f"python -m benchmarks storm --seed {chosen.seed} --only {judged.number}"
            print(f"mission {judged.number}: {judged.label}: {judged.end}", *shown, again, sep="\n    ", flush=True)
    print(f"{sum(ends.values())} missions in {time.monotonic() - began:.0f} s:", end=" ")
    print(", ".join(f"{count} {end}" for end, count in ends.most_common()) + f"; {bad} with findings")
    return 1 if bad else 0

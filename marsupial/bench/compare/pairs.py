"""Replays of notable pairs of missions: for each rival of the base, those with the greatest and the least gain.

The missions are run again, which reproduces them if planning is limited by steps, and written as a page that plays both
side by side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.figures import slug
from marsupial.bench.compare.plan import Case, Comparison, Contender
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.model.mission import MissionEvent
from marsupial.replay.page import replay_page

FOLDER = "replays"


@dataclass(frozen=True, slots=True, kw_only=True)
class NotablePair:
    """A mission of a rival and one of the base; `gain` is the time saved relative to the base's."""

    kind: str
    case: Case
    rival: Contender
    seed: int
    gain: float

    @property
    def path(self) -> str:
        """Path of its page in the comparison's folder."""
        return f"{FOLDER}/{self.kind}-{slug(f'{self.case} {self.rival}')}-seed{self.seed}.html"


@dataclass(frozen=True, slots=True)
class PairReplay:
    """A link to a page: its path in the folder, and its text."""

    path: str
    text: str


def notable_pairs(outcome: ComparisonOutcome) -> list[NotablePair]:
    """Return the best and the worst pair of each rival, of those with two complete missions."""
    found: list[NotablePair] = []
    for rival in outcome.rivals:
        pairs = [
            NotablePair(
                kind="", case=replace(case, scenario=start.map), rival=rival, seed=start.seed, gain=1 - ours / theirs
            )
            for case in outcome.cases
            for start, ours, theirs in outcome.pairs(case, rival, TIME)
            if theirs
        ]
        if pairs:
            ranked = sorted(pairs, key=lambda pair: pair.gain)
            chosen = {"best": ranked[-1]} | ({"worst": ranked[0]} if len(ranked) > 1 else {})
            found += [replace(pair, kind=kind) for kind, pair in chosen.items()]
    return found


def pair_pages(comparison: Comparison, outcome: ComparisonOutcome, out: Path) -> Iterator[tuple[str, bytes]]:
    """Yield path and content of the page of each notable pair that is not in the folder `out` yet.

    Yield nothing if planning was limited by time: a second run may differ.
    """
    if comparison.budget.seconds is not None:
        return
    for pair in notable_pairs(outcome):
        if not (out / pair.path).exists():
            ours, theirs = (_rerun(comparison, pair, contender) for contender in (pair.rival, outcome.base))
            yield pair.path, replay_page(ours, theirs).encode()


def _rerun(comparison: Comparison, pair: NotablePair, contender: Contender) -> tuple[MissionEvent, ...]:
    recorder = Recorder()
    simulate(
        comparison.scenarios[pair.case],
        strategy=contender.strategy,
        planner=contender.planner,
        budget=comparison.budget,
        seed=pair.seed,
        observer=recorder,
    )
    return tuple(recorder.events)


def replays_in(out: Path, outcome: ComparisonOutcome) -> list[PairReplay]:
    """Return the links to the pages in a folder."""
    return [
        PairReplay(
            pair.path,
            f"{pair.kind} pair of {pair.rival}: {pair.case}, seed {pair.seed}, "
            f"{100 * abs(pair.gain):.1f} % {'faster' if pair.gain >= 0 else 'slower'} than {outcome.base}",
        )
        for pair in notable_pairs(outcome)
        if (out / pair.path).exists()
    ]

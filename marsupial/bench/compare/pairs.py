"""Replays of notable pairs of missions: for each rival of the base, those with the greatest and the least gain.

The missions are run again, which reproduces them if planning is limited by steps, and written as a page that plays both
side by side.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from marsupial.bench.compare.answer import less_time
from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.figures import slug
from marsupial.bench.compare.plan import Case, Comparison, Contender, Trial
from marsupial.bench.compare.trial import simulated
from marsupial.library.recording import Recorder
from marsupial.replay.page import replay_page

FOLDER = "replays"


@dataclass(frozen=True, slots=True, kw_only=True)
class NotablePair:
    """A mission of a rival and one of the base."""

    kind: str
    case: Case
    rival: Contender
    seed: int
    gain: float  # how much less time the one that reports are about takes, as a share of the other one's

    @property
    def path(self) -> str:
        """Path of its page in the comparison's folder."""
        return f"{FOLDER}/{self.kind}-{slug(f'{self.case} {self.rival}')}-seed{self.seed}.html"


def notable_pairs(outcome: ComparisonOutcome) -> list[NotablePair]:
    """Return the best and the worst pair of each rival, of those with two complete missions."""
    found: list[NotablePair] = []
    for rival in outcome.rivals:
        one, other = outcome.sides(rival)
        pairs = [
            (1 - ours / theirs, replace(case, scenario=start.map), start.seed)
            for case in outcome.cases
            for start, ours, theirs in outcome.pairs(case, one, TIME, other)
            if theirs
        ]
        ranked = sorted(pairs, key=lambda pair: pair[0])
        for kind, chosen in (("best", ranked[-1:]), ("worst", ranked[:1] if len(ranked) > 1 else [])):
            for gain, case, seed in chosen:
                found.append(NotablePair(kind=kind, case=case, rival=rival, seed=seed, gain=gain))
    return found


def pair_pages(comparison: Comparison, outcome: ComparisonOutcome, out: Path) -> Iterator[tuple[str, bytes]]:
    """Yield path and content of the page of each notable pair that is not in the folder `out` yet."""
    if comparison.budget.seconds is not None:
        return  # a second run may differ where planning is limited by time
    for pair in notable_pairs(outcome):
        if not (out / pair.path).exists():
            recorders = Recorder(), Recorder()
            for contender, recorder in zip((pair.rival, outcome.base), recorders, strict=True):
                trial = Trial(pair.case, contender, pair.seed)
                simulated(trial, comparison.scenarios[pair.case], comparison.budget, recorder, comparison.own)
            yield pair.path, replay_page(*(recorder.events for recorder in recorders)).encode()


def replays_in(out: Path, outcome: ComparisonOutcome) -> dict[str, str]:
    """Return the texts of links to the pages in a folder, by their path in it."""
    return {
        pair.path: f"{pair.kind} pair of {one}: {pair.case}, seed {pair.seed}, {less_time(pair.gain)} than {other}"
        for pair in notable_pairs(outcome)
        for one, other in [outcome.sides(pair.rival)]
        if (out / pair.path).exists()
    }

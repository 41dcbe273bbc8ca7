"""Aggregates of rows: a cell per case and contender, a pairing per rival of the last contender.

Means are over complete missions, and differences over pairs of these: the time of a mission that left something
unexplored has no meaning. Their numbers are shown beside every figure, so that a contender gains nothing by failing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import fmean
from typing import Any

from marsupial.bench.compare.header import cases_of, contenders_of
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.rows import Curve, MissionRow, Timing
from marsupial.bench.compare.statistics import FEWEST_PAIRS, Estimate, estimate
from marsupial.library.metrics import METRICS, Metric
from marsupial.model.mission import Status
from marsupial.strategies.clairvoyant import CLAIRVOYANT

TIME = METRICS["exploration_time_s"]
QUALITY = replace(METRICS["quality"], title="exploration quality Q")
MISSION_TIME = METRICS["mission_time_s"]
DISTANCE = METRICS["distance_m"]
ENERGY = METRICS["energy_j"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairing:
    """A contender against another one, the base, seed by seed.

    `ahead` is the mean of the paired differences, positive in favour of the contender; `gain` is the same relative to
    the base's mean. `gains` are the differences relative to the base's value in the same mission, where that is not 0.
    `missing` counts the pairs with an incomplete mission.
    """

    case: Case
    ahead: Estimate | None
    gain: float | None
    gains: tuple[float, ...]
    wins: int
    losses: int
    ties: int
    missing: int


@dataclass(frozen=True, eq=False)
class ComparisonOutcome:
    """The contents of a comparison's folder."""

    header: Mapping[str, Any]
    rows: tuple[MissionRow, ...]
    timings: tuple[Timing, ...] = ()
    curves: tuple[Curve, ...] = ()

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """The cases in order."""
        return cases_of(self.header)

    @cached_property
    def contenders(self) -> tuple[Contender, ...]:
        """The contenders in order."""
        return contenders_of(self.header)

    @property
    def clairvoyant(self) -> Contender | None:
        """The contender that knows the map beforehand, if any."""
        return next((contender for contender in self.contenders if contender.strategy == CLAIRVOYANT), None)

    @property
    def strategies(self) -> tuple[Contender, ...]:
        """The contenders that do not know the map."""
        return tuple(contender for contender in self.contenders if contender.strategy != CLAIRVOYANT)

    @property
    def base(self) -> Contender:
        """The contender to compare the others with: the last one that does not know the map."""
        return (self.strategies or self.contenders)[-1]

    @property
    def rivals(self) -> tuple[Contender, ...]:
        """The contenders to compare with the base."""
        return self.strategies[:-1]

    @cached_property
    def scenarios(self) -> tuple[str, ...]:
        """The names of the scenarios in order."""
        return tuple(dict.fromkeys(case.scenario for case in self.cases))

    @property
    def runs(self) -> int:
        """Number of missions per case and contender."""
        return int(self.header["runs"])

    @property
    def planned(self) -> int:
        """Number of missions in all."""
        return self.runs * len(self.cases) * len(self.contenders)

    def cases_of(self, scenario: str) -> tuple[Case, ...]:
        """Return the cases of a scenario."""
        return tuple(case for case in self.cases if case.scenario == scenario)

    def statuses(self, scenario: str, contender: Contender) -> Counter[str]:
        """Count how the missions of a contender on a scenario ended, `complete` first."""
        found = Counter(
            row.status for row in self.rows if row.trial.case.scenario == scenario and row.trial.contender == contender
        )
        return Counter({status: found[status] for status in sorted(found, key=lambda s: (s != Status.COMPLETE, s))})

    def incomplete(self) -> tuple[MissionRow, ...]:
        """Return the rows of incomplete missions."""
        return tuple(row for row in self.rows if not row.complete)

    def estimate(self, case: Case, contender: Contender, measure: Metric) -> Estimate | None:
        """Return the mean of a metric over the complete missions of a cell."""
        return estimate(list(self._values(case, contender, measure).values()))

    def pairing(self, case: Case, contender: Contender, measure: Metric, base: Contender | None = None) -> Pairing:
        """Return a contender against the base (or another one) on a case, over the seeds both completed."""
        pairs = self.pairs(case, contender, measure, base)
        differences = [measure.better * (ours - theirs) for _, ours, theirs in pairs]
        # the share of the mean, in which long missions weigh more, and the mean of shares answer different questions
        level = fmean(theirs for _, _, theirs in pairs) if pairs else 0.0
        return Pairing(
            case=case,
            ahead=estimate(differences, FEWEST_PAIRS),
            gain=fmean(differences) / level if level else None,
            gains=tuple(measure.better * (ours - theirs) / theirs for _, ours, theirs in pairs if theirs),
            wins=sum(difference > 0 for difference in differences),
            losses=sum(difference < 0 for difference in differences),
            ties=sum(difference == 0 for difference in differences),
            missing=self.runs - len(pairs),
        )

    def pairs(
        self, case: Case, contender: Contender, measure: Metric, base: Contender | None = None
    ) -> list[tuple[int, float, float]]:
        """Return the seeds that both completed, with the values of the contender and of the base."""
        ours, theirs = (self._values(case, one, measure) for one in (contender, base or self.base))
        return [(seed, value, theirs[seed]) for seed, value in ours.items() if seed in theirs]

    def ratio(self, case: Case, contender: Contender) -> Estimate | None:
        """Return the mean ratio of exploration times to the clairvoyant's, over the seeds both completed.

        None without a clairvoyant. Missions in which it has nothing to explore are left out.
        """
        if self.clairvoyant is None:
            return None
        ours, best = (self._values(case, one, TIME) for one in (contender, self.clairvoyant))
        return estimate([ours[seed] / best[seed] for seed in ours if best.get(seed)])

    def timings_of(self, case: Case, contender: Contender) -> list[Timing]:
        """Return the wall-clock times of a cell's missions."""
        return self._cells.get((Timing, case, contender), [])

    def curves_of(self, case: Case, contender: Contender) -> list[Curve]:
        """Return the coverage over time of a cell's missions."""
        return self._cells.get((Curve, case, contender), [])

    def _values(self, case: Case, contender: Contender, measure: Metric) -> dict[int, float]:
        """Return a metric by seed, of complete missions only."""
        # sorted by seed: rows of a comparison that is running are in the order in which missions finished
        rows = self._cells.get((MissionRow, case, contender), ())
        values = ((row.trial.seed, getattr(row, measure.column)) for row in rows if row.complete)
        return {seed: value for seed, value in sorted(values) if value is not None}

    @cached_property
    def _cells(self) -> dict[tuple[type, Case, Contender], list[Any]]:
        """The records of every kind by cell."""
        cells: dict[tuple[type, Case, Contender], list[Any]] = {}
        records: tuple[MissionRow | Timing | Curve, ...] = (*self.rows, *self.timings, *self.curves)
        for record in records:
            cells.setdefault((type(record), record.trial.case, record.trial.contender), []).append(record)
        return cells


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """Counts over pairings: cells whose interval is on one side of 0, pairs won and lost, and their mean gain."""

    cells: int
    ahead: int
    behind: int
    gain: float | None
    half: float | None
    wins: int
    losses: int
    ties: int


def tally(pairings: Sequence[Pairing]) -> Tally:
    """Count pairings; every pair has the same weight in `gain`, as among those won and lost."""
    gains = [gain for pairing in pairings for gain in pairing.gains]
    found = estimate(gains, FEWEST_PAIRS)
    signs = [pairing.ahead.sign for pairing in pairings if pairing.ahead is not None]
    return Tally(
        cells=len(pairings),
        ahead=signs.count(1),
        behind=signs.count(-1),
        gain=None if found is None else found.mean,
        half=None if found is None else found.half,
        wins=sum(pairing.wins for pairing in pairings),
        losses=sum(pairing.losses for pairing in pairings),
        ties=sum(pairing.ties for pairing in pairings),
    )

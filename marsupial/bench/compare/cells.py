"""Aggregates of rows: a cell per case and contender, a pairing per rival of the last contender.

Means are over complete missions, and differences over pairs of these: the time of a mission that left something
unexplored has no meaning. Their numbers are shown beside every figure, so that a contender gains nothing by failing.

The maps of a suite are grouped by kind, or by building: a case is then a kind with a team, and its missions are on
several maps.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from marsupial.bench.compare.plan import Case, Contender, cases_of, contenders_of
from marsupial.bench.compare.rows import Curve, MissionRow, Timing
from marsupial.bench.compare.statistics import Estimate, Origin, estimate
from marsupial.bench.suite.maps import kind_of
from marsupial.library.metrics import METRICS, Metric
from marsupial.model.mission import KNOWN_PERCENT, Status
from marsupial.strategies.clairvoyant import CLAIRVOYANT

TIME = METRICS["exploration_time_s"]
QUALITY = replace(METRICS["quality"], title="exploration quality Q")
MISSION_TIME = METRICS["mission_time_s"]
DISTANCE = METRICS["distance_m"]
ENERGY = METRICS["energy_j"]
EVERYWHERE = "all"
OURS = "temporal"  # the strategy whose gains and losses reports show wherever it is the base
KNOWN = tuple(METRICS[f"known_{percent}_s"] for percent in KNOWN_PERCENT)
MOMENTS = (*KNOWN, METRICS["mean_known_s"], MISSION_TIME)  # from early to late
MEASURES = (TIME, MISSION_TIME, DISTANCE, ENERGY, QUALITY)  # the metrics of the main table


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairing:
    """A contender against another one, the base, mission by mission, over one or several cases.

    `logs` are the logarithms of the ratios of their values where both are above 0, positive in the contender's favour.
    """

    cases: tuple[Case, ...]
    measure: Metric
    origins: tuple[Origin, ...]
    logs: tuple[float, ...]
    wins: int
    losses: int
    ties: int

    @property
    def case(self) -> Case:
        """The case, if it is one."""
        (case,) = self.cases
        return case

    @property
    def estimate(self) -> Estimate | None:
        """The gain: the share of the base's value that is saved, or gained, by the geometric mean of the ratios."""
        found = estimate(self.origins, self.logs)
        return None if found is None else found.mapped(self._share)

    @property
    def gain(self) -> float | None:
        return None if (found := self.estimate) is None else found.mean

    @property
    def gains(self) -> tuple[float, ...]:
        return tuple(map(self._share, self.logs))

    @property
    def sign(self) -> int | None:
        """1 or -1 if the whole interval is in favour of the contender or against it, else 0; None without one."""
        return None if (found := self.estimate) is None or found.half is None else found.sign

    @property
    def ahead(self) -> bool | None:
        """Whether the whole interval is in favour of the contender; None without one."""
        return None if self.sign is None else self.sign > 0

    def _share(self, log: float) -> float:
        return -math.expm1(-log) if self.measure.better < 0 else math.expm1(log)


@dataclass(frozen=True, eq=False)
class ComparisonOutcome:
    """The contents of a comparison's folder."""

    header: Mapping[str, Any]
    rows: tuple[MissionRow, ...]
    timings: tuple[Timing, ...] = ()
    curves: tuple[Curve, ...] = ()

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """The cases in order, those of a suite by kind of map."""
        return tuple(self._maps)

    @cached_property
    def _maps(self) -> dict[Case, list[str]]:
        maps: dict[Case, list[str]] = {}
        for case in cases_of(self.header):
            maps.setdefault(self._by_kind(case), []).append(case.scenario)
        return maps

    @property
    def maps(self) -> set[str]:
        return {name for names in self._maps.values() for name in names}

    def _by_kind(self, case: Case) -> Case:
        """Return the case that counts a case of the header: in a suite, that of all maps of its kind or building."""
        return replace(case, scenario=kind_of(case.scenario)) if self.header.get("suite") else case

    @cached_property
    def contenders(self) -> tuple[Contender, ...]:
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
        return tuple(dict.fromkeys(case.scenario for case in self.cases))

    @property
    def places(self) -> dict[str, tuple[Case, ...]]:
        """All cases, then those of each scenario or, with a single one, of each team."""
        found: dict[str, tuple[Case, ...]] = {EVERYWHERE: self.cases}
        for case in self.cases if len(self.cases) > 1 else ():
            part = case.scenario if len(self.scenarios) > 1 else case.team
            found[part] = (*found.get(part, ()), case)
        return found

    @property
    def runs(self) -> int:
        """Number of missions per map, team and contender."""
        return int(self.header["runs"])

    def missions_of(self, *cases: Case) -> int:
        """Return the number of missions of a contender on some cases."""
        return self.runs * sum(len(self._maps[case]) for case in cases)

    @property
    def planned(self) -> int:
        """Number of missions in all."""
        return self.missions_of(*self.cases) * len(self.contenders)

    def cases_of(self, scenario: str) -> tuple[Case, ...]:
        return tuple(case for case in self.cases if case.scenario == scenario)

    def statuses(self, scenario: str, contender: Contender) -> Counter[str]:
        """Count how the missions of a contender on a scenario ended, `complete` first."""
        rows = (row for case in self.cases_of(scenario) for row in self._cells.get((MissionRow, case, contender), ()))
        found = Counter(row.status for row in rows)
        return Counter({status: found[status] for status in sorted(found, key=lambda s: (s != Status.COMPLETE, s))})

    def incomplete(self) -> tuple[MissionRow, ...]:
        return tuple(row for row in self.rows if not row.complete)

    def estimate(self, case: Case, contender: Contender, measure: Metric) -> Estimate | None:
        """Return the mean of a metric over the complete missions of a cell."""
        values = self._values(case, contender, measure)
        return estimate(list(values), list(values.values()))

    def pairing(
        self, cases: Case | Sequence[Case], contender: Contender, measure: Metric, base: Contender | None = None
    ) -> Pairing:
        """Return a contender against the base (or another one) on some cases, over the missions both completed."""
        chosen = (cases,) if isinstance(cases, Case) else tuple(cases)
        pairs = [pair for case in chosen for pair in self.pairs(case, contender, measure, base)]
        ahead = [measure.better * (ours - theirs) for _, ours, theirs in pairs]
        ratios = [(start, ours / theirs) for start, ours, theirs in pairs if ours > 0 and theirs > 0]
        return Pairing(
            cases=chosen,
            measure=measure,
            origins=tuple(start for start, _ in ratios),
            logs=tuple(measure.better * math.log(ratio) for _, ratio in ratios),
            wins=sum(difference > 0 for difference in ahead),
            losses=sum(difference < 0 for difference in ahead),
            ties=sum(difference == 0 for difference in ahead),
        )

    @property
    def about_base(self) -> bool:
        """Whether reports say what the base saves against each rival, instead of each rival against the base."""
        return self.base.strategy == OURS

    def shown(self, cases: Case | Sequence[Case], rival: Contender, measure: Metric) -> Pairing:
        """Return the pairing of a rival and the base that reports show."""
        one, other = self.sides(rival)
        return self.pairing(cases, one, measure, other)

    def sides(self, rival: Contender) -> tuple[Contender, Contender]:
        """Return whom such a pairing is about, and against whom."""
        return (self.base, rival) if self.about_base else (rival, self.base)

    @property
    def all_sides(self) -> tuple[str, str]:
        """In words, whom the pairings of all rivals are about, and against whom."""
        return (str(self.base), "each") if self.about_base else ("each", str(self.base))

    def pairs(
        self, case: Case, contender: Contender, measure: Metric, base: Contender | None = None
    ) -> list[tuple[Origin, float, float]]:
        """Return the missions that both completed, with the values of the contender and of the base."""
        ours, theirs = (self._values(case, one, measure) for one in (contender, base or self.base))
        return [(start, value, theirs[start]) for start, value in ours.items() if start in theirs]

    def ratio(self, case: Case, contender: Contender) -> Estimate | None:
        """Return the mean ratio of exploration times to the clairvoyant's, over the missions both completed.

        None without a clairvoyant; missions in which it has nothing to explore are left out.
        """
        if self.clairvoyant is None:
            return None
        pairing = self.pairing(case, self.clairvoyant, TIME, contender)
        found = estimate(pairing.origins, pairing.logs)
        return None if found is None else found.mapped(math.exp)

    def timings_of(self, case: Case, contender: Contender) -> list[Timing]:
        return self._cells.get((Timing, case, contender), [])

    def curves_of(self, case: Case, contender: Contender) -> list[Curve]:
        return self._cells.get((Curve, case, contender), [])

    def _values(self, case: Case, contender: Contender, measure: Metric) -> dict[Origin, float]:
        """Return a metric by map and seed, of complete missions only."""
        # sorted: rows of a comparison that is running are in the order in which missions finished
        rows = self._cells.get((MissionRow, case, contender), ())
        values = ((row.trial.origin, getattr(row, measure.column)) for row in rows if row.complete)
        return {start: value for start, value in sorted(values) if value is not None}

    @cached_property
    def _cells(self) -> dict[tuple[type, Case, Contender], list[Any]]:
        """The records of every kind by cell."""
        cells: dict[tuple[type, Case, Contender], list[Any]] = {}
        records: tuple[MissionRow | Timing | Curve, ...] = (*self.rows, *self.timings, *self.curves)
        for record in records:
            cell = type(record), self._by_kind(record.trial.case), record.trial.contender
            cells.setdefault(cell, []).append(record)
        return cells

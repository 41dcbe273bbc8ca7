"""The records of every mission as lines of CSV: a row, its wall-clock times, and its coverage over time.

A row holds what is reproducible on any machine. Wall-clock times are in another file, and so is coverage over time,
which is long.
"""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Generic, TypeVar

from marsupial.bench.compare.plan import Case, Contender, Trial
from marsupial.library.metrics import METRICS, Summary
from marsupial.model.mission import Status

ERROR, CRASHED = "error", "crashed"
"""Status of a mission that raised an exception, and of one whose process died; the others are those of `Status`."""

KEY = ("scenario", "strategy", "planner", "carriers", "rovers", "seed")  # first columns of every file
COVERAGE_SCALE = 10_000  # stored coverage is in whole parts of 1 / this

Record = TypeVar("Record", "MissionRow", "Timing", "Curve")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRow:
    """One mission: how it ended, and its metrics (docs/command-line.md), None for those it lacks.

    `remaining` counts the frontiers left, `aboard` the rovers aboard at the end; `waits` and all after it are the
    mission's `Interference`.
    """

    trial: Trial
    status: str
    reason: str
    exploration_time_s: float | None = None
    mission_time_s: float | None = None
    known_50_s: float | None = None
    known_75_s: float | None = None
    known_90_s: float | None = None
    known_95_s: float | None = None
    known_99_s: float | None = None
    known_100_s: float | None = None
    mean_known_s: float | None = None
    coverage: float | None = None
    explored_area_m2: float | None = None
    reachable_area_m2: float | None = None
    distance_m: float | None = None
    quality: float | None = None
    energy_j: float | None = None
    replans: int | None = None
    plans_invalid: int | None = None
    plans_refused: int | None = None
    deployments: int | None = None
    retrievals: int | None = None
    aboard: int | None = None
    remaining: int | None = None
    waits: int | None = None
    waited_s: float | None = None
    deadlocks: int | None = None

    @property
    def complete(self) -> bool:
        """Whether the mission is complete, so that its metrics count."""
        return self.status == Status.COMPLETE and self.exploration_time_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Seconds that a mission took on its machine: wall clock, CPU, planning and map analysis."""

    trial: Trial
    wall_s: float
    cpu_s: float
    planning_median_s: float
    planning_p95_s: float
    planning_max_s: float
    planning_total_s: float
    first_plan_s: float
    analysis_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Coverage over time: after 0, `every_s`, 2 `every_s`, ... seconds of the mission, in parts of `COVERAGE_SCALE`."""

    trial: Trial
    every_s: float
    known: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """All records of a mission; only its row if it failed."""

    row: MissionRow
    timing: Timing | None = None
    curve: Curve | None = None


@dataclass(frozen=True, slots=True)
class Format(Generic[Record]):
    """The format of a kind of record: its class, and the parser of each column after `KEY`."""

    make: Callable[..., Record]
    readers: Mapping[str, Callable[[str], Any]]

    @property
    def head(self) -> str:
        return _line((*KEY, *self.readers))

    def encode(self, record: Record) -> str:
        case, contender = record.trial.case, record.trial.contender
        line: list[object] = [case.scenario, contender.strategy, contender.planner, case.carriers, case.rovers]
        return _line([*line, record.trial.seed, *(_written(getattr(record, name)) for name in self.readers)])

    def decode(self, fields: Sequence[str]) -> Record:
        """Return the record of a line's fields; raise a `ValueError` if their number or one of them is wrong."""
        scenario, strategy, planner, carriers, rovers, seed, *rest = fields
        texts = zip(self.readers.items(), rest, strict=True)
        values = {name: read(text) for (name, read), text in texts}
        case = Case(scenario, int(carriers), int(rovers))
        return self.make(trial=Trial(case, Contender(strategy, planner), int(seed)), **values)


def _line(values: Sequence[object]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(values)
    return text.getvalue()


def _written(value: object) -> str:
    """Return a value as text; floats in their shortest exact form."""
    if value is None:
        return ""
    if isinstance(value, tuple):
        return " ".join(map(str, value))
    text = repr(value) if isinstance(value, float) else str(value)
    return " ".join(text.split())  # no line breaks inside a field: readers split files into lines


def _or_none(read: Callable[[str], Any]) -> Callable[[str], Any]:
    return lambda text: None if text == "" else read(text)


METRIC_BY_COLUMN = {metric.column: metric for metric in METRICS.values()}


def metrics_of(record: type[MissionRow | Timing], summary: Summary) -> dict[str, Any]:
    """Return the metrics of a mission that a kind of record holds, by column, as in the CSV."""
    columns = [each.name for each in fields(record) if each.name in METRIC_BY_COLUMN]
    return {column: METRIC_BY_COLUMN[column].cell(summary) for column in columns}


_READERS: dict[str, Callable[[str], Any]] = {name: metric.read for name, metric in METRIC_BY_COLUMN.items()}
_READERS |= {"waits": int, "waited_s": float, "deadlocks": int}
_COLUMNS = (each.name for each in fields(MissionRow) if each.name != "trial")
ROWS = Format(MissionRow, {name: _or_none(_READERS[name]) if name in _READERS else str for name in _COLUMNS})

TIMINGS = Format(Timing, {each.name: _or_none(float) for each in fields(Timing) if each.name != "trial"})

CURVES = Format(Curve, {"every_s": float, "known": lambda text: tuple(map(int, text.split()))})

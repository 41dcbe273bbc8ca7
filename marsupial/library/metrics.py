"""The summary of a finished mission, and the one table of its metrics.

The fields of `Summary` are the keys of ``marsupial run --json``, in that order. A metric is defined in its field and
nowhere else: title, unit, definition, how its value is rounded in CSV and shown as text. JSON, CSV, tables and
notebooks take it from there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import StrEnum
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from marsupial.model import Interference, MissionEnded, PlanningReport, Remaining, Role, Scenario, Status
from marsupial.model.mission import KNOWN_PERCENT
from marsupial.wording import clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """A measure of a mission.

    Parameters
    ----------
    key
        The attribute of `Summary` and key in JSON; ``planning_s.median`` is an attribute of an object in it.
    title, unit, definition
        Texts for people; the unit is empty for counts.
    text
        Writes a value with its unit.
    better
        1 if more is better, -1 if less is, 0 if neither.
    digits
        Digits of a mean in tables.
    decimals
        Decimals in CSV; None for whole numbers, and for lists, whose length CSV gives.
    column
        Name of the column in CSV.
    """

    key: str = ""
    title: str
    unit: str
    definition: str
    text: Callable[[Any], str] = str
    better: int = 0
    digits: int = 1
    decimals: int | None = None
    column: str = ""

    @property
    def heading(self) -> str:
        """The title with a capital letter."""
        return f"{self.title[0].upper()}{self.title[1:]}"

    def of(self, summary: Summary) -> Any:
        """Return the value, None if the mission has none."""
        return attrgetter(self.key)(summary)

    def shown(self, summary: Summary) -> str:
        """Return the value as text with its unit."""
        return self.text(self.of(summary))

    def cell(self, summary: Summary) -> float | int | None:
        """Return the value for CSV."""
        value = self.of(summary)
        if isinstance(value, tuple):
            return len(value)
        return value if value is None or self.decimals is None else round(value, self.decimals)

    def read(self, text: str) -> float | int:
        """Return the value of a cell of CSV."""
        return int(text) if self.decimals is None else float(text)


def _digits(count: int, unit: str = "") -> Callable[[float], str]:
    return f"{{:.{count}f}}{f' {unit}' if unit else ''}".format


def _metric(title: str, unit: str, definition: str, **rest: Any) -> Any:
    return field(metadata={"metric": Metric(title=title, unit=unit, definition=definition, **rest)})


def _planning_time(title: str, definition: str, column: str, digits: int = 3) -> Any:
    return _metric(title, "s", definition, text=_digits(digits, "s"), better=-1, decimals=6, column=column)


def _known_time(percent: int) -> Any:
    return _metric(
        f"{percent} % known", "s",
        f"simulated time at which {percent} % of the reachable area were known; none if they never were",
        text=lambda seconds: "never" if seconds is None else clock(seconds), better=-1, decimals=3,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningTimes:
    """Wall-clock seconds of planning over the replannings of one mission; 0 if there was none."""

    median: float = _planning_time(
        "planning, median",
        "wall-clock time from a situation to the decision, median over all replannings",
        "planning_median_s",
    )
    p95: float = _planning_time("planning, p95", "its 95th percentile", "planning_p95_s")
    max: float = _planning_time("planning, max", "its maximum", "planning_max_s")
    total: float = _planning_time("planning, total", "its sum", "planning_total_s", digits=1)
    first_plan: float = _planning_time(
        "first plan", "median of the wall-clock times to an engine's first plan", "first_plan_s"
    )

    @classmethod
    def of(cls, reports: Sequence[PlanningReport]) -> PlanningTimes:
        """Return the statistics of these reports."""
        walls = np.array([report.wall_s for report in reports] or [0.0])
        firsts = [report.first_plan_s for report in reports if report.first_plan_s is not None]
        return cls(
            median=float(np.median(walls)),
            p95=float(np.percentile(walls, 95)),
            max=float(walls.max()),
            total=float(walls.sum()) if reports else 0.0,
            first_plan=float(np.median(firsts)) if firsts else 0.0,
        )


AS_ENDED = (
    "status", "reason", "coverage", "explored_area_m2", "reachable_area_m2", "replans", "plans_valid", "plans_invalid",
    "deployments", "retrievals", "aboard", "lost", "remaining", "interference",
)  # fmt: skip
"""The fields that a summary copies from a mission's last event."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """A finished mission: its arguments, how it ended, its metrics."""

    status: Status
    reason: str
    scenario: str
    strategy: str
    planner: str
    carriers: int
    rovers: float
    robots: int
    seed: int
    exploration_time_s: float | None = _metric(
        "exploration time", "s", "simulated time at which the last target was gone; none if targets are left",
        text=lambda seconds: "never done" if seconds is None else clock(seconds), better=-1, decimals=3,
    )  # fmt: skip
    mission_time_s: float = _metric(
        "mission time", "s", "simulated time at which the mission ended", text=clock, better=-1, decimals=3
    )
    known_50_s: float | None = _known_time(50)
    known_75_s: float | None = _known_time(75)
    known_90_s: float | None = _known_time(90)
    known_95_s: float | None = _known_time(95)
    known_99_s: float | None = _known_time(99)
    known_100_s: float | None = _known_time(100)
    mean_known_s: float | None = _metric(
        "mean time to known", "s",
        "mean simulated time at which a reachable cell became known, the area above the curve of the known share; a "
        "cell that never did counts with the end",
        text=lambda seconds: "not known" if seconds is None else clock(seconds), better=-1, decimals=3,
    )  # fmt: skip
    coverage: float = _metric(
        "coverage", "", "known share of the reachable area, 0 to 1", text="{:.1%}".format, better=1, decimals=6
    )
    explored_area_m2: float = _metric(
        "explored area", "m²", "known part of the reachable area", text=_digits(1, "m2"), better=1, decimals=6
    )
    reachable_area_m2: float = _metric(
        "reachable area", "m²",
        "area of the cells that some robot of the team can come to stand on, in the true map",
        text=_digits(1, "m2"), decimals=6,
    )  # fmt: skip
    distance_m: float = _metric(
        "distance", "m", "metres driven by all robots themselves; being carried does not count",
        text=_digits(1, "m"), better=-1, decimals=3,
    )  # fmt: skip
    distance_m_per_robot: Mapping[str, float]
    quality: float = _metric(
        "quality Q", "m²/m", "explored part of the reachable area over the sum of all distances",
        text=_digits(3, "m2/m"), better=1, digits=3, decimals=6,
    )  # fmt: skip
    energy_j: float = _metric(
        "energy", "J", "of all robots: idle power by mission time, drive power by time driven; metres, stops, turns",
        text=lambda joules: f"{joules / 1000:.1f} kJ", better=-1, decimals=3,
    )  # fmt: skip
    energy_j_per_robot: Mapping[str, float]
    replans: int = _metric("replans", "", "plans followed")
    plans_valid: int = _metric("valid plans", "", "plans of the strategy that the checker accepted")
    plans_invalid: int = _metric(
        "invalid plans", "", "plans of the strategy that the checker refused; one of them ends the mission", better=-1
    )
    plans_refused: int = _metric("refused plans", "", "plans of engines that the checker did not let through")
    planning_s: PlanningTimes
    analysis_s: float | None = _metric(
        "analysis", "s", "wall-clock time of analysing the map: footprints, reach, targets, meeting points, travel "
        "times; none if a service did that",
        text=lambda seconds: "not known" if seconds is None else f"{seconds:.1f} s", better=-1, decimals=6,
    )  # fmt: skip
    deployments: int = _metric("deployments", "", "undockings that were carried out")
    retrievals: int = _metric("retrievals", "", "dockings that were carried out")
    aboard: tuple[str, ...] = _metric("aboard", "", "rovers aboard at the end")
    lost: tuple[str, ...] = _metric("lost", "", "robots that are lost at the end")
    remaining: tuple[Remaining, ...] = _metric("remaining", "", "frontiers left at the end, each with its reason")
    interference: Interference | None = None
    log: Path | None = None
    wall_s: float = _metric("wall-clock time", "s", "wall-clock time of the whole mission", decimals=4)

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        *,
        strategy: str,
        planner: str,
        seed: int,
        ended: MissionEnded,
        reports: Sequence[PlanningReport],
        analysis_s: float | None,
        wall_s: float,
    ) -> Summary:
        """Return the summary of a mission from its last event and the reports of its planning calls."""
        roles = [scenario.type_of(member).role for member in scenario.team]
        carriers, rovers = roles.count(Role.CARRIER), roles.count(Role.ROVER)
        driven = sum(metres for _, metres in ended.distance_m)
        return cls(
            scenario=scenario.name,
            strategy=strategy,
            planner=planner,
            carriers=carriers,
            rovers=_per_carrier(rovers, carriers),
            robots=carriers + rovers,
            seed=seed,
            exploration_time_s=_seconds(ended.exploration_ms),
            mission_time_s=ended.t_ms / 1000,
            distance_m=round(driven, 3),
            distance_m_per_robot=dict(ended.distance_m),
            quality=ended.explored_area_m2 / driven if driven else 0.0,
            energy_j=round(sum(joules for _, joules in ended.energy_j), 3),
            energy_j_per_robot=dict(ended.energy_j),
            plans_refused=sum(report.refused for report in reports),
            planning_s=PlanningTimes.of(reports),
            analysis_s=analysis_s,
            wall_s=wall_s,
            **_known_times_s(ended),
            **{name: getattr(ended, name) for name in AS_ENDED},
        )

    def as_dict(self) -> dict[str, Any]:
        """Return what ``marsupial run --json`` prints; metres, seconds and joules, every number finite."""
        told = {each.name: _plain(getattr(self, each.name)) for each in fields(Summary)}
        if self.interference is None:  # as in logs, where it is left out too
            del told["interference"]
        return told


def _known_times_s(ended: MissionEnded) -> dict[str, Any]:
    """Return when shares of the reachable area were known, as fields of `Summary`."""
    found = dict(ended.known_ms)
    times: dict[str, Any] = {f"known_{percent}_s": _seconds(found.get(percent)) for percent in KNOWN_PERCENT}
    return times | {"mean_known_s": _seconds(ended.mean_known_ms)}


def _seconds(milliseconds: int | None) -> float | None:
    return None if milliseconds is None else milliseconds / 1000


def _per_carrier(rovers: int, carriers: int) -> float:
    """Return the rovers per carrier, as `--rovers` counts them; a fraction if carriers bring different numbers."""
    if carriers == 0:
        return rovers
    share = rovers / carriers
    return int(share) if share.is_integer() else round(share, 3)


def _plain(value: Any) -> Any:
    """Return a value in the types of JSON."""
    if isinstance(value, StrEnum | Path):
        return str(value)
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if is_dataclass(value):
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value)}
    return value


def _metrics(kind: type, prefix: str = "") -> list[Metric]:
    found = []
    for each in fields(kind):
        if each.name == "planning_s":  # an object in JSON, a column for each of its fields in CSV
            found += _metrics(PlanningTimes, "planning_s.")
        elif "metric" in each.metadata:
            metric: Metric = each.metadata["metric"]
            found.append(replace(metric, key=prefix + each.name, column=metric.column or each.name))
    return found


METRICS: Mapping[str, Metric] = {metric.key: metric for metric in _metrics(Summary)}
"""Every metric by its key, in the order of the JSON."""

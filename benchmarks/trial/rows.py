"""Requirements, findings and verdicts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class Judgement(StrEnum):
    """The verdict of a row."""

    HELD = "held"
    MISSED = "MISSED"
    NOTED = ""
    NOT_RUN = "not run"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRow:
    """A requirement: `figure` is for people, `values` for programs; `goal` is empty where there is none."""

    part: str
    requirement: str
    figure: str
    goal: str = ""
    judgement: Judgement = Judgement.NOTED
    values: Mapping[str, float] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """Return everything, ready for JSON."""
        return {
            "part": self.part,
            "requirement": self.requirement,
            "figure": self.figure,
            "goal": self.goal,
            "judgement": self.judgement.value or "noted",
            "values": dict(self.values),
        }


def judged(held: bool) -> Judgement:
    """Return the verdict on a requirement."""
    return Judgement.HELD if held else Judgement.MISSED


def none_of(part: str, requirement: str, count: int, of: str = "") -> TrialRow:
    """Return the row of an event that must never happen."""
    return TrialRow(
        part=part,
        requirement=requirement,
        figure=f"{count}{of}",
        goal="0",
        judgement=judged(count == 0),
        values={"count": count},
    )


def percentile(numbers: Sequence[float], share: float) -> float:
    """Return the least of `numbers` that a `share` of them does not exceed (nearest rank); nan if there are none."""
    if not numbers:
        return math.nan
    return sorted(numbers)[max(0, math.ceil(share * len(numbers)) - 1)]


def times(
    part: str, requirement: str, seconds: Sequence[float], goal_s: float | None = None, more: str = ""
) -> TrialRow:
    """Return the row of measured times; the goal is for the 99th percentile."""
    found = {word: percentile(seconds, share) for word, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0))}
    if not seconds:
        return TrialRow(part=part, requirement=requirement, figure="nothing measured", judgement=Judgement.MISSED)
    return TrialRow(
        part=part,
        requirement=requirement,
        figure=", ".join(f"{word} {1000 * value:.0f}" for word, value in found.items())
        + f" ms of {len(seconds)}{more}",
        goal="" if goal_s is None else f"p99 {1000 * goal_s:.0f} ms",
        judgement=Judgement.NOTED if goal_s is None else judged(found["p99"] <= goal_s),
        values={f"{word}_s": value for word, value in found.items()} | {"count": len(seconds)},
    )


def table(rows: Iterable[TrialRow]) -> str:
    """Return the rows as text."""
    lines = [("part", "requirement", "goal", "found", "verdict")]
    lines += [(row.part, row.requirement, row.goal, row.figure, row.judgement.value) for row in rows]
    widths = [max(len(line[i]) for line in lines) for i in range(5)]
    return "\n".join(
        "  ".join(f"{word:<{width}}" for word, width in zip(line, widths, strict=True)).rstrip() for line in lines
    )

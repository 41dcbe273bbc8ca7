"""Synthetic outcomes of comparisons: with invented rows, or with given exploration times."""

from collections.abc import Mapping
from dataclasses import replace

from support.processes.compare_workers import invented, lobby

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.plan import Case, Comparison, Contender, Trial, header_of
from marsupial.bench.compare.rows import MissionRow

CASE = Case("lobby", 1, 1)


def outcome_of(
    comparison: Comparison, changed: Mapping[Trial, MissionRow] | None = None, *, upto: int | None = None
) -> ComparisonOutcome:
    results = [invented(trial) for trial in comparison.trials()][:upto]
    return ComparisonOutcome(
        header_of(comparison),
        tuple((changed or {}).get(result.row.trial, result.row) for result in results),
        tuple(result.timing for result in results if result.timing),
        tuple(result.curve for result in results if result.curve),
    )


def with_times(times: Mapping[Contender, list[float]]) -> ComparisonOutcome:
    """Return the outcome of one case with these exploration times by seed; below 0 the mission stalls."""
    comparison = lobby(runs=len(next(iter(times.values()))), contenders=list(times))
    changed = {}
    for contender, values in times.items():
        for seed, value in enumerate(values, 1):
            trial = Trial(CASE, contender, seed)
            row = invented(trial).row
            stalled = replace(row, status="stalled", reason="stuck", exploration_time_s=None)
            changed[trial] = replace(row, exploration_time_s=value) if value >= 0 else stalled
    return outcome_of(comparison, changed)

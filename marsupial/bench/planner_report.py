"""The report of the planner bench: a row per run, as text by instance and in a summary, or as JSON values."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import fmean
from typing import Any

from marsupial.bench.planners import CLOSE, BenchEngine, EngineRun, Round, deadline_s
from marsupial.bench.suite.catalogue import VERSION
from marsupial.model.planning import Outcome

SMALL_ROBOTS = 24  # the summary separates teams up to this size from larger ones


@dataclass(frozen=True, slots=True)
class RunRow:
    """A run and the best plan known after its round."""

    round: Round
    run: EngineRun

    @property
    def best_ms(self) -> int | None:
        return None if self.round.best is None else self.round.best.makespan_ms

    @property
    def ratio(self) -> float | None:
        """Makespan divided by the best known one; None without a plan."""
        if self.run.makespan_ms is None or self.best_ms is None:
            return None
        return self.run.makespan_ms / self.best_ms if self.best_ms else 1.0

    @property
    def first_s(self) -> float | None:
        """Arrival time of the first plan."""
        return self.run.arrivals[0].elapsed_s if self.run.arrivals else None

    @property
    def close_s(self) -> float | None:
        """Arrival time of the first plan close to the best known one."""
        if self.best_ms is None:
            return None
        return next((plan.elapsed_s for plan in self.run.arrivals if plan.makespan_ms <= CLOSE * self.best_ms), None)

    @property
    def refuted(self) -> bool:
        """Whether a known plan refutes the engine's bound."""
        bound_ms = self.run.bound_ms
        return bound_ms is not None and self.best_ms is not None and bound_ms > self.best_ms

    @property
    def proven(self) -> bool:
        """Whether the engine's plan is as short as its bound, which nothing refutes."""
        return self.run.makespan_ms is not None and self.run.bound_ms == self.run.makespan_ms and not self.refuted

    @property
    def gap(self) -> float | None:
        """Gap between makespan and the engine's own bound, as a share of the makespan."""
        bound_ms, makespan_ms = self.run.bound_ms, self.run.makespan_ms
        return None if bound_ms is None or not makespan_ms else max(0.0, 1 - bound_ms / makespan_ms)

    @property
    def behind(self) -> bool:
        """Whether another engine has a shorter plan within the same budget."""
        others = [run.makespan_ms for run in self.round.runs if run.budget_s == self.run.budget_s]
        shortest = min((ms for ms in others if ms is not None), default=None)
        return shortest is not None and (self.run.makespan_ms is None or self.run.makespan_ms > shortest)

    @property
    def over_s(self) -> float:
        """Seconds that the engine ran beyond its budget."""
        return max(0.0, self.run.wall_s - self.run.budget_s)

    @property
    def outcome(self) -> str:
        """How the engine ended, with the faults of its result."""
        run = self.run
        words = "stopped" if run.finished is None else str(run.finished.outcome)
        if self.refuted:
            words += ", REFUTED"
        if run.refused:
            words += f", {run.refused} INVALID"
        if run.plan is None and run.served:
            words += f", {run.served}/{self.round.instance.targets} targets"
        if run.plan is None and run.late:
            words += f", {run.late} late"
        if run.finished is not None and run.finished.outcome is Outcome.CRASHED:
            words += f": {run.finished.detail}"
        return words

    def values(self) -> dict[str, Any]:
        """Return the row as a flat mapping for JSON; times in s, makespans in ms."""
        instance, run = self.round.instance, self.run
        return {
            "suite": VERSION,
            "instance": instance.name,
            "family": instance.family,
            "team": instance.team,
            "targets": instance.targets,
            "engine": run.engine,
            "budget_s": run.budget_s,
            "solved": run.plan is not None,
            "outcome": None if run.finished is None else str(run.finished.outcome),
            "detail": "" if run.finished is None else run.finished.detail,
            "makespan_ms": run.makespan_ms,
            "best_ms": self.best_ms,
            "ratio": self.ratio,
            "first_s": self.first_s,
            "close_s": self.close_s,
            "proven": self.proven,
            "refuted": self.refuted,
            "lower_bound_ms": run.bound_ms,
            "gap": self.gap,
            "behind": self.behind,
            "wall_s": run.wall_s,
            "over_s": self.over_s,
            "plans": len(run.arrivals),
            "refused": run.refused,
            "late": run.late,
            "served": run.served,
            "improvements": [[arrival.elapsed_s, arrival.makespan_ms] for arrival in run.arrivals],
        }


def rows_of(rounds: Iterable[Round]) -> tuple[RunRow, ...]:
    """Return the rows of all rounds, each round sorted by engine and budget."""
    return tuple(
        RunRow(one, run) for one in rounds for run in sorted(one.runs, key=lambda run: (run.engine, run.budget_s))
    )


def table(rows: Sequence[RunRow], absent: Sequence[BenchEngine]) -> str:
    """Return rows by instance, a summary, and the engines that are missing, as text."""
    budgets = sorted({row.run.budget_s for row in rows})
    lines = [
        f"planner suite version {VERSION}; a plan counts that comes by its deadline",
        f"({', '.join(f'{budget:g} s: {deadline_s(budget):.3g}' for budget in budgets)})",
    ]
    for _, group in groupby(rows, key=lambda row: row.round.instance.name):
        lines += _instance_lines(list(group))
    small = [row for row in rows if _robots(row) <= SMALL_ROBOTS]
    big = [row for row in rows if _robots(row) > SMALL_ROBOTS]
    for words, some in ((f"up to {SMALL_ROBOTS} robots", small), (f"more than {SMALL_ROBOTS} robots", big)):
        if some:
            lines += ["", f"summary, {words}: {len({row.round.instance.name for row in some})} instances"]
            lines += _summary(some)
    lines += [f"{contender.name}: not available, {contender.missing}" for contender in absent]
    return "\n".join(lines)


def progress_line(run: EngineRun) -> str:
    what = "no plan" if run.makespan_ms is None else f"{run.makespan_ms / 1000:.3f} s"
    return f"{run.instance}: {run.engine}, {run.budget_s:g} s: {what}"


def _robots(row: RunRow) -> int:
    carriers, rovers = map(int, row.round.instance.team.split("x"))
    return carriers * (1 + rovers)


def _instance_lines(rows: Sequence[RunRow]) -> Iterator[str]:
    instance, best = rows[0].round.instance, rows[0].round.best
    known = "no plan known"
    if best is not None:
        known = f"best known {best.makespan_ms / 1000:.3f} s ({best.found_by})"
        known += f", optimal ({best.bound_by})" if best.optimal else f", at least {best.lower_bound_ms / 1000:.3f} s"
    yield ""
    yield f"{instance.name}: {instance.team}, {instance.targets} targets; {known}"
    yield (
        f"  {'engine':<10}{'budget s':>9}{'solved':>7}{'makespan s':>11}{'ratio':>7}{'first s':>8}{'1% s':>8}"
        f"{'bound s':>9}{'gap':>7}{'over s':>7}  outcome"
    )
    for row in rows:
        run = row.run
        yield (
            f"  {run.engine:<10}{run.budget_s:>9g}{'yes' if run.plan else 'no':>7}{_thousandth(run.makespan_ms):>11}"
            f"{_fixed(row.ratio):>7}{_fixed(row.first_s):>8}{_fixed(row.close_s):>8}{_thousandth(run.bound_ms):>9}"
            f"{_fixed(row.gap, '.1%'):>7}{row.over_s:>7.3f}  {row.outcome}"
        )


def _summary(rows: Sequence[RunRow]) -> Iterator[str]:
    yield (
        f"  {'engine':<10}{'budget s':>9}{'solved':>7}{'mean ratio':>11}{'max ratio':>10}{'within 1%':>10}{'proven':>7}"
        f"{'behind':>7}{'latest s':>9}{'over s':>8}{'invalid':>8}"
    )

    def key(row: RunRow) -> tuple[str, float]:
        return row.run.engine, row.run.budget_s

    for (name, budget_s), group in groupby(sorted(rows, key=key), key=key):
        some = list(group)
        ratios = [row.ratio for row in some if row.ratio is not None]
        firsts = [row.first_s for row in some if row.first_s is not None]
        yield (
            f"  {name:<10}{budget_s:>9g}{_share(row.run.plan is not None for row in some):>7}"
            f"{_fixed(fmean(ratios) if ratios else None):>11}{_fixed(max(ratios, default=None)):>10}"
            f"{_share(row.close_s is not None for row in some):>10}{_share(row.proven for row in some):>7}"
            f"{sum(row.behind for row in some):>7}{_fixed(max(firsts, default=None)):>9}"
            f"{max(row.over_s for row in some):>8.3f}{sum(row.run.refused for row in some):>8}"
        )


def _share(truths: Iterable[bool]) -> str:
    return f"{fmean(truths):.0%}"


def _fixed(value: float | None, form: str = ".3f") -> str:
    return "-" if value is None else format(value, form)


def _thousandth(value_ms: int | None) -> str:
    return "-" if value_ms is None else f"{value_ms / 1000:.3f}"

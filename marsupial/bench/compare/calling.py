"""`marsupial.compare`: the missions of ``marsupial compare``, called from Python, and their result in memory.

Named strategies run in worker processes. Strategies that are objects run in the caller's process, one mission after the
other, as no other process may know their code; each mission gets a copy.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from marsupial.bench.compare.answer import answer_drawing, sentence
from marsupial.bench.compare.arguments import cases_of, contenders
from marsupial.bench.compare.cells import MEASURES, ComparisonOutcome
from marsupial.bench.compare.conduct import LocalPool, check_teams, compile_first
from marsupial.bench.compare.plan import Comparison, Contender, OwnStrategy, Trial, header_of
from marsupial.bench.compare.rows import KEY, ROWS, MissionRow, Result
from marsupial.bench.compare.tables import GAINS, NOTHING, ReportTable, gain_cell, mean_text
from marsupial.bench.compare.texts import latex, plain
from marsupial.bench.compare.trial import carry_out
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.exports.style import plain_style
from marsupial.library.arguments import strategy_argument
from marsupial.library.choices import budget_of
from marsupial.library.scenarios import Source
from marsupial.model import Budget, Decider, Scenario
from marsupial.model.arguments import refuse, whole
from marsupial.model.bounds import BOUNDS, COMPARE_RUNS, COMPARE_STEPS, Bound
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.files import StrategyFile
from marsupial.strategies.registry import is_strategy
from marsupial.wording import counted, unknown_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RUNS = Bound(1, 100_000)
_MEASURES = {measure.key: measure for measure in MEASURES}


class ComparisonResult:
    """The missions of a comparison. Printed, it says who explores in less time, with a table.

    `rows` has a dict for each mission, with the columns of ``rows.csv``: scenario, strategy, planner, carriers, rovers,
    seed, status, reason, and the metrics, None for those that a mission lacks (times in s, distances in m).
    """

    def __init__(self, outcome: ComparisonOutcome) -> None:
        self._outcome = outcome
        self.rows: tuple[dict[str, Any], ...] = tuple(map(_values, outcome.rows))

    def frame(self) -> Any:
        """Return the rows as a DataFrame of pandas, which must be installed; else raise `EngineUnavailable`."""
        try:
            pandas = import_module("pandas")
        except ImportError as error:
            raise EngineUnavailable("frame needs pandas: pip install pandas; `rows` has the same as dicts") from error
        return pandas.DataFrame(list(self.rows))

    def table(self, metric: str = "exploration_time_s") -> str:
        """Return a table as text: the mean of each strategy on each scenario and team, and gains over the last one.

        Parameters
        ----------
        metric
            ``exploration_time_s``, ``mission_time_s``, ``distance_m``, ``energy_j`` or ``quality``.

        Raises
        ------
        UsageError
            If it is another one.
        """
        return plain(self._measured(metric))

    def latex(self, metric: str = "exploration_time_s") -> str:
        """Return the same table as a ``tabular`` of LaTeX, with the rules of the package booktabs."""
        return latex(self._measured(metric))

    def plot(self) -> Figure:
        """Return a figure of matplotlib: in how much less time each explores, by pairs of missions and in the mean.

        Raise a `UsageError` if no two strategies completed the same mission.
        """
        with plain_style():
            drawing = answer_drawing(self._outcome)
        if drawing is None:
            raise UsageError("there is nothing to plot: no two strategies completed the same mission")
        return drawing

    def __repr__(self) -> str:
        failed = self._outcome.incomplete()
        lines = [sentence(self._outcome), "", self.table()]
        if failed:
            lines += ["", f"{counted(len(failed), 'mission')} not complete, the first: {failed[0].trial}: "]
            lines[-1] += f"{failed[0].status}: {failed[0].reason}"
        return "\n".join(lines)

    def _measured(self, metric: str) -> ReportTable:
        if metric not in _MEASURES:
            raise UsageError(unknown_name("metric", str(metric), _MEASURES))
        outcome, measure = self._outcome, _MEASURES[metric]
        (one, other), what = outcome.all_sides, "less" if measure.better < 0 else "more"
        gains = [f"{what} with {one}, %"] if outcome.rivals else []
        table = ReportTable(
            title=measure.heading,
            caption=f"{measure.heading}, mean ± half of the 95 % interval, and how much {what} it is with {one} than "
            f"with {other}. {GAINS} Teams are carriers x rovers of each.",
            heads=("scenario", "team", "strategy", f"{measure.heading}, {measure.unit}", *gains),
        )
        for case in outcome.cases:
            for contender in outcome.contenders:
                mean = mean_text(outcome.estimate(case, contender, measure), measure.digits, outcome.missions_of(case))
                is_base = contender == outcome.base
                gain = NOTHING if is_base else gain_cell(outcome.shown(case, contender, measure))
                table.add(case.scenario, case.team, str(contender), mean, *([gain] if gains else []))
        return table


def compare(
    scenarios: Source | Iterable[Source],
    strategies: Iterable[str | Decider],
    planner: str | None = None,
    carriers: int | Sequence[int] | None = None,
    rovers: int | Sequence[int] | None = None,
    runs: int = COMPARE_RUNS,
    budget: float | None = None,
    steps: int | None = None,
    workers: int | None = None,
    *,
    resolution_m: float | None = None,
    progress: Callable[[str], object] | None = None,
) -> ComparisonResult:
    """Run every strategy on the same missions, as ``marsupial compare`` does, and return their rows.

    Parameters
    ----------
    scenarios
        One or several scenarios: objects, or what `marsupial.scenario` takes, arrays too.
    strategies
        Names, ``NAME:PLANNER``, ``FILE.py:CLASS``, or objects (see `marsupial.Strategy`); the others are compared with
        the last one. Objects run in this process, one mission after the other, each with a deep copy.
    planner
        Planner of strategies that are named without one; ``auto`` if None.
    carriers, rovers
        A number of carriers, and of rovers per carrier, or several; None keeps the scenarios' teams.
    runs
        Missions for each scenario, team and strategy, with seeds 1, 2, ...
    budget, steps
        Wall-clock seconds, or counted steps, per planning call; 8 steps if neither is given. With steps the rows are
        the same on any machine.
    workers
        Processes; None for one per core. 0 runs all missions in this process.
    resolution_m
        Edge of a cell in metres, of scenarios that are arrays, images or MovingAI maps.
    progress
        Called with a line of text after each mission, as ``print`` may be.

    Returns
    -------
    ComparisonResult
        With `rows`, `frame()`, `table()`, `latex()` and `plot()`. A mission in which a strategy raises an exception is
        a row of status ``error``.

    Raises
    ------
    ScenarioError, MapError
        If there is no such scenario, or a strategy can't lead its team.
    EngineUnavailable, UsageError
        If an argument can't be used; the error names it.

    Examples
    --------
    ::

        result = marsupial.compare(["office", "maze"], [MyStrategy(), "temporal"], runs=5)
        print(result)
        result.plot().savefig("compared.pdf")
    """
    limit = budget_of(budget, COMPARE_STEPS if budget is None and steps is None else steps)
    found = _contenders(strategies, planner, limit)
    several = [scenarios] if isinstance(scenarios, str | PathLike | Scenario | np.ndarray) else scenarios
    if not isinstance(several, Iterable):
        refuse("scenarios", "a list of scenarios", scenarios)
    teams = _numbers("carriers", carriers), _numbers("rovers", rovers)
    comparison = Comparison(
        contenders=tuple(found),
        scenarios=cases_of(several, *teams, lambda text: warnings.warn(text, stacklevel=4), resolution_m),
        runs=whole("runs", runs, _RUNS),
        budget=limit,
        own={one.strategy: strategy for one, strategy in found.items() if not isinstance(strategy, str)},
    )
    if not comparison.scenarios:
        raise UsageError("scenarios: needs at least one")
    check_teams(comparison)
    compile_first(comparison, lambda text: None)
    trials = tuple(comparison.trials())
    size = None if workers is None else whole("workers", workers, Bound(0, 1024))
    results: dict[Trial, Result] = {}
    with closing(_results(comparison, trials, size)) as coming:
        for result in coming:
            results[result.row.trial] = result
            if progress is not None:
                progress(f"{len(results)} of {len(trials)}: {result.row.trial}: {result.row.status}")
    ordered = [results[trial] for trial in trials]
    return ComparisonResult(
        ComparisonOutcome(
            header_of(comparison),
            tuple(one.row for one in ordered),
            tuple(one.timing for one in ordered if one.timing is not None),
            tuple(one.curve for one in ordered if one.curve is not None),
        )
    )


def _contenders(
    strategies: Iterable[str | Decider], planner: str | None, budget: Budget
) -> dict[Contender, str | OwnStrategy]:
    if isinstance(strategies, str) or not isinstance(strategies, Iterable):
        refuse("strategies", "a list of names and strategies", strategies)
    found: dict[Contender, str | OwnStrategy] = {}
    for number, one in enumerate(strategies):
        if isinstance(one, str):
            added: dict[Contender, str | OwnStrategy] = dict(contenders([one], planner, budget))
        else:
            own = strategy_argument(one)
            assert not isinstance(own, str)
            if is_strategy(own.name) or own.name == CLAIRVOYANT:
                raise UsageError(f"strategies[{number}]: {own.name!r} is the name of a strategy that marsupial knows")
            added = {Contender(own.name): own}
        if twice := found.keys() & added:
            raise UsageError(f"strategies[{number}]: {twice.pop()} is named twice")
        found |= added
    if not found:
        raise UsageError("strategies: needs at least one")
    return found


def _numbers(name: str, value: int | Sequence[int] | None) -> tuple[int, ...] | None:
    bound = BOUNDS["rovers_per_carrier" if name == "rovers" else name]
    if value is None:
        return None
    several = value if isinstance(value, Iterable) and not isinstance(value, str) else (value,)
    return tuple(sorted({whole(name, one, bound) for one in several}))


def _results(comparison: Comparison, trials: Sequence[Trial], workers: int | None) -> Generator[Result]:
    own = {one for one in comparison.contenders if not isinstance(comparison.strategy(one), str | StrategyFile)}
    there = [one for one in trials if workers != 0 and one.contender not in own]
    if there:
        yield from LocalPool(comparison, workers).results(there)
    for trial in (one for one in trials if workers == 0 or one.contender in own):
        yield carry_out(trial, comparison.scenarios[trial.case], comparison.budget, comparison.own)


def _values(row: MissionRow) -> dict[str, Any]:
    case, contender = row.trial.case, row.trial.contender
    key = (case.scenario, contender.strategy, contender.planner, case.carriers, case.rovers, row.trial.seed)
    return {**dict(zip(KEY, key, strict=True)), **{name: getattr(row, name) for name in ROWS.readers}}

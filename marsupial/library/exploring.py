"""`marsupial.explore`: run one mission, and its result."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import nullcontext
from dataclasses import dataclass, fields
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from marsupial.formats.files import writing
from marsupial.library.arguments import planner_argument, progress_argument, sensor_argument, strategy_argument
from marsupial.library.choices import DEFAULT_PLANNER, budget_of, planner_for
from marsupial.library.first_use import prepare_mission
from marsupial.library.metrics import METRICS, Summary
from marsupial.library.missions import simulate
from marsupial.library.recording import Caller, LogFile, Recorder
from marsupial.library.scenarios import scenario as named_scenario
from marsupial.mission.observer import Observers
from marsupial.mission.rebuild import moment_at
from marsupial.model import Decider, Engine, MissionEvent, Scenario, Situation
from marsupial.model.arguments import number, target, whole
from marsupial.model.bounds import BOUNDS
from marsupial.sim.sensors import Sensor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = (
    "exploration_time_s", "mission_time_s", "coverage", "distance_m", "quality", "energy_j", "deployments",
    "retrievals", "replans", "planning_s.median", "planning_s.total", "analysis_s",
)  # fmt: skip
"""The metrics that a notebook shows."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Exploration(Summary):
    """The result of a mission: its summary, and its `events` in order, as a mission log has them.

    Its attributes are the keys of ``marsupial run --json``; `marsupial.METRICS` defines each metric.
    """

    events: tuple[MissionEvent, ...] = ()

    @classmethod
    def from_summary(cls, summary: Summary, events: Iterable[MissionEvent], log: Path | None = None) -> Exploration:
        """Return the result of a mission with this summary and these events, written to a log at `log`."""
        values = {each.name: getattr(summary, each.name) for each in fields(Summary)} | {"log": log}
        return cls(**values, events=tuple(events))

    def plot(self) -> Figure:
        """Return a drawing of the mission: explored map, robots' trails, who did what when.

        It is a matplotlib figure that pyplot does not know, so it need not be closed. Notebooks show it; `savefig`
        writes it. It looks the same whatever the settings of matplotlib are, which stay as they are.
        """
        from marsupial.exports.style import plain_style

        with plain_style():
            from marsupial.exports.drawing import mission_figure

            return mission_figure(self.events)

    def save_replay(self, path: str | PathLike[str]) -> Path:
        """Write one HTML page that replays the mission and needs nothing else; return its path.

        Raise a `UsageError` if it can't be written there.
        """
        from marsupial.replay.page import replay_page

        page = target("path", path)
        with writing(page):
            page.write_text(replay_page(self.events), encoding="utf-8", newline="\n")
        return page

    def situation(self, at_s: float = 0.0) -> Situation:
        """Return the situation of planning `at_s` seconds into the mission.

        Raise a `UsageError` if the mission ended before, or `at_s` is not a valid time.
        """
        at_ms = round(1000 * number("at_s", at_s, BOUNDS["remaining_s"]))
        return moment_at(self.events, at_ms).survey().situation

    @property
    def _heading(self) -> str:
        return f"{self.scenario} by {self.strategy} ({self.planner}), seed {self.seed}: {self.status}"

    def __repr__(self) -> str:
        return f"<{', '.join([self._heading, *(f'{METRICS[k].title} {METRICS[k].shown(self)}' for k in SHOWN[:4])])}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align: left'>{metric.title}</th><td>{escape(metric.shown(self))}</td></tr>"
            for metric in map(METRICS.__getitem__, SHOWN)
        )
        return f"<table><caption>{escape(self._heading)}</caption>{rows}</table>"


def explore(
    scenario: Scenario | str | PathLike[str],
    strategy: str | Decider = "temporal",
    planner: str | Engine = DEFAULT_PLANNER,
    seed: int = 1,
    budget: float | None = None,
    steps: int | None = None,
    log: str | PathLike[str] | None = None,
    *,
    sensor: Sensor | None = None,
    progress: Callable[[MissionEvent], object] | None = None,
) -> Exploration:
    """Run a mission in the simulator, as ``marsupial run`` does, and return its result.

    If the budget is in `steps`, the same arguments give the same log, byte for byte.

    Parameters
    ----------
    scenario
        A scenario, or what `marsupial.scenario` takes.
    strategy
        The name of a strategy, or a `marsupial.Strategy` (any object with `name` and `decide` works).
    planner
        The name of an engine, ``cmd:COMMAND {domain} {problem}``, or an object with a method `solve` (see
        `marsupial.Engine`). Strategies that ask no planner ignore it, and so do objects.
    seed
        Draws the starts of the robots that have none.
    budget, steps
        Wall-clock seconds, or counted steps, per planning call; 1 s if neither is given.
    log
        Path of the mission log to write.
    sensor
        The robots' sensor; None for the exact field of view (see `marsupial.Sensor`).
    progress
        Called with each event while the mission runs; an exception from it ends the mission.

    Returns
    -------
    Exploration
        With the keys of ``marsupial run --json`` as attributes: `status`, `exploration_time_s` (s), `distance_m` (m),
        `quality`, ...; its `events`; and `plot()`, `save_replay(path)`, `situation(at_s)`.

    Raises
    ------
    ScenarioError, MapError
        If there is no such scenario, or the team can't be placed in it.
    EngineUnavailable, UsageError
        If an argument can't be used; the error names it. Exceptions of your own strategy, planner or sensor are passed
        on unchanged.

    Examples
    --------
    ::

        result = marsupial.explore("office", "temporal", seed=2, steps=8, log="office.jsonl")
        print(result.status, result.exploration_time_s)
        result.save_replay("office.html")
    """
    limit, seed = budget_of(budget, steps), whole("seed", seed, BOUNDS["seed"])
    strategy, planner, sensor = strategy_argument(strategy), planner_argument(planner), sensor_argument(sensor)
    told = [] if progress is None else [Caller(progress_argument(progress))]
    log_path = None if log is None else target("log", log)
    loaded = scenario if isinstance(scenario, Scenario) else named_scenario(scenario)
    planner = planner_for(strategy, planner)
    prepare_mission(loaded, strategy, planner)()
    # The log file is written during the mission, so that it survives an exception of the caller's own code.
    recorder = Recorder()
    with nullcontext() if log_path is None else LogFile(log_path) as file:
        watcher = Observers([recorder, *([] if file is None else [file]), *told])
        summary = simulate(
            loaded, strategy=strategy, planner=planner, budget=limit, seed=seed, observer=watcher, sensor=sensor
        )
    return Exploration.from_summary(summary, recorder.events, log_path)

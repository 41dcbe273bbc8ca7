"""Misbehaving workers of comparisons, and comparisons small enough to run many times."""

import os
import signal
from collections.abc import Generator, Iterator, Mapping, Sequence
from pathlib import Path

from marsupial.bench.compare.plan import Case, Comparison, Contender, Trial, prepared
from marsupial.bench.compare.rows import Curve, MissionRow, Result, Timing
from marsupial.bench.compare.trial import READY, Terms
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.planning import Budget
from marsupial.processes.channel import Channel

GREEDY, HEURISTIC = Contender("temporal", "greedy"), Contender("heuristic")


def lobby(runs: int = 2, carriers: Sequence[int] = (1,), contenders: Sequence[Contender] = (GREEDY, HEURISTIC)):
    return Comparison(
        scenarios={Case("lobby", n, 1): prepared(builtin_scenario("lobby", n, 1)) for n in carriers},
        contenders=tuple(contenders),
        runs=runs,
        budget=Budget(steps=1),
    )


def invented(trial: Trial, status: str = "complete") -> Result:
    """Return an invented result: the heuristic takes 10 s longer, and each seed 1 s longer."""
    time_s = 100.0 / trial.case.carriers + trial.seed + 10.0 * (trial.contender == HEURISTIC)
    if status != "complete":
        return Result(row=MissionRow(trial=trial, status=status, reason="no luck"))
    row = MissionRow(
        trial=trial,
        status=status,
        reason="done, and well",
        exploration_time_s=time_s,
        mission_time_s=time_s + 20,
        coverage=1.0,
        explored_area_m2=50.0,
        reachable_area_m2=50.0,
        distance_m=25.0,
        quality=2.0 + 0.01 * trial.seed - 0.5 * (trial.contender == HEURISTIC),
        energy_j=1000.0,
        replans=5,
        plans_invalid=0,
        plans_refused=0,
        deployments=1,
        retrievals=1,
        aboard=1,
        remaining=0,
    )
    timing = Timing(
        trial=trial,
        wall_s=1.0,
        cpu_s=0.5,
        planning_median_s=0.01,
        planning_p95_s=0.02,
        planning_max_s=0.03,
        planning_total_s=0.1,
        first_plan_s=0.001,
        analysis_s=0.2,
    )
    return Result(row=row, timing=timing, curve=Curve(trial=trial, every_s=5.0, known=(1000, 5000 + trial.seed, 10000)))


class Inventing:
    """A runner without workers that records its trials; it fails after `after` missions."""

    def __init__(self, failing: Mapping[Trial, str] | None = None, after: int | None = None) -> None:
        self.asked: list[Trial] = []
        self._failing = failing or {}
        self._after = after

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        self.asked = list(trials)
        for count, trial in enumerate(reversed(trials)):  # the order is arbitrary
            if count == self._after:
                raise KeyboardInterrupt
            yield invented(trial, self._failing.get(trial, "complete"))


def dies_of_seed_2(terms: Terms, channel: Channel) -> None:
    for trial in requested_trials(channel):
        if trial.seed == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        channel.send(invented(trial))


def dies_once(terms: Terms, channel: Channel) -> None:
    """Die in the very first mission; the scenario's name is the path of the file that marks this."""
    for trial in requested_trials(channel):
        mark = Path(next(iter(terms[0].values())).name)
        if not mark.exists():
            mark.touch()
            os._exit(3)
        channel.send(invented(trial))


def never_begins(terms: Terms, channel: Channel) -> None:
    os._exit(7)


def never_ends(terms: Terms, channel: Channel) -> None:
    for trial in requested_trials(channel):
        if trial.seed > 1:
            signal.pause()
        channel.send(invented(trial))


def requested_trials(channel: Channel) -> Iterator[Trial]:
    channel.send(READY)
    while isinstance(trial := channel.receive(), Trial):
        yield trial

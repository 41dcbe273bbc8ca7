"""Run one mission of a comparison and return its records, in a worker of the local pool or a task of Ray."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict
from time import process_time
from types import MappingProxyType

import numpy as np

from marsupial.arrays import Flags
from marsupial.bench.compare.plan import Case, OwnStrategy, Trial
from marsupial.bench.compare.rows import COVERAGE_SCALE, ERROR, Curve, MissionRow, Result, Timing, metrics_of
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.mission.observer import Observer
from marsupial.model import Budget, Mask, MissionEnded, MissionEvent, Revealed, Scenario
from marsupial.model.runs import triples
from marsupial.processes.channel import Channel

EVERY_MS = 5_000  # simulated time between two samples

Terms = tuple[Mapping[Case, Scenario], Budget, Mapping[str, OwnStrategy]]
"""The argument of a worker."""

READY = None  # the first message of a worker


def serve(terms: Terms, channel: Channel) -> None:
    """Receive trials and send their results until there are no more; the function of a worker's job."""
    # All trials share the imports, the compiled code and the scenarios.
    scenarios, budget, own = terms
    channel.send(READY)
    while isinstance(trial := channel.receive(), Trial):
        channel.send(carry_out(trial, scenarios[trial.case], budget, own))


def simulated(
    trial: Trial, scenario: Scenario, budget: Budget, observer: Observer, own: Mapping[str, OwnStrategy]
) -> Summary:
    planner = trial.contender.planner
    # what an object remembers of a mission is not for the next one
    strategy = deepcopy(own.get(trial.contender.strategy, trial.contender.strategy))
    return simulate(scenario, strategy=strategy, planner=planner, budget=budget, seed=trial.seed, observer=observer)


def carry_out(
    trial: Trial, scenario: Scenario, budget: Budget, own: Mapping[str, OwnStrategy] = MappingProxyType({})
) -> Result:
    """Run a mission and return its result; an exception becomes a row of status `ERROR`."""
    began = process_time()
    try:
        sampler = CoverageSampler()
        summary = simulated(trial, scenario, budget, sampler, own)
    except Exception as error:
        return Result(row=MissionRow(trial=trial, status=ERROR, reason=f"{type(error).__name__}: {error}"))
    metrics = metrics_of(MissionRow, summary)
    if summary.interference is not None:
        metrics |= asdict(summary.interference)
    return Result(
        row=MissionRow(trial=trial, status=str(summary.status), reason=summary.reason, **metrics),
        timing=Timing(trial=trial, cpu_s=round(process_time() - began, 4), **metrics_of(Timing, summary)),
        curve=Curve(trial=trial, every_s=EVERY_MS / 1000, known=tuple(sampler.known)),
    )


class CoverageSampler(Observer):
    """Samples coverage, in parts of `COVERAGE_SCALE`, every `EVERY_MS` of simulated time and at the mission's end."""

    def __init__(self) -> None:
        self.known: list[int] = []
        self._left: Flags = np.zeros(0, dtype=np.bool_)  # the explorable cells that are unknown, row-major
        self._area = 0

    def reachable(self, area: Mask) -> None:
        self._left, self._area = area.ravel().copy(), int(np.count_nonzero(area))

    def event(self, event: MissionEvent) -> None:
        while len(self.known) * EVERY_MS < event.t_ms:
            self._note()
        if isinstance(event, Revealed):
            for start, length, _ in triples(event.runs):
                self._left[start : start + length] = False
        elif isinstance(event, MissionEnded):
            self._note()

    def _note(self) -> None:
        known = self._area - int(np.count_nonzero(self._left))
        self.known.append(round(COVERAGE_SCALE * known / max(1, self._area)))

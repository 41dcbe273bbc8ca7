"""The state that all routes share: settings, keys, jobs, missions, metrics."""

import asyncio
import math
from collections import Counter
from dataclasses import dataclass, field

from starlette.applications import Starlette

from marsupial.processes.jobs import JobLimits
from marsupial_service.entries.slots import Slots
from marsupial_service.intake.supervised import RequestProcesses, SupervisedProcesses
from marsupial_service.jobs.service import Jobs
from marsupial_service.keys import Keys
from marsupial_service.missions.service import Missions
from marsupial_service.operations.metrics import HttpMetrics
from marsupial_service.schemas.answers import ReadyAnswer
from marsupial_service.settings import ServiceSettings
from marsupial_service.store import Store


@dataclass(slots=True)
class Readiness:
    """The last check whether the service can plan: its result or its error."""

    found: ReadyAnswer | str = "not checked yet"
    checked_s: float = -math.inf
    checking: asyncio.Task[None] | None = None


@dataclass(slots=True, kw_only=True)
class State:
    """The service while it runs: its `jobs` and `missions` once it has started, open event `streams` by owner.

    `analyses` and `readers` run the processes of requests (`supervised`). `held_bytes` are those of bodies being
    received and read.
    """

    settings: ServiceSettings
    keys: Keys
    supervised: SupervisedProcesses = field(default_factory=SupervisedProcesses)
    analyses: RequestProcesses = field(init=False)
    readers: RequestProcesses = field(init=False)
    held_bytes: int = 0
    metrics: HttpMetrics = field(default_factory=HttpMetrics)
    store: Store | None = None
    jobs: Jobs = field(init=False)
    missions: Missions = field(init=False)
    started: bool = False
    streams: Counter[str] = field(default_factory=Counter)
    readiness: Readiness = field(default_factory=Readiness)

    def __post_init__(self) -> None:
        limits = self.settings.limits
        self.analyses = self._processes(limits.analyses, limits.analysis_s, limits.memory_bytes)
        self.readers = self._processes(limits.readers, limits.read_s, limits.read_memory_bytes)

    def _processes(self, count: int, seconds: float, memory_bytes: int) -> RequestProcesses:
        return RequestProcesses(
            supervised=self.supervised,
            # no key has all of them, so that the next key never waits for its requests; without keys there is one owner
            slots=Slots(count, max(1, count - 1) if self.settings.needs_keys else None),
            limits=JobLimits(wall_s=seconds, memory_bytes=memory_bytes),
            check_quota=lambda owner: self.jobs.check_quota(owner),
            charge=lambda owner, used_s: self.jobs.charge(owner, used_s),
        )

    def begin_shutdown(self) -> None:
        """End streams and processes of requests, as the service is shutting down."""
        self.supervised.begin_shutdown()
        if self.started:
            self.jobs.begin_shutdown()
            self.missions.begin_shutdown()


def state_of(app: Starlette) -> State:
    """Return the state of an application made by `marsupial_service.app`."""
    state: State = app.state.service
    return state

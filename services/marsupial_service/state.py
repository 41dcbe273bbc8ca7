"""What all routes share: settings, keys, jobs, missions, metrics."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from dataclasses import dataclass, field

from starlette.applications import Starlette

from marsupial.processes.runner import LOCAL, Runner
from marsupial_service.analyses.supervised import Supervised
from marsupial_service.entries.slots import Slots
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.service import Missions
from marsupial_service.operations.keys import Keys
from marsupial_service.operations.metrics import HttpMetrics
from marsupial_service.operations.settings import ServiceSettings
from marsupial_service.schemas.answers import ReadyAnswer
from marsupial_service.store import Store


@dataclass(slots=True)
class Readiness:
    """The last check whether the service can plan: what was found, or what was wrong."""

    found: ReadyAnswer | str = "it has not been checked yet"
    checked_s: float = -math.inf
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)


@dataclass(slots=True, kw_only=True)
class State:
    """The service while it runs.

    Parameters
    ----------
    store
        The one to be used, if it is open already.
    runner
        Runs the processes of jobs and missions.
    jobs, missions
        None until the service has started.
    streams
        Open event streams by owner.
    analyses, readers
        Slots for analyses, and for processes that read large bodies.
    held_bytes
        Of bodies that are being received and read.
    """

    settings: ServiceSettings
    keys: Keys
    analyses: Slots
    readers: Slots
    supervised: Supervised = field(default_factory=Supervised)
    held_bytes: int = 0
    metrics: HttpMetrics = field(default_factory=HttpMetrics)
    store: Store | None = None
    runner: Runner = LOCAL
    jobs: Jobs | None = None
    missions: Missions | None = None
    streams: Counter[str] = field(default_factory=Counter)
    readiness: Readiness = field(default_factory=Readiness)

    def leave(self) -> None:
        """End streams, as the service is asked to end."""
        self.supervised.leave()
        for entries in (self.jobs, self.missions):
            if entries is not None:
                entries.leave()

    def running(self) -> Jobs:
        """Return the jobs of a service that has started."""
        assert self.jobs is not None
        return self.jobs

    def flying(self) -> Missions:
        """Return the missions of a service that has started."""
        assert self.missions is not None
        return self.missions


def state_of(app: Starlette) -> State:
    """Return the state of an application made by `marsupial_service.app`."""
    state: State = app.state.service
    return state

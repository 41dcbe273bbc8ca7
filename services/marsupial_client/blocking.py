"""The client that blocks: the same, method by method, for code without async. Threads may share one."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Generator, Mapping, Sequence
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx2

from marsupial_client.conversation import Missed
from marsupial_client.core import AsyncJob, AsyncMission, Service, uses_environment
from marsupial_client.documents import (
    ActionsPlan,
    Analysis,
    JobDocument,
    JobRequest,
    PlanFound,
    Ready,
    TextPlan,
    Verdict,
)
from marsupial_client.events import JobEvent, MissionEvent
from marsupial_client.mission_documents import Brief, KnownMap, MissionDocument, News, Taken
from marsupial_client.transports import Blocking, finish

T = TypeVar("T")


class Job:
    """A planning job; see `AsyncJob`."""

    def __init__(self, job: AsyncJob) -> None:
        self._job = job

    @property
    def id(self) -> str:
        """Its id, by which `Client.job` finds it again."""
        return self._job.id

    @property
    def document(self) -> JobDocument:
        """The job as it was when it was last asked for."""
        return self._job.document

    def refresh(self) -> JobDocument:
        """Return the job as it is now, with its best plan so far."""
        return finish(self._job.refresh())

    def cancel(self) -> JobDocument:
        """End the job early; the best plan stays."""
        return finish(self._job.cancel())

    def result(self) -> JobDocument:
        """Wait for the end and return the job as it is then."""
        return finish(self._job.result())

    def plans(self) -> Generator[PlanFound, None, None]:
        """Yield every revision of the plan as it is found, each better than the one before, until the job is over."""
        return _each(self._job.plans())

    def events(self, after: int = 0) -> Generator[JobEvent, None, None]:
        """Yield the events after number `after`, each once and in order, until the job is over."""
        return _each(self._job.events(after))


class Mission:
    """A mission with robots of one's own: a loop over its events, and reports of what happens; see `AsyncMission`."""

    def __init__(self, mission: AsyncMission) -> None:
        self._mission = mission

    @property
    def id(self) -> str:
        """Its id, by which `Client.mission` finds it again."""
        return self._mission.id

    @property
    def document(self) -> MissionDocument:
        """The mission as it was when it was last asked for."""
        return self._mission.document

    @property
    def n(self) -> int:
        """Number of the last report of the team that was acknowledged."""
        return self._mission.n

    @property
    def robots(self) -> dict[str, int]:
        """The same of each robot that reports by its own count, as far as that was asked for."""
        return self._mission.robots

    def events(self, after: int = 0) -> Generator[MissionEvent, None, None]:
        """Yield the events after number `after`, each once and in order, until the mission is over."""
        return _each(self._mission.events(after))

    def report(self, news: News) -> Taken | None:
        """Number a report and send it until it is acknowledged; None if the mission takes no more, being over."""
        return finish(self._mission.report(news))

    def reports(self, batch: Sequence[News]) -> list[Taken] | None:
        """Send several reports in one request, of the team and of robots: all of them are taken, or none."""
        return finish(self._mission.reports(batch))

    def pause(self) -> MissionDocument:
        """Have all drives stopped, and nothing begun until `resume`."""
        return finish(self._mission.pause())

    def resume(self) -> MissionDocument:
        """Go on after `pause`."""
        return finish(self._mission.resume())

    def cancel(self) -> MissionDocument:
        """Have all drives stopped, and the mission ended with its stop report."""
        return finish(self._mission.cancel())

    def refresh(self) -> MissionDocument:
        """Return the mission as it is now."""
        return finish(self._mission.refresh())

    def log(self) -> str:
        """Return the mission log so far, as `marsupial replay` reads it."""
        return finish(self._mission.log())

    def known_map(self) -> KnownMap:
        """Return what is known of the map after the last report."""
        return finish(self._mission.known_map())


class Client:
    """Talks to the service at `url`; to be closed after use, or used in a block.

    Parameters are those of `AsyncClient`; `http` is an `httpx2.Client`.
    """

    def __init__(
        self,
        url: str,
        *,
        key: str | None = None,
        timeout_s: float = 60.0,
        patience_s: float = 60.0,
        missed: Missed | None = None,
        http: httpx2.Client | None = None,
    ) -> None:
        http = http or httpx2.Client(trust_env=uses_environment(url))
        self._service = Service(Blocking(http), url, key=key, timeout_s=timeout_s, patience_s=patience_s, missed=missed)

    def close(self) -> None:
        """Close all connections."""
        finish(self._service.conversation.transport.close())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def ready(self) -> Ready:
        """Wait until the service plans and stores, as long as patience lasts."""
        return finish(self._service.ready())

    def demo(self, name: str) -> JobRequest:
        """Return a ready request for a job; `/v1/demo-data` lists them."""
        return finish(self._service.demo(name))

    def submit(self, request: JobRequest, idempotency_key: str | None = None) -> Job:
        """Have a job stored. The same key and request are the same job, however often they are sent."""
        return Job(finish(self._service.submit(request, idempotency_key)))

    def job(self, id: str) -> Job:
        """Return a job that was submitted before."""
        return Job(finish(self._service.job(id)))

    def begin(self, brief: Brief, idempotency_key: str | None = None) -> Mission:
        """Have a mission stored and begun. The same key and brief are the same mission."""
        return Mission(finish(self._service.begin(brief, idempotency_key)))

    def mission(self, id: str) -> Mission:
        """Return a mission that was begun before, to be taken up after the last report the service knows of."""
        return Mission(finish(self._service.mission(id)))

    def analyse(self, map_state: Mapping[str, Any]) -> Analysis:
        """Return targets, meeting points, frontiers and the situation of a map state."""
        return finish(self._service.analyse(map_state))

    def validate(self, situation: Mapping[str, Any], plan: ActionsPlan | TextPlan) -> Verdict:
        """Return the verdict on a plan for a situation."""
        return finish(self._service.validate(situation, plan))

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Send any other request and return the JSON it is answered."""
        return finish(self._service.ask(method, path, body))


def _each(items: AsyncGenerator[T, None]) -> Generator[T, None, None]:
    """Yield what an async generator over a transport that blocks yields; what it holds is let go of at the end."""
    try:
        while True:
            try:
                yield finish(anext(items))
            except StopAsyncIteration:
                return
    finally:
        finish(items.aclose())

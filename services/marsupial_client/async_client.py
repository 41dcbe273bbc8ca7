"""The client for asyncio: jobs, missions, analyses and checks of plans."""

import uuid
from asyncio import Lock
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import aclosing
from typing import Any, Self, cast

import httpx2

from marsupial_client.async_session import AsyncSession
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
from marsupial_client.errors import Busy, Conflict, Refused
from marsupial_client.events import JOB_EVENTS, MISSION_EVENTS, JobEvent, MissionEvent
from marsupial_client.http import Missed, Service
from marsupial_client.mission_documents import Batch, Brief, KnownMap, LastReports, MissionDocument, News, Report, Taken


class AsyncJob:
    """A planning job: its `id`, for `AsyncClient.job`, and `document`, the job when it was last asked for."""

    def __init__(self, session: AsyncSession, document: JobDocument) -> None:
        self._session = session
        self.document = document
        self.id = document["id"]

    async def refresh(self) -> JobDocument:
        """Ask for the job, with its best plan so far."""
        self.document = await self._session.ask("GET", self.document["links"]["self"])
        return self.document

    async def cancel(self) -> JobDocument:
        """End the job early; the best plan stays."""
        self.document = await self._session.ask("POST", self.document["links"]["cancel"])
        return self.document

    async def result(self) -> JobDocument:
        """Wait until the job is over, and return it."""
        async with aclosing(self.events()) as events:
            async for _ in events:
                pass
        return await self.refresh()

    async def plans(self) -> AsyncGenerator[PlanFound, None]:
        """Yield each revision of the plan when it is found, each better than the one before, until the job is over."""
        async with aclosing(self.events()) as events:
            async for event in events:
                if event.type == "plan":
                    yield event.data

    def events(self, after: int = 0) -> AsyncGenerator[JobEvent, None]:
        """Yield the events after number `after`, each once and in order, until the job is over."""
        return self._session.events(self.document["links"]["events"], JOB_EVENTS, after)


class AsyncMission:
    """A mission with your own robots: a loop over its events, and reports of what happens.

    `id` is for `AsyncClient.mission`, `document` the mission when it was last asked for, `n` the number of the last
    report of the team that was acknowledged. `robots` has the same for robots that report by their own counts, once
    one of them has reported.
    """

    def __init__(self, session: AsyncSession, document: MissionDocument) -> None:
        self._session = session
        self._lock = Lock()
        self._unacknowledged: Report | Batch | None = None
        self.document = document
        self.id = document["id"]
        self.n = document["n"]
        self.robots: dict[str, int] = {}

    def events(self, after: int = 0) -> AsyncGenerator[MissionEvent, None]:
        """Yield the events after number `after`, each once and in order, until the mission is over."""
        return self._session.events(self.document["links"]["events"], MISSION_EVENTS, after)

    async def report(self, news: News) -> Taken | None:
        """Number a report and send it until it is acknowledged; tasks and threads take turns.

        If it names a `robot` it is numbered by that robot's own count; an `n` that it has already is kept. A report
        whose sending was interrupted (by a cancellation, or when patience ended) may have arrived: it is sent again
        before the next one. A refused report changes nothing, and its number is free again.

        Returns None if the mission has ended or is being cancelled, and takes no more. Raises Refused, Unreachable.
        """
        async with self._lock:
            (report,) = await self._numbered((news,))
            taken = await self._send(report)
            return None if taken is None else taken[0]

    async def reports(self, batch: Sequence[News]) -> list[Taken] | None:
        """Send several reports of the team and of robots in one request, as `report` sends one.

        All of them are taken, in their order, or none if one is refused. The service takes up to 1000 at a time.
        An empty batch only sends again what may not have arrived.
        """
        async with self._lock:
            reports = await self._numbered(batch)
            return await self._send({"reports": reports}) if reports else []

    async def pause(self) -> MissionDocument:
        """Stop all drives and begin nothing until `resume`."""
        return await self._control("pause")

    async def resume(self) -> MissionDocument:
        """Go on after `pause`."""
        return await self._control("resume")

    async def cancel(self) -> MissionDocument:
        """Stop all drives; the stop report ends the mission."""
        return await self._control("cancel")

    async def refresh(self) -> MissionDocument:
        """Ask for the mission."""
        self.document = await self._session.ask("GET", self.document["links"]["self"])
        return self.document

    async def log(self) -> str:
        """Return the mission log so far, as `marsupial replay` reads it."""
        path = self.document["links"]["log"]
        return cast(str, await self._session.ask("GET", path, read=lambda response, _: response.text))

    async def known_map(self) -> KnownMap:
        """Return the map as known after the last report."""
        return cast(KnownMap, await self._session.ask("GET", self.document["links"]["map"]))

    async def _numbered(self, batch: Sequence[News]) -> list[Report]:
        """Number reports after the last ones, which the service is asked for of robots that are new here."""
        if self._unacknowledged is not None:  # it may have arrived: its numbers are used, or it takes them now
            await self._send(self._unacknowledged)
        if any("robot" in news and news["robot"] not in self.robots for news in batch):
            last: LastReports = await self._session.ask("GET", self.document["links"]["reports"])
            self.robots = {**last["robots"], **self.robots}
        counts: dict[str | None, int] = {None: self.n}
        counts.update(self.robots)
        reports = []
        for news in batch:
            robot = news.get("robot")
            report = cast(Report, {"n": counts.get(robot, 0) + 1, **news})
            counts[robot] = report["n"]
            reports.append(report)
        return reports

    async def _send(self, sent: Report | Batch) -> list[Taken] | None:
        self._unacknowledged = sent
        try:
            answer: Any = await self._session.ask("POST", self.document["links"]["reports"], sent)
        except Busy:
            raise  # patience has ended, but it may have been taken
        except Refused as error:
            self._unacknowledged = None
            if isinstance(error, Conflict) and (await self.refresh())["state"] in ("cancelling", "ended"):
                return None
            raise  # changed nothing, so its number goes to the next one
        self._unacknowledged = None
        taken: list[Taken] = answer["reports"] if "reports" in sent else [answer]
        for one in taken:
            if "robot" in one:
                self.robots[one["robot"]] = one["n"]
            else:
                self.n = one["n"]
        return taken

    async def _control(self, action: str) -> MissionDocument:
        self.document = await self._session.ask("POST", f"{self.document['links']['self']}/{action}")
        return self.document


class AsyncClient:
    """A client of the service at `url` (``http://127.0.0.1:8080``); use it in a block, or close it.

    `key` is the API key, if the service needs one. The client waits `timeout_s` for a connection and for each part of
    an answer. It tries again for `patience_s` (`math.inf`: for ever) from when the service is first missed, and an
    answer may take as long to arrive whole. `missed` is called with `Unreachable` or `Busy` when the service has been
    missed for 1.5 s; attempts go on. `http` is an HTTP client with certificates, proxies or hooks of your own; it is
    closed with this one. Raises ValueError if `url` is no address.
    """

    def __init__(
        self,
        url: str,
        *,
        key: str | None = None,
        timeout_s: float = 60.0,
        patience_s: float = 60.0,
        missed: Missed | None = None,
        http: httpx2.AsyncClient | None = None,
    ) -> None:
        self._session = AsyncSession(Service(url, key, timeout_s, patience_s, missed), http)

    async def close(self) -> None:
        """Close all connections."""
        await self._session.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def ready(self) -> Ready:
        """Wait until the service can plan and store. Raises Unreachable or Busy when patience ends."""
        return cast(Ready, await self._session.ask("GET", "/readyz"))

    async def demo(self, name: str) -> JobRequest:
        """Return a ready request for a job; `/v1/demo-data` lists them."""
        return cast(JobRequest, await self._session.ask("GET", f"/v1/demo-data/{name}"))

    async def submit(self, request: JobRequest, idempotency_key: str | None = None) -> AsyncJob:
        """Submit a job. The same key and request are the same job, however often they are sent."""
        return AsyncJob(self._session, await self._store("/v1/jobs", request, idempotency_key))

    async def job(self, id: str) -> AsyncJob:
        """Return a job that was submitted before."""
        return AsyncJob(self._session, await self._session.ask("GET", f"/v1/jobs/{id}"))

    async def begin(self, brief: Brief, idempotency_key: str | None = None) -> AsyncMission:
        """Begin a mission. The same key and brief are the same mission."""
        return AsyncMission(self._session, await self._store("/v1/missions", brief, idempotency_key))

    async def mission(self, id: str) -> AsyncMission:
        """Return a mission that was begun before; reports go on after the last one that the service has."""
        return AsyncMission(self._session, await self._session.ask("GET", f"/v1/missions/{id}"))

    async def analyse(self, map_state: Mapping[str, Any]) -> Analysis:
        """Return targets, meeting points, frontiers and the situation of a map state."""
        return cast(Analysis, await self._session.ask("POST", "/v1/analysis", {"map_state": map_state}))

    async def validate(self, situation: Mapping[str, Any], plan: ActionsPlan | TextPlan) -> Verdict:
        """Return the verdict on a plan for a situation."""
        body = {"situation": situation, "plan": plan}
        return cast(Verdict, await self._session.ask("POST", "/v1/validations", body))

    async def ask(self, method: str, path: str, body: object = None) -> Any:
        """Send any other request and return the JSON of the answer."""
        return await self._session.ask(method, path, body)

    async def _store(self, path: str, body: object, key: str | None) -> Any:
        return await self._session.ask("POST", path, body, {"Idempotency-Key": key or uuid.uuid4().hex})

"""What the client can do, written once: `AsyncClient` is made of it, and `Client` runs it without waiting."""

from __future__ import annotations

import uuid
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import aclosing
from typing import Any, cast

import httpx2

from marsupial_client.conversation import Conversation, Missed
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
from marsupial_client.errors import Busy, ClientError, Conflict, Refused
from marsupial_client.events import JOB_EVENTS, MISSION_EVENTS, Event, JobEvent, MissionEvent, Readers
from marsupial_client.mission_documents import (
    Batch,
    Brief,
    KnownMap,
    LastReports,
    MissionDocument,
    News,
    Report,
    Taken,
)
from marsupial_client.transports import Transport


class AsyncJob:
    """A planning job.

    Attributes
    ----------
    document
        The job as it was when it was last asked for.
    """

    def __init__(self, conversation: Conversation, document: JobDocument) -> None:
        self._conversation = conversation
        self.document = document

    @property
    def id(self) -> str:
        """Its id, by which `job` of a client finds it again."""
        return self.document["id"]

    async def refresh(self) -> JobDocument:
        """Return the job as it is now, with its best plan so far."""
        self.document = await self._conversation.document("GET", self.document["links"]["self"])
        return self.document

    async def cancel(self) -> JobDocument:
        """End the job early; the best plan stays."""
        self.document = await self._conversation.document("POST", self.document["links"]["cancel"])
        return self.document

    async def result(self) -> JobDocument:
        """Wait for the end and return the job as it is then."""
        async with aclosing(self.events()) as events:
            async for _ in events:
                pass
        return await self.refresh()

    async def plans(self) -> AsyncGenerator[PlanFound, None]:
        """Yield every revision of the plan as it is found, each better than the one before, until the job is over."""
        async with aclosing(self.events()) as events:
            async for event in events:
                if event.type == "plan":
                    yield event.data

    async def events(self, after: int = 0) -> AsyncGenerator[JobEvent, None]:
        """Yield the events after number `after`, each once and in order, until the job is over."""
        async with aclosing(_events(self._conversation, self.document["links"]["events"], JOB_EVENTS, after)) as events:
            async for event in events:
                yield cast(JobEvent, event)


class AsyncMission:
    """A mission with robots of one's own: a loop over its events, and reports of what happens.

    Attributes
    ----------
    document
        The mission as it was when it was last asked for.
    n
        Number of the last report of the team that was acknowledged.
    robots
        The same of each robot that reports by its own count, as far as that was asked for.
    """

    def __init__(self, conversation: Conversation, document: MissionDocument) -> None:
        self._conversation = conversation
        self._lock = conversation.transport.lock()
        self._unacknowledged: Report | Batch | None = None
        self.document = document
        self.n = document["n"]
        self.robots: dict[str, int] = {}

    @property
    def id(self) -> str:
        """Its id, by which `mission` of a client finds it again."""
        return self.document["id"]

    async def events(self, after: int = 0) -> AsyncGenerator[MissionEvent, None]:
        """Yield the events after number `after`, each once and in order, until the mission is over."""
        links = self.document["links"]
        async with aclosing(_events(self._conversation, links["events"], MISSION_EVENTS, after)) as events:
            async for event in events:
                yield cast(MissionEvent, event)

    async def report(self, news: News) -> Taken | None:
        """Number a report and send it until it is acknowledged; reports of several tasks or threads queue.

        A report whose sending was broken off (by a cancellation, or when patience ended) may have arrived: it is sent
        again before the next one. One that is refused changes nothing, and its number is free again.

        Parameters
        ----------
        news
            With a `robot` it is numbered by that robot's own count. May have an `n` of its own, which is sent as it is.

        Returns
        -------
        Taken or None
            None if the mission is over, or about to be, and takes no more.

        Raises
        ------
        Refused, Unreachable
        """
        async with self._lock:
            await self._send_again()
            (report,) = await self._numbered((news,))
            taken = await self._send(report)
            return None if taken is None else taken[0]

    async def reports(self, batch: Sequence[News]) -> list[Taken] | None:
        """Send several reports, of the team and of robots, in one request, as `report` sends one.

        All of them are taken, in their order, or, if one is refused, none. The service takes up to 1000 at a time.
        Without any, only what may not have arrived is sent again.
        """
        async with self._lock:
            await self._send_again()
            reports = await self._numbered(batch)
            return await self._send({"reports": reports}) if reports else []

    async def pause(self) -> MissionDocument:
        """Have all drives stopped, and nothing begun until `resume`."""
        return await self._wish("pause")

    async def resume(self) -> MissionDocument:
        """Go on after `pause`."""
        return await self._wish("resume")

    async def cancel(self) -> MissionDocument:
        """Have all drives stopped, and the mission ended with its stop report."""
        return await self._wish("cancel")

    async def refresh(self) -> MissionDocument:
        """Return the mission as it is now."""
        self.document = await self._conversation.document("GET", self.document["links"]["self"])
        return self.document

    async def log(self) -> str:
        """Return the mission log so far, as `marsupial replay` reads it."""
        return (await self._conversation.ask("GET", self.document["links"]["log"])).text

    async def known_map(self) -> KnownMap:
        """Return what is known of the map after the last report."""
        return cast(KnownMap, await self._conversation.document("GET", self.document["links"]["map"]))

    async def _numbered(self, batch: Sequence[News]) -> list[Report]:
        """Return reports that go on from the last ones; those of robots that nobody has counted here are asked for."""
        if any("robot" in news and news["robot"] not in self.robots for news in batch):
            last: LastReports = await self._conversation.document("GET", self.document["links"]["reports"])
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

    async def _send_again(self) -> None:
        """Send again what may have arrived, or not."""
        if self._unacknowledged is not None:
            await self._send(self._unacknowledged)

    async def _send(self, sent: Report | Batch) -> list[Taken] | None:
        self._unacknowledged = sent
        try:
            told: Any = await self._conversation.document("POST", self.document["links"]["reports"], sent)
        except Busy:
            raise
        except Refused as error:
            self._unacknowledged = None
            if isinstance(error, Conflict) and (await self.refresh())["state"] in ("cancelling", "ended"):
                return None
            raise
        self._unacknowledged = None
        taken: list[Taken] = told["reports"] if "reports" in sent else [told]
        for one in taken:
            if "robot" in one:
                self.robots[one["robot"]] = one["n"]
            else:
                self.n = one["n"]
        return taken

    async def _wish(self, word: str) -> MissionDocument:
        self.document = await self._conversation.document("POST", f"{self.document['links']['self']}/{word}")
        return self.document


class Service:
    """What can be asked of the service at `url`.

    Raises ValueError if that is no address.
    """

    def __init__(
        self,
        transport: Transport,
        url: str,
        *,
        key: str | None,
        timeout_s: float,
        patience_s: float,
        missed: Missed | None = None,
    ) -> None:
        self.conversation = Conversation(
            transport, address(url), key=key, timeout_s=timeout_s, patience_s=patience_s, missed=missed
        )

    async def ready(self) -> Ready:
        """Wait until the service plans and stores, as long as patience lasts."""
        return cast(Ready, await self.conversation.document("GET", "/readyz"))

    async def demo(self, name: str) -> JobRequest:
        """Return a ready request for a job; `/v1/demo-data` lists them."""
        return cast(JobRequest, await self.conversation.document("GET", f"/v1/demo-data/{name}"))

    async def submit(self, request: JobRequest, idempotency_key: str | None = None) -> AsyncJob:
        """Have a job stored. The same key and request are the same job, however often they are sent."""
        return AsyncJob(self.conversation, await self._store("/v1/jobs", request, idempotency_key))

    async def job(self, id: str) -> AsyncJob:
        """Return a job that was submitted before."""
        return AsyncJob(self.conversation, await self.conversation.document("GET", f"/v1/jobs/{id}"))

    async def begin(self, brief: Brief, idempotency_key: str | None = None) -> AsyncMission:
        """Have a mission stored and begun. The same key and brief are the same mission."""
        return AsyncMission(self.conversation, await self._store("/v1/missions", brief, idempotency_key))

    async def mission(self, id: str) -> AsyncMission:
        """Return a mission that was begun before, to be taken up after the last report the service knows of."""
        return AsyncMission(self.conversation, await self.conversation.document("GET", f"/v1/missions/{id}"))

    async def analyse(self, map_state: Mapping[str, Any]) -> Analysis:
        """Return targets, meeting points, frontiers and the situation of a map state."""
        return cast(Analysis, await self.conversation.document("POST", "/v1/analysis", {"map_state": map_state}))

    async def validate(self, situation: Mapping[str, Any], plan: ActionsPlan | TextPlan) -> Verdict:
        """Return the verdict on a plan for a situation."""
        body = {"situation": situation, "plan": plan}
        return cast(Verdict, await self.conversation.document("POST", "/v1/validations", body))

    async def ask(self, method: str, path: str, body: object = None) -> Any:
        """Send any other request and return the JSON it is answered."""
        return await self.conversation.document(method, path, body)

    async def _store(self, path: str, body: object, key: str | None) -> Any:
        return await self.conversation.document("POST", path, body, {"Idempotency-Key": key or uuid.uuid4().hex})


def address(url: str) -> httpx2.URL:
    """Read the address of a service, like ``http://host:port``; http is meant if nothing is said. Raises ValueError."""
    try:
        found = httpx2.URL(url if "://" in url else f"http://{url}")
    except httpx2.InvalidURL as error:
        raise ValueError(f"must be like http://127.0.0.1:8080, got {url!r}") from error
    if found.scheme not in ("http", "https") or not found.host:
        raise ValueError(f"must be like http://127.0.0.1:8080, got {url!r}")
    return found


def uses_environment(url: str) -> bool:
    """Say whether proxies that the environment names are used: never for this machine."""
    return address(url).host not in ("127.0.0.1", "::1", "localhost")


async def _events(
    conversation: Conversation, path: str, readers: Readers, after: int
) -> AsyncGenerator[Event[str, Any], None]:
    async with aclosing(conversation.frames(path, after)) as frames:
        async for number, frame in frames:
            read = readers.get(frame.event)
            if read is None:
                continue
            try:
                data = read(frame.data)
            except (ValueError, RecursionError) as error:
                raise ClientError(f"{path}: the data of event {number} ({frame.event}) is not JSON") from error
            yield Event(number, frame.event, data)

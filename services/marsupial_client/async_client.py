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
from marsupial_client.http import OutageCallback, Service
from marsupial_client.mission_documents import (
    Batch,
    Brief,
    KnownMap,
    LastReports,
    MissionDocument,
    News,
    Receipt,
    Report,
    Zone,
    ZoneEntry,
)


class AsyncJob:
    """A planning job: its `id`, for `AsyncClient.job`, and `document`, the job as last fetched."""

    def __init__(self, session: AsyncSession, document: JobDocument) -> None:
        self._session = session
        self.document = document
        self.id = document["id"]

    async def refresh(self) -> JobDocument:
        """Fetch the job with its best plan so far."""
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
        """Yield each revision of the plan as it is found, each better than the last, until the job is over."""
        async with aclosing(self.events()) as events:
            async for event in events:
                if event.type == "plan":
                    yield event.data

    def events(self, after: int = 0) -> AsyncGenerator[JobEvent, None]:
        """Yield the events after number `after`, each once and in order, until the job is over."""
        return self._session.events(self.document["links"]["events"], JOB_EVENTS, after)


class AsyncMission:
    """A mission with your own robots: a loop over its events, and reports of what happens.

    `id` is for `AsyncClient.mission`, `document` is the mission as last fetched, and `n` is the number of the team's
    last acknowledged report. `robots` maps each robot that numbers its own reports to its last number; it is empty
    until one of them has reported.
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

    async def report(self, news: News) -> Receipt | None:
        """Number a report and send it until it is acknowledged; tasks and threads take turns.

        A report that names a `robot` gets that robot's next number, unless it already has an `n`. If sending was
        interrupted (by a cancellation or the end of patience), the report may have arrived, so it is sent again
        before the next one. A refused report changes nothing, and its number is reused.

        Returns None if the mission has ended or is being cancelled, so accepts no more. Raises Refused, Unreachable.
        """
        async with self._lock:
            (report,) = await self._numbered((news,))
            receipts = await self._send(report)
            return None if receipts is None else receipts[0]

    async def reports(self, batch: Sequence[News]) -> list[Receipt] | None:
        """Send several reports, of the team or of robots, in one request; otherwise as `report`.

        The service accepts all of them, in order, or none if it refuses one. It accepts up to 1000 at a time.
        An empty batch only resends a report that may not have arrived.
        """
        async with self._lock:
            reports = await self._numbered(batch)
            return await self._send({"reports": reports}) if reports else []

    async def pause(self) -> MissionDocument:
        """Stop all drives and start nothing until `resume`."""
        return await self._control("pause")

    async def resume(self) -> MissionDocument:
        """Continue after `pause`."""
        return await self._control("resume")

    async def wind_down(self) -> MissionDocument:
        """End exploring: robots return as the goal says, and then the mission ends."""
        return await self._control("wind-down")

    async def zones(self) -> list[ZoneEntry]:
        """Return the zones that hold or will."""
        return await self._zones("GET", "")

    async def set_zone(self, name: str, zone: Zone) -> list[ZoneEntry]:
        """Add a zone, which holds from now on, or replace the one of that name; return all zones."""
        return await self._zones("PUT", f"/{name}", zone)

    async def remove_zone(self, name: str) -> list[ZoneEntry]:
        """Remove a zone, if there is one of that name; return those left."""
        return await self._zones("DELETE", f"/{name}")

    async def cancel(self) -> MissionDocument:
        """Stop all drives; the stop report ends the mission."""
        return await self._control("cancel")

    async def refresh(self) -> MissionDocument:
        """Fetch the mission."""
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
        """Number reports after the last ones; for robots that are new here, ask the service for the last number."""
        if self._unacknowledged is not None:  # resend it first: then its numbers are used in any case
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

    async def _send(self, sent: Report | Batch) -> list[Receipt] | None:
        self._unacknowledged = sent
        try:
            answer: Any = await self._session.ask("POST", self.document["links"]["reports"], sent)
        except Busy:
            raise  # patience has ended, but the service may have accepted it
        except Refused as error:
            self._unacknowledged = None
            if isinstance(error, Conflict) and (await self.refresh())["state"] in ("cancelling", "ended"):
                return None
            raise  # the report changed nothing, so the next one gets its number
        self._unacknowledged = None
        receipts: list[Receipt] = answer["reports"] if "reports" in sent else [answer]
        for one in receipts:
            if "robot" in one:
                self.robots[one["robot"]] = one["n"]
            else:
                self.n = one["n"]
        return receipts

    async def _zones(self, method: str, below: str, zone: Zone | None = None) -> list[ZoneEntry]:
        path = f"{self.document['links']['self']}/zones{below}"
        answer = await self._session.ask(method, path, zone, None if method == "GET" else _once())
        return cast(list[ZoneEntry], answer["zones"])

    async def _control(self, action: str) -> MissionDocument:
        self.document = await self._session.ask("POST", f"{self.document['links']['self']}/{action}", None, _once())
        return self.document


class AsyncClient:
    """A client of the service at `url` (``http://127.0.0.1:8080``); use it in a `with` block, or close it.

    `key` is the API key, if the service needs one. The client waits `timeout_s` for a connection and for each part of
    an answer. It retries for `patience_s` (`math.inf`: for ever) after the first failed attempt; a whole answer may
    take that long too. Once attempts have failed for 1.5 s, the client calls `on_outage` with `Unreachable` or `Busy`
    and keeps trying. `http` is an HTTP client with your own certificates, proxies or hooks; closing this client
    closes it too. Without it, the proxies of the environment are used, except for this machine and its local network.
    Raises ValueError if `url` is not an address, ProxyUnusable if its proxy can't be used.
    """

    def __init__(
        self,
        url: str,
        *,
        key: str | None = None,
        timeout_s: float = 60.0,
        patience_s: float = 60.0,
        on_outage: OutageCallback | None = None,
        http: httpx2.AsyncClient | None = None,
    ) -> None:
        self._session = AsyncSession(Service(url, key, timeout_s, patience_s, on_outage, http), http)

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
        """Return a ready-made job request; `/v1/demo-data` lists them."""
        return cast(JobRequest, await self._session.ask("GET", f"/v1/demo-data/{name}"))

    async def submit(self, request: JobRequest, idempotency_key: str | None = None) -> AsyncJob:
        """Submit a job. Sending the same key and request again returns the same job."""
        return AsyncJob(self._session, await self._store("/v1/jobs", request, idempotency_key))

    async def job(self, id: str) -> AsyncJob:
        """Return a job submitted earlier."""
        return AsyncJob(self._session, await self._session.ask("GET", f"/v1/jobs/{id}"))

    async def begin(self, brief: Brief, idempotency_key: str | None = None) -> AsyncMission:
        """Begin a mission. Sending the same key and brief again returns the same mission."""
        return AsyncMission(self._session, await self._store("/v1/missions", brief, idempotency_key))

    async def mission(self, id: str) -> AsyncMission:
        """Return a mission begun earlier; numbers continue after the last report that the service has."""
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
        return await self._session.ask("POST", path, body, _once(key))


def _once(key: str | None = None) -> dict[str, str]:
    """Return the headers of a request that is carried out once, however often it is sent."""
    return {"Idempotency-Key": key or uuid.uuid4().hex}

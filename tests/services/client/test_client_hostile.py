"""Behind a proxy with every fault of proxies and networks, everything arrives exactly once and in order."""

import asyncio
import itertools
import random
import threading
import uuid
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import Self

import pytest
from mission_setup import body, team
from support.missions.reference_missions import STEPS, LogLines, reference_log
from support.services import plain_client
from support.services.plain_client import HOST
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.generators.builtin import builtin_scenario
from marsupial_client import AsyncClient, Client, http
from marsupial_client.mission_documents import Brief, News
from marsupial_service.simulation import simulate_mission

BUSY = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 0\r\nContent-Length: 4\r\nConnection: close\r\n\r\nbusy"
FATES = ("busy", "twice", "twice", "relay", "relay", "relay", "relay", "relay")
"""Treatments of connections, in random order; relayed ones may be cut."""

_GONE = (OSError, asyncio.IncompleteReadError)

Ends = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class HostileProxy:
    """A proxy for the server at `port`; within a `with` block it listens at `url`.

    `bytes_between_cuts` is the mean in each direction of a connection. `done` counts connections by
    their treatment: `busy`, `twice`, `cut`.
    """

    def __init__(self, port: int, seed: int, bytes_between_cuts: int = 4000) -> None:
        self.done: Counter[str] = Counter()
        self._port = port
        self._draw = random.Random(seed)
        self._bytes_between_cuts = bytes_between_cuts
        self._fates = itertools.cycle(self._draw.sample(FATES, len(FATES)))
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)

    def __enter__(self) -> Self:
        self._thread.start()
        starting = asyncio.run_coroutine_threadsafe(asyncio.start_server(self._serve, HOST, 0), self._loop)
        self._server = starting.result(HANG_S)
        self.url = f"http://{HOST}:{self._server.sockets[0].getsockname()[1]}"
        return self

    def __exit__(self, *_: object) -> None:
        asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(HANG_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(HANG_S)
        self._loop.close()

    async def _stop(self) -> None:
        self._server.close()
        await _turns()  # a connection accepted just before is served only in the next iterations of the loop
        while others := asyncio.all_tasks() - {asyncio.current_task()}:
            for task in others:
                task.cancel()
            await asyncio.gather(*others, return_exceptions=True)
            await _turns()  # aborted connections are closed in the next iterations

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection in a random way."""
        fate = next(self._fates)
        with suppress(*_GONE), _aborted(writer):
            first = await _request(reader)
            if fate == "busy":
                self.done["busy"] += 1
                writer.write(BUSY)
                await writer.drain()
                await reader.read()  # until the client has closed: an abort could overtake the answer
                return
            if fate == "twice" and first.startswith(b"POST"):
                self.done["twice"] += 1
                await self._send_once_more(first)
            await self._relay(first, (reader, writer))

    async def _send_once_more(self, request: bytes) -> None:
        reader, writer = await asyncio.open_connection(HOST, self._port)
        with _aborted(writer):
            writer.write(request)
            await reader.readuntil(b"\r\n\r\n")

    async def _relay(self, first: bytes, client: Ends) -> None:
        """Pass bytes in both directions until one of them is cut."""
        reader, writer = await asyncio.open_connection(HOST, self._port)
        with _aborted(writer):
            writer.write(first)
            ways = [
                asyncio.ensure_future(way)
                for way in (self._pass_on(client[0], writer), self._pass_on(reader, client[1]))
            ]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        left = int(self._draw.expovariate(1 / self._bytes_between_cuts))
        while chunk := await reader.read(self._draw.randint(1, 2000)):
            writer.write(chunk[:left])
            await writer.drain()
            left -= len(chunk)
            if left <= 0:
                self.done["cut"] += 1
                return
            await asyncio.sleep(self._draw.choice((0, 0, 0, 0.003)))


async def _turns() -> None:
    """Let the loop go round some times, however long each takes."""
    for _ in range(20):
        await asyncio.sleep(0)


@contextmanager
def _aborted(writer: asyncio.StreamWriter) -> Iterator[None]:
    """Abort a connection after a block, however that ends."""
    try:
        yield
    finally:
        writer.transport.abort()


async def _request(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    lengths = [line.partition(b":")[2] for line in head.splitlines() if line.lower().startswith(b"content-length:")]
    return head + await reader.readexactly(int(lengths[0]) if lengths else 0)


REPORTS, EVENTS = 200, 50


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "FIRST_PAUSE_S", 0.001)
    monkeypatch.setattr(http, "LONGEST_PAUSE_S", 0.01)


@pytest.fixture(params=[1, 2])
def proxy(request: pytest.FixtureRequest, server: Server) -> Iterator[HostileProxy]:
    with HostileProxy(server.port, request.param) as found:
        yield found
    assert min(found.done[what] for what in ("busy", "twice", "cut")) > 0, found.done


def news() -> Iterator[News]:
    """Yield the reports of a mission with few events: the cells seen at the start, then only time."""
    first = team().answer({"commands": [], "n": 0, "until_ms": 0})
    assert first is not None
    del first["n"]
    yield first  # type: ignore[misc]
    for number in range(1, REPORTS):
        yield {"t_ms": number}


def check(server: Server, mission: str, seen: list[tuple[int, str]]) -> None:
    """Compare the received events with those of the server."""
    stored = [(frame.id, frame.type) for frame in plain_client.frames(server.port, f"/v1/missions/{mission}/events")]
    assert seen == stored
    assert len(seen) > EVENTS
    document = server.ask("GET", f"/v1/missions/{mission}").document
    assert (document["n"], document["t_ms"], document["status"]) == (REPORTS, REPORTS - 1, "cancelled")
    named = [
        one["id"] for one in server.ask("GET", "/v1/missions").document["missions"] if one["name"] == document["name"]
    ]
    assert named == [mission]


def brief(proxy: HostileProxy) -> Brief:
    """Return the brief of a mission with a unique name."""
    return {**body(), "name": f"{proxy.url} {uuid.uuid4().hex}"}  # type: ignore[typeddict-item]


def test_reports_and_events_come_through_exactly_once(server: Server, proxy: HostileProxy) -> None:
    seen: list[tuple[int, str]] = []
    with Client(proxy.url) as client:
        mission = client.begin(brief(proxy))
        follower = threading.Thread(target=lambda: seen.extend((event.id, event.type) for event in mission.events()))
        follower.start()
        taken = [mission.report(one) for one in news()]
        mission.cancel()
        follower.join(HANG_S)
    assert [one["n"] for one in taken if one is not None] == list(range(1, REPORTS + 1))
    check(server, mission.id, seen)


def many(count: int = 60) -> Iterator[list[News]]:
    """Yield batches of the same reports, with those of two robots by their own counts in between."""
    told = list(news())
    size = len(told) // count + 1
    for i in range(0, len(told), size):
        batch: list[News] = []
        for j, one in enumerate(told[i : i + size], start=i):
            batch += [one, {"t_ms": one["t_ms"], "robot": f"carrier{1 + j % 2}"}]
        yield batch


def counted(server: Server, mission: str) -> None:
    last = server.ask("GET", f"/v1/missions/{mission}/reports").document
    each = {"carrier1": REPORTS // 2, "carrier2": REPORTS // 2}
    assert last == {"n": REPORTS, "t_ms": REPORTS - 1, "robots": each}


def test_batches_and_reports_of_robots_come_through_exactly_once(server: Server, proxy: HostileProxy) -> None:
    with Client(proxy.url) as client:
        mission = client.begin(brief(proxy))
        for i, batch in enumerate(many()):
            if i == 20:  # another program resumes it
                mission = client.mission(mission.id)
            assert len(mission.reports(batch) or ()) == len(batch)
        assert (mission.n, mission.robots["carrier2"]) == (REPORTS, REPORTS // 2)
        mission.cancel()
    counted(server, mission.id)


async def test_batches_of_async_tasks_do_too(server: Server, proxy: HostileProxy) -> None:
    async with AsyncClient(proxy.url) as client, asyncio.timeout(HANG_S):
        mission = await client.begin(brief(proxy))
        for batch in many():
            last = mission.n + len(batch) // 2
            task = asyncio.create_task(mission.reports(batch))
            await asyncio.sleep(0.003)
            task.cancel()  # before, during or after its processing
            await asyncio.wait([task])
            await mission.reports(())
            if mission.n < last:
                await mission.reports(batch)
        await mission.cancel()
    counted(server, mission.id)


def test_a_mission_is_the_one_in_process_byte_for_byte(proxy: HostileProxy) -> None:
    lines = LogLines()
    simulate_mission(
        Client(proxy.url),
        builtin_scenario("lobby"),
        strategy="temporal",
        planner="greedy",
        budget=STEPS,
        seed=1,
        observer=lines,
        stopping=lambda: nullcontext(lambda: False),
    )
    assert lines.text == reference_log("lobby")


def test_every_plan_of_a_job_comes_once_and_the_job_is_one(server: Server) -> None:
    before = len(server.ask("GET", "/v1/jobs?limit=200").document["jobs"])
    with HostileProxy(server.port, 3, bytes_between_cuts=1500) as proxy, Client(proxy.url) as client:
        job = client.submit({**client.demo("yard"), "budget": {"steps": 50}, "planner": "anytime"})
        revisions = [plan["revision"] for plan in job.plans()]
        assert revisions == list(range(1, job.result()["plans"] + 1))
        assert proxy.done["cut"] > 0
    assert len(server.ask("GET", "/v1/jobs?limit=200").document["jobs"]) == before + 1

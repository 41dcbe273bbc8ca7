"""A full disk during a mission: inputs that can't be stored are not acknowledged, and nothing is lost."""

import asyncio
import contextlib
import sqlite3
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest
from entry_setup import followed
from mission_setup import Driver, body, open_missions, started, team
from service_requests import problem
from support.missions.reference_missions import reference_log
from support.waiting import wait_until_async

from benchmarks.trial import failpoints
from marsupial_service.app import create_app
from marsupial_service.http.routing import LOCAL_OWNER
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.service import Missions
from marsupial_service.settings import ServiceSettings
from marsupial_service.state import state_of
from marsupial_service.store import open_store
from marsupial_service.store.packing import pack
from marsupial_service.store.sqlite import FILE

URL = "http://127.0.0.1"


@dataclass
class Service:
    """A service in this process."""

    http: httpx.AsyncClient
    missions: Missions


@asynccontextmanager
async def serving(folder: Path) -> AsyncIterator[Service]:
    app = create_app(ServiceSettings(data=folder))
    state_of(app).store = open_store(folder)
    transport = httpx.ASGITransport(app)
    async with app.router.lifespan_context(app), httpx.AsyncClient(transport=transport, base_url=URL) as http:
        yield Service(http, state_of(app).missions)


@dataclass(slots=True)
class HttpDriver(Driver):
    """Reports over HTTP, and repeats reports after a 503."""

    http: httpx.AsyncClient | None = None
    refused: list[dict[str, Any]] = field(default_factory=list)

    async def _send(self, missions: Missions, record: MissionRecord) -> None:
        assert self.unsent is not None
        while (
            answer := await self.http.post(f"/v1/missions/{record.id}/reports", json=self.unsent)
        ).status_code != 200:
            self.refused.append(problem(answer, 503, "not-ready"))
            await asyncio.sleep(0.01)
        self.reports.append(self.unsent)
        self.unsent = None


async def start_mission(service: Service) -> MissionRecord:
    made = await service.http.post("/v1/missions", json=body())
    return await found(service, made.json()["id"])


async def found(service: Service, mission: str) -> MissionRecord:
    record = await service.missions.of(LOCAL_OWNER, mission)
    assert record is not None
    return record


async def test_a_report_that_can_not_be_stored_is_not_acknowledged_and_the_mission_continues(tmp_path: Path) -> None:
    driver = HttpDriver(team())
    async with serving(tmp_path) as service:
        driver.http = service.http
        record = await start_mission(service)
        path = f"/v1/missions/{record.id}"
        assert not await driver.drive(service.missions, record, 5)
        before = (await service.http.get(path)).json(), (await service.http.get(f"{path}/map")).json()
        failpoints.arm("before_commit=disk_full")
        report = {"n": 6, "t_ms": before[0]["t_ms"]}
        for _ in range(2):
            answer = await service.http.post(f"{path}/reports", json=report)
            document = problem(answer, 503, "not-ready")
            assert document["detail"] == "nothing was stored; see the server log"
            assert int(answer.headers["retry-after"]) > 0
        problem(await service.http.post(f"{path}/pause"), 503, "not-ready")
        problem(await service.http.post("/v1/missions", json=body()), 503, "not-ready")
        after = (await service.http.get(path)).json(), (await service.http.get(f"{path}/map")).json()
        assert (after[0]["n"], after[0]["state"], after[1]) == (5, "running", before[1])
        assert [one["id"] for one in (await service.http.get("/v1/missions")).json()["missions"]] == [record.id]
        failpoints.arm("")
        assert not await driver.drive(service.missions, record, 9)
        mission = record.id
    async with serving(tmp_path) as service:
        driver.http = service.http
        record = await found(service, mission)
        assert record.n == 9
        assert await driver.drive(service.missions, record)
        assert await service.missions.log(record) == reference_log("lobby")


@pytest.mark.parametrize("commit", range(1, 5))
async def test_the_log_is_the_same_whichever_commit_fails(tmp_path: Path, commit: int) -> None:
    async with serving(tmp_path) as service:
        driver = HttpDriver(team(), http=service.http)
        record = await start_mission(service)
        assert not await driver.drive(service.missions, record, 5)
        points = failpoints.arm(f"before_commit=disk_full@{commit}")
        assert await driver.drive(service.missions, record)
        assert points.passed[failpoints.BEFORE_COMMIT] > commit
        assert await service.missions.log(record) == reference_log("lobby")


async def test_a_mission_that_can_not_continue_ends_once_there_is_space_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        assert not await Driver(team()).drive(missions, record, 3)
        mission = record.id
    with contextlib.closing(sqlite3.connect(tmp_path / FILE)) as file, file:
        file.execute("UPDATE mission_events SET data = ? WHERE batch = 0", (pack(b"log {}"),))
    failpoints.arm("before_commit=disk_full")
    async with open_missions(tmp_path) as missions:
        await wait_until_async(lambda: "the store can't be written" in caplog.text)
        failpoints.arm("")
        events = [event async for event in followed(missions, mission)]
        assert events[-1].type == "end"
        record = await missions.of("me", mission)
        assert (record.status, "gave a different result" in record.reason) == ("failed", True)

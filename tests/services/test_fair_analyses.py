"""Analyses are shared fairly between keys, and count against the quota of planning time."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
from service_requests import problem
from support.waiting import wait_until_async
from test_service_maps import map_state

from marsupial_service.app import create_app
from marsupial_service.intake.supervised import SupervisedProcesses
from marsupial_service.keys import KeyFile
from marsupial_service.settings import ServiceLimits, ServiceSettings
from marsupial_service.state import State, state_of


class PausedProcesses(SupervisedProcesses):
    """Processes that each wait for a permit before they start."""

    def __init__(self) -> None:
        super().__init__()
        self.begun = 0
        self.permits = asyncio.Semaphore(0)

    async def value_of(self, *job: Any, **limits: Any) -> object:
        self.begun += 1
        await self.permits.acquire()
        return await super().value_of(*job, **limits)


class AnalysisClient:
    """Requests analyses with the keys of several clients."""

    def __init__(self, http: httpx.AsyncClient, state: State, paused: PausedProcesses, secrets: dict[str, str]) -> None:
        self.http, self.state, self.paused, self.secrets = http, state, paused, secrets

    async def analysis(self, key: str) -> httpx.Response:
        return await self.post(key, "/v1/analysis", {"map_state": map_state()})

    async def post(self, key: str, path: str, body: Mapping[str, Any]) -> httpx.Response:
        return await self.http.post(path, json=body, headers={"Authorization": f"Bearer {self.secrets[key]}"})


@asynccontextmanager
async def serving(folder: Path, **limits: float) -> AsyncIterator[AnalysisClient]:
    settings = ServiceSettings(data=folder, keys=True, limits=ServiceLimits(analyses=2, **limits))  # type: ignore[arg-type]
    secrets = {name: KeyFile(folder).add(name, ["plan", "mission"], 1, now_s=4e9) for name in ("ann", "bob")}
    app = create_app(settings)
    state = state_of(app)
    paused = state.supervised = state.analyses.supervised = state.readers.supervised = PausedProcesses()
    http = httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost", timeout=None)
    async with app.router.lifespan_context(app), http:
        yield AnalysisClient(http, state, paused, secrets)
        state.begin_shutdown()


async def test_a_key_with_many_analyses_leaves_a_slot_to_a_key_without_any(tmp_path: Path) -> None:
    async with serving(tmp_path, wait_s=600.0) as client:
        flood = [asyncio.create_task(client.analysis("ann")) for _ in range(16)]
        await wait_until_async(lambda: sum(task.done() for task in flood) == 13 and client.paused.begun == 1)
        other = asyncio.create_task(client.analysis("bob"))
        await wait_until_async(lambda: client.paused.begun == 2)
        assert (client.state.analyses.slots.waiting("bob"), client.state.analyses.slots.waiting("ann")) == (0, 2)
        for _ in range(4):
            client.paused.permits.release()
        found = Counter([(await task).status_code for task in flood]), [(await other).status_code]
    assert found == (Counter({429: 13, 200: 3}), [200])


async def test_a_request_that_waits_too_long_for_its_turn_is_refused(tmp_path: Path) -> None:
    async with serving(tmp_path, wait_s=0.0) as client:
        running = [asyncio.create_task(client.analysis(key)) for key in ("ann", "bob")]
        await wait_until_async(lambda: client.paused.begun == 2)
        answer = await client.analysis("bob")
        for _ in running:
            client.paused.permits.release()
        await asyncio.gather(*running)
        assert client.state.analyses.slots.in_use == 0
    assert problem(answer, 429, "too-many")["detail"].startswith("at most 2 such requests")


async def test_a_waiting_analysis_does_not_begin_once_the_quota_is_used_up(tmp_path: Path) -> None:
    async with serving(tmp_path, key_planning_s=3600.0, wait_s=600.0) as client:
        both = [asyncio.create_task(client.analysis("ann")) for _ in range(2)]
        await wait_until_async(lambda: client.paused.begun == 1 and client.state.analyses.slots.waiting("ann") == 1)
        client.state.jobs.charge("ann", 7200.0)
        client.paused.permits.release()
        found = sorted([(await task).status_code for task in both])
        begun = client.paused.begun
    assert (found, begun) == ([200, 429], 1)


async def test_a_preview_needs_quota_too(tmp_path: Path) -> None:
    async with serving(tmp_path, key_planning_s=3600.0) as client:
        client.state.jobs.charge("ann", 7200.0)
        refused = await client.post("ann", "/v1/simulations/preview", {"scenario": "yard"})
        begun = client.paused.begun
    assert "key_planning_s" in problem(refused, 429, "too-many")["detail"]
    assert begun == 0


async def test_analyses_count_against_the_quota(tmp_path: Path) -> None:
    async with serving(tmp_path, key_planning_s=3600.0) as client:
        client.paused.permits.release()
        first = await client.analysis("ann")
        jobs = client.state.jobs

        async def charged() -> bool:
            return "ann" in await jobs.left_s()

        await wait_until_async(charged)
        jobs.charge("ann", 7200.0)

        async def used_up() -> bool:
            return (await jobs.left_s())["ann"] < 0

        await wait_until_async(used_up)
        status, left_s, refused, begun = (
            first.status_code,
            (await jobs.left_s())["ann"],
            await client.analysis("ann"),
            client.paused.begun,
        )
    assert (status, begun) == (200, 1)
    assert left_s < 0
    assert "key_planning_s" in problem(refused, 429, "too-many")["detail"]
    assert int(refused.headers["retry-after"]) > 60

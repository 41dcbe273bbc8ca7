"""Analyses have turns by key, and count against the quota of planning time."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
from service_requests import problem
from test_service_maps import map_state
from waiting import wait_until_async

from marsupial_service.app import create_app
from marsupial_service.intake.supervised import SupervisedProcesses
from marsupial_service.keys import KeyFile
from marsupial_service.settings import ServiceLimits, ServiceSettings
from marsupial_service.state import State, state_of


class HeldBack(SupervisedProcesses):
    """Processes that begin when the test says so."""

    def __init__(self) -> None:
        super().__init__()
        self.begun = 0
        self.go_on = asyncio.Semaphore(0)

    async def value_of(self, *job: Any, **limits: Any) -> object:
        self.begun += 1
        await self.go_on.acquire()
        return await super().value_of(*job, **limits)


class Asker:
    """Asks a service for analyses by the keys of several clients."""

    def __init__(self, http: httpx.AsyncClient, state: State, held: HeldBack, secrets: dict[str, str]) -> None:
        self.http, self.state, self.held, self.secrets = http, state, held, secrets

    async def analysis(self, key: str) -> httpx.Response:
        headers = {"Authorization": f"Bearer {self.secrets[key]}"}
        return await self.http.post("/v1/analysis", json={"map_state": map_state()}, headers=headers)


@asynccontextmanager
async def serving(folder: Path, **limits: float) -> AsyncIterator[Asker]:
    settings = ServiceSettings(data=folder, keys=True, limits=ServiceLimits(analyses=2, **limits))  # type: ignore[arg-type]
    secrets = {name: KeyFile(folder).add(name, ["plan"], 1, now_s=4e9) for name in ("ann", "bob")}
    app = create_app(settings)
    state = state_of(app)
    held = state.supervised = state.analyses.supervised = HeldBack()
    http = httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost", timeout=None)
    async with app.router.lifespan_context(app), http:
        yield Asker(http, state, held, secrets)
        state.begin_shutdown()


async def test_a_key_that_floods_the_analyses_waits_behind_one_that_has_none(tmp_path: Path) -> None:
    async with serving(tmp_path, wait_s=600.0) as asker:
        flood = [asyncio.create_task(asker.analysis("ann")) for _ in range(16)]
        await wait_until_async(lambda: sum(task.done() for task in flood) == 12 and asker.held.begun == 2)
        other = asyncio.create_task(asker.analysis("bob"))
        await wait_until_async(lambda: asker.state.analyses.slots.waiting("bob") == 1)
        asker.held.go_on.release()  # one of ann's ends, and two of hers wait
        await wait_until_async(lambda: asker.held.begun == 3)
        assert (asker.state.analyses.slots.waiting("bob"), asker.state.analyses.slots.waiting("ann")) == (0, 2)
        for _ in range(4):
            asker.held.go_on.release()
        found = Counter([(await task).status_code for task in flood]), [(await other).status_code]
    assert found == (Counter({429: 12, 200: 4}), [200])


async def test_who_waits_too_long_for_a_turn_is_refused(tmp_path: Path) -> None:
    async with serving(tmp_path, wait_s=0.0) as asker:
        running = [asyncio.create_task(asker.analysis("ann")) for _ in range(2)]
        await wait_until_async(lambda: asker.held.begun == 2)
        answer = await asker.analysis("bob")
        for _ in running:
            asker.held.go_on.release()
        await asyncio.gather(*running)
        assert asker.state.analyses.slots.in_use == 0
    assert problem(answer, 429, "too-many")["detail"].startswith("at most 2 such requests")


async def test_analyses_count_against_the_quota(tmp_path: Path) -> None:
    async with serving(tmp_path, key_planning_s=3600.0) as asker:
        asker.held.go_on.release()
        first = await asker.analysis("ann")
        jobs = asker.state.jobs

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
            await asker.analysis("ann"),
            asker.held.begun,
        )
    assert (status, begun) == (200, 1)
    assert left_s < 0
    assert "key_planning_s" in problem(refused, 429, "too-many")["detail"]
    assert int(refused.headers["retry-after"]) > 60

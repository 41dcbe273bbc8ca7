import asyncio
from pathlib import Path

import httpx
import pytest
from service_requests import client, problem
from support.services.servers import Server

from marsupial_service.app import create_app
from marsupial_service.settings import ServiceSettings


def test_a_full_queue_refuses_jobs_with_a_retry_time(tmp_path: Path) -> None:
    with Server(tmp_path, "--limit", "slots=1", "--limit", "queue=1") as server, client(server) as http:
        body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 60}}
        running = http.post("/v1/jobs", json=body).json()["links"]
        while http.get(running["self"]).json()["state"] == "queued":
            pass
        waiting = http.post("/v1/jobs", json=body)
        full = http.post("/v1/jobs", json=body)
        assert waiting.status_code == 202
        problem(full, 429, "too-many")
        assert int(full.headers["retry-after"]) >= 1
        assert http.post(waiting.json()["links"]["cancel"]).json()["state"] == "cancelled"
        assert http.post("/v1/jobs", json=body).status_code == 202


def test_a_bug_is_answered_without_its_traceback(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    app = create_app(ServiceSettings(data=tmp_path))

    @app.get("/broken")
    async def broken() -> None:
        raise ZeroDivisionError("secret")

    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as http:
            return await http.get("/broken")

    answer = asyncio.run(ask())
    document = problem(answer, 500, "internal")
    assert "secret" not in answer.text
    assert document["detail"].endswith(answer.headers["x-request-id"])
    assert "secret" in caplog.text

"""What an operator is told: metrics, their table, and the routes that need no key."""

import asyncio
import re
import time
from pathlib import Path

import httpx
import pytest
from fastapi.routing import APIRoute
from prometheus_client.parser import text_string_to_metric_families

from marsupial_service.app import create_app
from marsupial_service.http.routing import ServiceRoute
from marsupial_service.keys import Scope
from marsupial_service.operations import metrics
from marsupial_service.settings import ServiceSettings

DOCS = (Path(__file__).parents[2] / "docs" / "operations.md").read_text(encoding="utf-8")


def table(heading: str) -> list[str]:
    """Return the first column of the table with that heading in docs/operations.md."""
    rows = DOCS.partition(f"\n| {heading} |")[2].split("\n\n")[0].splitlines()[2:]
    return [name for row in rows for name in re.findall(r"`([^`]+)`", row.split("|")[1])]


def test_the_table_of_metrics_has_those_that_are_served(http: httpx.Client) -> None:
    text = http.get("/metrics", headers={"accept": "text/plain"}).text
    families = {family.name: family for family in text_string_to_metric_families(text)}
    assert sorted(table("metric")) == sorted(name.removesuffix("_info") for name in families)
    assert "_created" not in text
    assert {"restart", "takeover"} == {one.labels["why"] for one in families["marsupial_missions_resumed"].samples}
    assert {"read", "write"} == {one.labels["kind"] for one in families["marsupial_store_errors"].samples}


def test_the_routes_without_a_key_are_those_that_the_documentation_lists(tmp_path: Path) -> None:
    app = create_app(ServiceSettings(data=tmp_path, keys=True))
    included = [getattr(route, "original_router", None) for route in app.routes]
    found = [route for router in (app, *filter(None, included)) for route in router.routes]
    routes = [route for route in found if isinstance(route, APIRoute)]
    assert {route.scope for route in routes if isinstance(route, ServiceRoute)} == {None, *Scope}
    free = {route.path for route in routes if not isinstance(route, ServiceRoute) or route.scope is None}
    assert free == set(table("needs no key"))
    assert {method for route in routes if route.path in free for method in route.methods or ()} <= {"GET", "HEAD"}


async def test_a_blocked_event_loop_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metrics, "_DELAY_S", 0.01)
    measured: asyncio.Future[float] = asyncio.get_running_loop().create_future()
    watch = asyncio.create_task(metrics.measure_delay(measured.set_result))
    await asyncio.sleep(0)  # until it has begun to wait
    time.sleep(0.1)
    assert await measured >= 0.08
    watch.cancel()

"""A client generated from the stored OpenAPI document works."""

import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial_service.examples.demos import EXAMPLES
from marsupial_service.http import openapi
from marsupial_service.http.openapi import FILE

pytest.importorskip("openapi_python_client", reason="openapi-python-client is not installed (extra dev)")

PACKAGE = "generated_client"
CONFIG = {"content_type_overrides": {"application/jsonl": "text/plain"}, "post_hooks": []}
"""The generator does not support mission logs, and the code is not formatted."""


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Any]]:
    """Return a function that imports a module of the generated package."""
    folder = tmp_path_factory.mktemp("client")
    (folder / "config.json").write_text(json.dumps(CONFIG))
    document = Path(openapi.__file__).with_name(FILE)
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--path", str(document), "--meta", "none"]
    command += ["--output-path", str(folder / PACKAGE), "--config", str(folder / "config.json"), "--fail-on-warning"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    sys.path.insert(0, str(folder))
    yield lambda name: importlib.import_module(f"{PACKAGE}.{name}")
    sys.path.remove(str(folder))


@pytest.fixture
def client(server: Server, generated: Callable[[str], Any]) -> Iterator[Any]:
    with generated("client").AuthenticatedClient(
        base_url=server.url, token="of nobody", timeout=httpx.Timeout(60), httpx_args={"trust_env": False}
    ) as opened:
        yield opened


def test_a_job_is_sent_followed_to_its_end_and_its_plan_is_read(client: Any, generated: Callable[[str], Any]) -> None:
    jobs, models = "api.jobs", generated("models")
    demo = generated("api.catalogue.get_demo").sync("yard", client=client)
    job = generated(f"{jobs}.submit_job").sync(client=client, body=models.MapStateJobBody.from_dict(demo.to_dict()))
    told = generated(f"{jobs}.follow_job").sync(job.id, client=client)
    assert told.rstrip().splitlines()[-2] == "event: end"
    found = generated(f"{jobs}.get_job").sync(job.id, client=client)
    assert (found.state, found.outcome in ("optimal", "satisficing")) == ("succeeded", True)
    plans = generated(f"{jobs}.list_plans").sync(job.id, client=client)
    assert plans.plans[-1] == found.best
    assert {action.name for action in found.best.actions} >= {"explore"}
    situation = generated(f"{jobs}.get_situation").sync(job.id, client=client).situation
    plan = {"actions": [action.to_dict() for action in found.best.actions]}
    asked = models.ValidationBody.from_dict({"situation": situation.to_dict(), "plan": plan})
    assert generated("api.analysis.validate").sync(client=client, body=asked).valid


def test_a_mission_is_begun_reported_to_and_cancelled(client: Any, generated: Callable[[str], Any]) -> None:
    missions, models = "api.missions", generated("models")
    body = models.MissionBody.from_dict(EXAMPLES["/v1/missions"]())
    mission = generated(f"{missions}.create_mission").sync(client=client, body=body)
    report = models.ReportBody.from_dict(EXAMPLES["/v1/missions/{mission}/reports"]())
    assert generated(f"{missions}.report").sync(mission.id, client=client, body=report).n == 1
    generated(f"{missions}.cancel_mission").sync(mission.id, client=client)
    assert "event: end" in generated(f"{missions}.follow_mission").sync(mission.id, client=client)
    assert generated(f"{missions}.get_log").sync(mission.id, client=client).startswith('{"event":"mission"')


def test_an_error_is_a_problem(client: Any, generated: Callable[[str], Any]) -> None:
    models = generated("models")
    body = models.SituationJobBody.from_dict({**EXAMPLES["/v1/jobs"](), "planner": "none"})
    found = generated("api.jobs.submit_job").sync(client=client, body=body)
    assert (found.status, found.errors[0].pointer) == (422, "/planner")

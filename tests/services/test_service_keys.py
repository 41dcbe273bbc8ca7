import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from service_requests import client, problem, serve
from support.services.databases import PostgresServer
from support.services.servers import Server
from support.waiting import wait_until

from marsupial.errors import UsageError
from marsupial_service.keys import FILE, KeyFile, open_keys
from marsupial_service.settings import ServiceLimits, ServiceSettings, limits_from


@pytest.fixture
def secrets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """Keys created by the command, by name."""
    return {
        name: serve(capsys, "keys", "add", name, "--scope", scope, "--data", str(tmp_path))[1].strip()
        for name, scope in (("ann", "plan"), ("bob", "plan"), ("ops", "admin"))
    }


def test_a_key_is_kept_as_a_hash_and_good_until_it_expires(tmp_path: Path) -> None:
    keys = KeyFile(tmp_path)
    secret = keys.add("fleet", ["plan"], 1, now_s=1000.0)
    text = (tmp_path / FILE).read_text()
    assert secret not in text
    assert (tmp_path / FILE).stat().st_mode & 0o77 == 0
    found = KeyFile(tmp_path).find(secret, 1000.0)
    assert (found.name, found.scopes) == ("fleet", ("plan",))
    assert keys.find(secret, 1000.0 + 86400) is None
    assert keys.find(secret + "x", 1000.0) is None


def test_a_revoked_key_is_useless_at_once_and_its_name_free(tmp_path: Path) -> None:
    keys, other = KeyFile(tmp_path), KeyFile(tmp_path)
    secret = keys.add("fleet", ["plan"], 1, now_s=0.0)
    assert other.find(secret, 1.0) is not None
    keys.revoke("fleet", 1.0)
    assert other.find(secret, 1.0) is None
    assert keys.find(keys.add("fleet", ["admin"], 1, now_s=2.0), 3.0) is not None
    with pytest.raises(UsageError, match="unknown key 'fleeet'"):
        keys.revoke("fleeet", 3.0)


def test_a_name_may_have_two_valid_keys_for_replacement(place: str) -> None:
    with open_keys(Path(place) if place.startswith("/") else place) as keys:
        old = keys.add("fleet", ["plan"], 1, now_s=0.0)
        new = keys.add("fleet", ["plan"], 9, now_s=0.0)
        with pytest.raises(UsageError, match="already has 2 valid keys"):
            keys.add("fleet", ["plan"], 1, now_s=0.0)
        (kept, _) = keys.all()
        keys.revoke(kept.id, 1.0)
        assert keys.find(old, 1.0) is None
        assert keys.find(new, 1.0) is not None
        keys.add("fleet", ["plan"], 1, now_s=2.0)


def test_servers_receive_key_changes_through_their_database(postgres: PostgresServer) -> None:
    shared = postgres.database()
    with open_keys(shared) as server, open_keys(shared) as other:
        secret = other.add("fleet", ["plan"], 1, now_s=0.0)
        for change, good in ((None, True), ("fleet", False)):
            if change is not None:
                other.revoke(change, 1.0)
            wait_until(lambda good=good: (server.find(secret, 2.0) is not None) is good)


@pytest.mark.parametrize(("scopes", "days"), [([], 1), (["fly"], 1), (["plan"], 0), (["plan"], float("nan"))])
def test_an_invalid_key_request_is_refused(tmp_path: Path, scopes: list[str], days: float) -> None:
    with pytest.raises(UsageError):
        KeyFile(tmp_path).add("fleet", scopes, days, now_s=0.0)


def test_beyond_this_machine_keys_are_needed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert not ServiceSettings(data=tmp_path).needs_keys
    assert ServiceSettings(data=tmp_path, host="0.0.0.0").needs_keys
    code, _, error = serve(capsys, "--host", "0.0.0.0", "--port", "0", "--data", str(tmp_path))
    assert code == 2
    assert "create one with 'marsupial serve keys add" in error


def test_a_key_grants_its_scopes_and_its_owner_s_jobs_only(
    tmp_path: Path, secrets: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert "ann" in serve(capsys, "keys", "list", "--data", str(tmp_path))[1]
    with Server(tmp_path, "--require-keys") as server, client(server) as http:
        bearer = {name: {"Authorization": f"Bearer {secret}"} for name, secret in secrets.items()}
        job = {**http.get("/v1/demo-data/office-6x3", headers=bearer["ann"]).json(), "planner": "anytime"}
        job["budget"] = {"seconds": 120}
        answer = problem(http.post("/v1/jobs", content=b"not read"), 401, "no-key")
        assert "missing" in answer["detail"]
        assert http.get("/v1/jobs").headers["www-authenticate"] == "Bearer"
        problem(http.get("/v1/jobs", headers={"Authorization": "Bearer guess"}), 401, "no-key")
        problem(http.get("/v1/jobs", headers=bearer["ops"]), 403, "no-scope")
        problem(http.get("/metrics", headers=bearer["ann"]), 403, "no-scope")
        assert http.get("/metrics", headers=bearer["ops"]).status_code == 200
        assert http.get("/healthz").status_code == 200
        path = http.post("/v1/jobs", json=job, headers=bearer["ann"]).json()["links"]["self"]
        assert http.get(path, headers=bearer["ann"]).status_code == 200
        for hidden in (path, f"{path}/plans", f"{path}/events", f"{path}/situation"):
            problem(http.get(hidden, headers=bearer["bob"]), 404, "not-found")
        problem(http.post(f"{path}/cancel", headers=bearer["bob"]), 404, "not-found")
        assert http.get("/v1/jobs", headers=bearer["bob"]).json()["jobs"] == []
        with http.stream("GET", f"{path}/events", headers=bearer["ann"]) as answer:
            lines = answer.iter_lines()
            next(lines)
            assert serve(capsys, "keys", "revoke", "ann", "--data", str(tmp_path))[0] == 0
            assert list(lines)[-2] == ": the key has expired or was revoked"
        problem(http.get(path, headers=bearer["ann"]), 401, "no-key")
        logged = [json.loads(line) for line in server.log.splitlines() if line.startswith("{")]
        assert any(line["message"] == "job accepted" and line["owner"] == "ann" for line in logged)
        assert not any(secret in server.log for secret in secrets.values())


def test_a_key_without_planning_time_gets_the_time_to_retry(tmp_path: Path, secrets: dict[str, str]) -> None:
    bearer = {name: {"Authorization": f"Bearer {secret}"} for name, secret in secrets.items()}
    with Server(tmp_path, "--require-keys", "--limit", "key_planning_s=3") as server, client(server) as http:
        demo = http.get("/v1/demo-data/yard", headers=bearer["ann"]).json()
        job = {**demo, "planner": "anytime", "budget": {"seconds": 2}}
        too_long = http.post("/v1/jobs", json={**job, "budget": {"seconds": 4}}, headers=bearer["ann"])
        assert "must be at most 3" in problem(too_long, 422, "invalid")["detail"]
        assert http.post("/v1/jobs", json=job, headers=bearer["ann"]).status_code == 202
        refused = http.post("/v1/jobs", json=job, headers=bearer["ann"])
        assert "key_planning_s" in problem(refused, 429, "too-many")["detail"]
        assert 1 <= int(refused.headers["Retry-After"]) <= 1200
        assert http.post("/v1/jobs", json=job, headers=bearer["bob"]).status_code == 202
        metrics = http.get("/metrics", headers={**bearer["ops"], "accept": "text/plain"}).text
        assert re.search(r'^marsupial_planning_seconds_left\{owner="ann"\} [01]\.', metrics, re.MULTILINE)


def test_limits_of_one_key_hold_only_where_keys_are_asked_for(tmp_path: Path) -> None:
    limits = ServiceLimits(key_queue=1, key_missions=1, key_bytes=1, key_planning_s=9.0)
    alone = ServiceSettings(data=tmp_path, limits=limits).effective().limits
    keyed = ServiceSettings(data=tmp_path, keys=True, limits=limits).effective().limits
    assert (alone.key_queue, alone.key_missions, alone.key_bytes) == (limits.queue, limits.missions, limits.store_bytes)
    assert (alone.key_planning_s, alone.budget_s) == (ServiceLimits().key_planning_s, limits.budget_s)
    assert keyed == replace(limits, budget_s=9.0, steps_s=9.0)


def test_a_limit_of_the_environment_holds() -> None:
    assert limits_from({"MARSUPIAL_CELLS": "7", "MARSUPIAL_WAIT_S": "0.5"}) == ServiceLimits(cells=7, wait_s=0.5)
    assert limits_from({"MARSUPIAL_CELLS": "7"}, {"cells": "8"}) == ServiceLimits(cells=8)
    with pytest.raises(UsageError, match="--limit cells: must be a number, got 'many'"):
        limits_from({}, {"cells": "many"})
    with pytest.raises(UsageError, match="--limit cells: must be 1 or more"):
        limits_from({}, {"cells": "0"})
    with pytest.raises(UsageError, match="MARSUPIAL_CELLS: must be a number"):
        limits_from({"MARSUPIAL_CELLS": "many"})
    with pytest.raises(UsageError, match="MARSUPIAL_CELLS: must be 1 or more, got 0"):
        limits_from({"MARSUPIAL_CELLS": "0"})
    with pytest.raises(UsageError, match="MARSUPIAL_ROBOTS: must be at most 1000, got 1001"):
        limits_from({"MARSUPIAL_ROBOTS": "1001"})
    with pytest.raises(UsageError, match="MARSUPIAL_CELLS: must be 1 or more, got -1000"):
        limits_from({"MARSUPIAL_CELLS": f"-1{'0' * 400}"})


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--limit", "cells"], "--limit: must be NAME=VALUE"),
        (["--limit", "cells=x"], "must be a number"),
        (["--limit", "apples=1"], "unknown limit 'apples'"),
        (["--planner", "x"], "--planner: must be NAME=VALUE"),
        (["--log-level", "loud"], "--log-level"),
        (["--host", "no.such.host.invalid"], "requires API keys"),
    ],
)
def test_invalid_options_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], text: str
) -> None:
    code, _, error = serve(capsys, "--data", str(tmp_path), *options)
    assert (code, text in error) == (2, True), error

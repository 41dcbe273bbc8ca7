import http.client
import json
import random
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from mission_setup import body
from support.missions.battery_yard import battery_text
from support.missions.faulty_mission import FAULTS
from support.missions.reference_missions import STEPS, LogLines, reference_log
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.cli.main import main
from marsupial.errors import UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.metrics import Summary
from marsupial.model.mission import Status
from marsupial_client import Client
from marsupial_service.simulation import simulate_mission


def explore(url: str, lines: LogLines, cancelled: Any = lambda: False, patience_s: float = 60.0) -> Summary:
    return simulate_mission(
        Client(url, patience_s=patience_s),
        builtin_scenario("lobby"),
        strategy="temporal",
        planner="greedy",
        budget=STEPS,
        seed=1,
        observer=lines,
        stopping=lambda: nullcontext(cancelled),
    )


@pytest.mark.parametrize(
    "words",
    [
        ("lobby", "--strategy", "heuristic"),
        ("lobby", "--carriers", "2", "--rovers", "0", "--planner", "anytime", "--steps", "2"),
        ("yard.yaml", "--planner", "greedy", "--steps", "1"),
    ],
)
def test_a_run_by_a_server_equals_the_run_in_process(
    server: Server,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("yard.yaml").write_text(battery_text(faults=FAULTS + "limits: {coverage: 0.8}\n"))
    found = []
    for where in ([], ["--server", server.url]):
        log = tmp_path / "log.jsonl"
        assert main(["run", *words, "--json", "--log", str(log), *where]) == 0
        summary = json.loads(capsys.readouterr().out)
        timed = {summary.pop("wall_s"), summary.pop("planning_s")["total"]}
        assert timed
        assert (summary.pop("analysis_s") is None) == bool(where)
        found.append((summary, log.read_bytes()))
    assert found[0] == found[1]
    if words[0] == "yard.yaml":
        assert ", 80 % are enough" in found[0][0]["reason"]
        assert b'"chargers":[[4,4],[24,2]]' in found[0][1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_server_that_is_killed_repeatedly_loses_nothing(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    lines = LogLines()
    with Server(tmp_path) as server:
        exploring = threading.Thread(target=lambda: explore(server.url, lines))
        exploring.start()
        kills = 0
        while exploring.is_alive() and kills < 6:
            time.sleep(draw.uniform(0.3, 1.5))
            server.kill()
            kills += 1
            server.start()
        exploring.join(HANG_S)
        _, _, listed = server.ask("GET", "/v1/missions")
        (mission,) = listed["missions"]
        assert (mission["state"], mission["status"]) == ("ended", "complete")
        assert server.ask("GET", mission["links"]["log"])[2] == reference_log("lobby")
    assert kills >= 2
    assert lines.text == reference_log("lobby")


def test_the_documents_of_a_mission_can_be_read(server: Server, mission: str) -> None:
    status, _, found = server.ask("GET", mission)
    assert (status, found["state"], found["n"], found["status"]) == (200, "running", 0, None)
    report = {"n": 1, "t_ms": 0, "revealed": [{"robot": "carrier1", "runs": [10, 5, 1, 70, 2, 0]}]}
    taken = server.ask("POST", f"{mission}/reports", report)
    assert taken == (200, "application/json", {"n": 1, "t_ms": 0, "revision": 0})
    assert server.ask("GET", f"{mission}/map")[2]["runs"] == [10, 5, 1, 70, 2, 0]
    assert server.ask("GET", f"{mission}/log")[1] == "application/jsonl"
    assert mission in {one["links"]["self"] for one in server.ask("GET", "/v1/missions")[2]["missions"]}


@pytest.mark.parametrize(
    ("report", "status", "pointer"),
    [
        ({"n": 2, "t_ms": 0}, 409, "/n"),
        ({"n": 1, "t_ms": 0, "finished": [4]}, 409, "/finished/0"),
        ({"n": 1, "t_ms": 0, "failed": [{"id": 4}]}, 409, "/failed/0/id"),
        ({"n": 1, "t_ms": 0, "robots": [{"name": "rover1_1", "cell": [1, 1]}]}, 409, "/robots/0"),
        ({"n": 1, "t_ms": 0, "robots": [{"name": "x", "cell": [1, 1]}]}, 422, "/robots/0/name"),
        ({"n": 1, "t_ms": 0, "robots": [{"name": "carrier1", "cell": [9999, 1]}]}, 422, "/robots/0/cell"),
        ({"n": 1, "t_ms": 0, "robots": [{"name": "carrier1", "pose_m": [-1, 0]}]}, 422, "/robots/0/pose_m"),
        ({"n": 1, "t_ms": 0, "revealed": [{"robot": "carrier1", "runs": [0, 1, 9]}]}, 422, "/revealed/0/runs"),
        ({"n": 1, "t_ms": 0, "map": {"runs": [5, 1, 1, 0, 1, 1]}}, 422, "/map/runs"),
        ({"n": 1, "t_ms": 0, "lost": [{"robot": "x"}]}, 422, "/lost/0/robot"),
        ({"n": 1, "t_ms": -1}, 422, "/t_ms"),
        ({"n": 1, "t_ms": 0, "colour": "red"}, 422, "/colour"),
    ],
)
def test_an_invalid_report_is_refused_with_pointers_and_changes_nothing(
    server: Server, mission: str, report: dict[str, Any], status: int, pointer: str
) -> None:
    before = server.ask("GET", mission)[2], server.ask("GET", f"{mission}/map")
    found, kind, problem = server.ask("POST", f"{mission}/reports", report)
    assert (found, kind) == (status, "application/problem+json")
    assert [error["pointer"] for error in problem["errors"]] == [pointer]
    assert (server.ask("GET", mission)[2], server.ask("GET", f"{mission}/map")) == before


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"strategy": "hope"}, "/strategy"),
        ({"planner": "cmd:rm {domain} {problem}"}, "/planner"),
        ({"planner": "nobody"}, "/planner"),
        ({"budget": {"seconds": 10**6}}, "/budget/seconds"),
        ({"area": [0, 1]}, "/area"),
        ({"team": [{"name": "a", "type": "carrier", "cell": [9999, 0]}]}, "/team/0/cell"),
        ({"team": [{"name": "a", "type": "carrier"}]}, "/team/0"),
        ({"team": [{"name": "a", "type": "tank", "cell": [1, 1]}]}, "/team/0/type"),
        ({"team": [{"name": "a", "type": "rover", "carrier": "b"}]}, "/team/0/carrier"),
    ],
)
def test_an_invalid_mission_is_refused_with_pointers(server: Server, change: dict[str, Any], pointer: str) -> None:
    status, kind, problem = server.ask("POST", "/v1/missions", body() | change)
    assert (status, kind) == (422, "application/problem+json")
    assert problem["errors"][0]["pointer"] == pointer


def test_missions_are_counted_in_the_metrics(server: Server, mission: str) -> None:
    text = server.ask("GET", "/metrics")[2]
    assert re.search(r'^marsupial_missions{state="running"} [1-9]', text, re.MULTILINE)


def test_pausing_resuming_and_cancelling_by_http(server: Server, mission: str) -> None:
    for word, status, state in (
        ("pause", 200, "paused"),
        ("pause", 200, "paused"),
        ("resume", 200, "running"),
        ("cancel", 200, "cancelling"),
        ("pause", 409, None),
        ("resume", 409, None),
    ):
        found, _, answer = server.ask("POST", f"{mission}/{word}")
        assert found == status
        assert answer.get("state") in (state, "ended" if word == "cancel" else None)
    text = stream(server, mission)
    assert text.count("event: end\n") == 1
    assert server.ask("GET", mission)[2]["status"] == "cancelled"
    assert server.ask("POST", f"{mission}/cancel")[0] == 200
    for last in range(1, text.count("\nid: ") + 1):
        at = text.index(f"\nid: {last}\n")
        after = text.find("\nid: ", at + 1)
        assert stream(server, mission, last).partition("\nid: ")[2] == ("" if after < 0 else text[after + 5 :])


def test_a_stream_after_an_event_that_was_never_sent_is_refused(server: Server) -> None:
    mission = urlsplit(server.ask("POST", "/v1/missions", body())[2]["links"]["self"]).path
    connection = http.client.HTTPConnection(urlsplit(server.url).netloc, timeout=HANG_S)
    connection.request("GET", f"{mission}/events", headers={"Last-Event-ID": "999999999999999"})
    answer = connection.getresponse()
    (error,) = json.loads(answer.read())["errors"]
    connection.close()
    server.ask("POST", f"{mission}/cancel")
    assert (answer.status, error["header"]) == (422, "Last-Event-ID")
    assert "the number of the last event, got 999999999999999" in error["detail"]


def stream(server: Server, mission: str, last: int = 0) -> str:
    connection = http.client.HTTPConnection(urlsplit(server.url).netloc, timeout=HANG_S)
    connection.request("GET", f"{mission}/events", headers={"Last-Event-ID": str(last)})
    text = connection.getresponse().read().decode()
    connection.close()
    return text


def test_a_mission_that_its_client_cancels_ends_with_its_report(server: Server) -> None:
    asked = iter([False] * 9)
    ended = explore(server.url, LogLines(), lambda: next(asked, True))
    assert ended.status is Status.CANCELLED
    assert ended.remaining


def test_a_missing_server_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UsageError, match="can't be reached"):
        explore("http://127.0.0.1:9", LogLines(), patience_s=0.1)
    assert main(["run", "lobby", "--server", "ftp://somewhere"]) == 2
    assert "--server: must be like" in capsys.readouterr().err


def test_waiting_for_a_server_is_reported_and_can_be_interrupted_at_once() -> None:
    command = [sys.executable, "-m", "marsupial.cli.main", "run", "lobby", "--server", "http://127.0.0.1:9"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        told = next(line for line in process.stderr if "trying" in line)
        assert told.startswith("http://127.0.0.1:9 can't be reached (connection refused); trying for 60 s: is `mars")
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=HANG_S)[1] == "interrupted\n"
    assert process.returncode == 130

"""A client of missions: `marsupial run --server` drives our simulator through a service with it.

Whatever breaks on the way to the service is tried again: reports are numbered, so that none is taken twice, and the
stream of events goes on after the last one that came.
"""

from __future__ import annotations

import http.client
import json
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, suppress
from functools import partial
from http import HTTPStatus
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from marsupial.errors import UsageError
from marsupial.formats.loglines import LogDecoder
from marsupial.library.metrics import Summary
from marsupial.library.missions import reachable_area
from marsupial.mission.observer import Observer
from marsupial.mission.placement import place_team
from marsupial.model.mission import MissionEnded, PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.model.strategy import PlanningReport
from marsupial_service.missions.documents import report_of
from marsupial_service.missions.scenarios import mission_document
from marsupial_service.missions.simulated import SimulatedTeam

_TIMEOUT_S = 60.0
_PATIENCE_S = 30.0
_PAUSE_S = 0.2
_BROKEN = (OSError, http.client.HTTPException)
_BUSY = (
    HTTPStatus.TOO_MANY_REQUESTS,
    HTTPStatus.BAD_GATEWAY,
    HTTPStatus.SERVICE_UNAVAILABLE,
    HTTPStatus.GATEWAY_TIMEOUT,
)


class Frame(NamedTuple):
    """An event of a stream as it was sent: its number, from 1, its type, and one line of JSON."""

    id: int
    type: str
    data: str


class ServiceRefusal(Exception):
    """The service refuses; `status` is that of HTTP."""

    def __init__(self, status: int, said: str) -> None:
        super().__init__(f"the service refuses ({status}): {said}")
        self.status = status


class Client:
    """Talks to the service at `url`, like ``http://host:port`` (else UsageError), with an API key if it needs one."""

    def __init__(self, url: str, key: str | None = None) -> None:
        parts = urlsplit(url if "://" in url else f"http://{url}")
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise UsageError(f"--server: must be like http://127.0.0.1:8080, got {url!r}")
        self._url = url
        self._make = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        self._host, self._port = parts.hostname, parts.port
        self._path = parts.path.rstrip("/")
        self._headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._connection: http.client.HTTPConnection | None = None

    def ask(self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None) -> Any:
        """Send a request, again while the connection breaks or the service is busy, and return the JSON it answers.

        Raises ServiceRefusal, or UsageError if it can't be reached for half a minute.
        """
        data = None if body is None else json.dumps(body).encode()
        kind = {} if body is None else {"Content-Type": "application/json"}
        return self._patiently(lambda: self._ask(method, path, data, {**self._headers, **kind, **(headers or {})}))

    def events(self, path: str) -> Iterator[Frame]:
        """Yield the events of a stream up to its `end`, however often it breaks."""
        last = 0
        while True:
            with suppress(*_BROKEN):
                for frame in self._patiently(partial(self._stream, path, last)):
                    last = frame.id
                    yield frame
                    if frame.type == "end":
                        return
            time.sleep(_PAUSE_S)

    def close(self) -> None:
        """Close the connection."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _patiently(self, act: Callable[[], Any]) -> Any:
        until = time.monotonic() + _PATIENCE_S
        while True:
            try:
                return act()
            except _BROKEN as error:
                self.close()
                if time.monotonic() > until:
                    raise UsageError(f"{self._url} can't be reached: {error}") from error
            time.sleep(_PAUSE_S)

    def _ask(self, method: str, path: str, data: bytes | None, headers: Mapping[str, str]) -> Any:
        if self._connection is None:
            self._connection = self._make(self._host, self._port, timeout=_TIMEOUT_S)
        self._connection.request(method, self._path + path, data, headers)
        answer = self._connection.getresponse()
        text = answer.read()
        _check(answer.status, text)
        return json.loads(text)

    def _stream(self, path: str, last: int) -> Iterator[Frame]:
        connection = self._make(self._host, self._port, timeout=_TIMEOUT_S)
        connection.request("GET", self._path + path, headers={**self._headers, "Last-Event-ID": str(last)})
        answer = connection.getresponse()
        if answer.status != HTTPStatus.OK:
            with closing(connection):
                _check(answer.status, answer.read())
        return read_frames(connection, answer)


def _check(status: int, text: bytes) -> None:
    """Raise ServiceRefusal unless all is well, or OSError if it may be well the next time."""
    if status in _BUSY:
        raise OSError(f"busy ({status})")
    if status >= HTTPStatus.BAD_REQUEST:
        try:
            problem = json.loads(text)
            words = "; ".join(f"{error.get('pointer', '')}: {error['detail']}" for error in problem.get("errors", ()))
            said = words or problem["detail"]
        except (ValueError, KeyError, TypeError):
            said = text.decode(errors="replace")[:200]
        raise ServiceRefusal(status, said)


def read_frames(connection: http.client.HTTPConnection, answer: http.client.HTTPResponse) -> Iterator[Frame]:
    """Yield the events of a stream as they come, until it ends; its connection is closed then."""
    fields: dict[str, str] = {}
    with closing(connection):
        while line := answer.readline():
            name, _, value = line.decode().rstrip("\n").partition(":")
            if name:
                fields[name] = value.removeprefix(" ")
            elif "data" in fields:
                yield Frame(int(fields["id"]), fields["event"], fields["data"])
                fields = {}


def simulate_by(
    client: Client,
    scenario: Scenario,
    *,
    strategy: str,
    planner: str,
    budget: Budget,
    seed: int,
    observer: Observer,
    cancelled: Callable[[], bool],
) -> Summary:
    """Run one mission in the simulator here, planned by a service, and return its summary.

    Raises UsageError if the service refuses or can't be reached any more, ScenarioError if the team can't be placed.
    """
    began = time.perf_counter()
    team = place_team(scenario, seed)
    area = reachable_area(scenario, team)
    observer.reachable(area)
    asked = mission_document(scenario, team, area, strategy=strategy, planner=planner, budget=budget, seed=seed)
    try:
        path = client.ask("POST", "/v1/missions", asked, {"Idempotency-Key": uuid.uuid4().hex})["links"]["self"]
        ended, reports = _drive(client, path, scenario, team, observer, cancelled)
    except ServiceRefusal as error:
        raise UsageError(str(error)) from error
    finally:
        client.close()
    return Summary.of(
        scenario,
        strategy=strategy,
        planner=planner,
        seed=seed,
        ended=ended,
        reports=reports,
        analysis_s=None,
        wall_s=time.perf_counter() - began,
    )


def _drive(
    client: Client,
    path: str,
    scenario: Scenario,
    placed: tuple[PlacedRobot, ...],
    observer: Observer,
    cancelled: Callable[[], bool],
) -> tuple[MissionEnded, list[PlanningReport]]:
    """Do what the mission commands and report, until it ends."""
    kinds = {kind.name: kind for kind in scenario.robot_types}
    team = SimulatedTeam(scenario.grid, kinds, placed)
    ended: MissionEnded | None = None
    decoder = LogDecoder()
    reports: list[PlanningReport] = []
    asked_to_end = False
    for _, kind, data in client.events(f"{path}/events"):
        if kind == "log":
            for event in decoder.events(data):
                observer.event(event)
                ended = event if isinstance(event, MissionEnded) else ended
        elif kind == "decision":
            reports.append(report_of(json.loads(data)))
            observer.planned(reports[-1])
        elif kind == "state":
            team.paused = json.loads(data)["state"] == "paused"
        elif kind == "commands":
            report = team.answer(json.loads(data))
            if cancelled() and not asked_to_end:
                asked_to_end = True
                client.ask("POST", f"{path}/cancel")
            if report is not None and not asked_to_end:
                asked_to_end = not _report(client, path, report)
        elif kind == "end" and ended is None:
            raise UsageError(f"the service gave the mission up: {json.loads(data)['reason']}")
    assert ended is not None
    return ended, reports


def _report(client: Client, path: str, report: object) -> bool:
    """Report; return False if the mission wants none any more, as another client has ended it."""
    try:
        client.ask("POST", f"{path}/reports", report)
    except ServiceRefusal as error:
        if error.status == HTTPStatus.CONFLICT and client.ask("GET", path)["state"] in ("cancelling", "ended"):
            return False
        raise
    return True

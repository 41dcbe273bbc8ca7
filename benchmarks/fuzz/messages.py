"""Feed bytes to readers of requests, of the service's answers and of ROS messages."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from functools import cache
from typing import Any
from unittest.mock import patch

import cbor2
import httpx2

from benchmarks.fuzz.examples import yaml_blocks
from benchmarks.fuzz.files import MOST_CELLS, stored
from marsupial.errors import UsageError
from marsupial.model.missionframe import MissionFrame
from marsupial_client import Client, Mission, blocking_session
from marsupial_client.http import address
from marsupial_ros.fleet import RobotFleet
from marsupial_ros.journal import Journal, Record
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.ros_listener import Clock, RosListener
from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.settings import Settings, read_settings
from marsupial_ros.transforms import Frames
from marsupial_service.examples.demos import EXAMPLES
from marsupial_service.http.answers import answer
from marsupial_service.intake.jobs import ANALYSIS_READER, JOB_READER, VALIDATION_READER
from marsupial_service.intake.missions import MISSION_READER, REPORT_READER, brief_of
from marsupial_service.intake.reading import BodyReader, read_in_process
from marsupial_service.intake.simulations import SIMULATION_READER
from marsupial_service.problems import HttpProblem
from marsupial_service.routes.parameters import wait_seconds
from marsupial_service.schemas.missions import MissionBody
from marsupial_service.settings import ServiceLimits, limits_from

LIMITS = ServiceLimits(cells=MOST_CELLS // 10)

# -- the service -----------------------------------------------------------------------------------------------------


@cache
def _given(path: str) -> tuple[BodyReader[Any, Any], tuple[Any, ...]]:
    """Return the reader of a body, and its further arguments."""
    if path.endswith("/reports"):
        brief = brief_of(MissionBody.model_validate(EXAMPLES["/v1/missions"]()), LIMITS, {})
        return REPORT_READER, (brief, MissionFrame.of(brief.grid))
    readers: dict[str, tuple[BodyReader[Any, Any], tuple[Any, ...]]] = {
        "/v1/jobs": (JOB_READER, ({},)),
        "/v1/analysis": (ANALYSIS_READER, ()),
        "/v1/validations": (VALIDATION_READER, ()),
        "/v1/missions": (MISSION_READER, ({},)),
        "/v1/simulations": (SIMULATION_READER, ({},)),
    }
    return readers[path]


def body(data: bytes, *, path: str) -> None:
    """Read a body, and build the answer if it is wrong."""
    reading, more = _given(path)
    status = 200
    try:
        read_in_process((data, reading, LIMITS, more))
    except HttpProblem as problem:
        status = answer(problem, path).status_code
    assert status < 500


def bodies(path: str) -> list[bytes]:
    """Return the example of the OpenAPI document."""
    return [json.dumps(EXAMPLES[path]()).encode()]


def operator_words(text: str) -> None:
    """Read operators' settings and the headers of requests."""
    name, _, value = text.partition("=")
    for read in (
        lambda: limits_from({}, {name: value}),
        lambda: limits_from({f"MARSUPIAL_{name}": value, "MARSUPIAL_CELLS": value}),
        lambda: wait_seconds(text, 30.0),
    ):
        with suppress(UsageError):
            read()
    with suppress(ValueError):
        address(text)


# -- the client ------------------------------------------------------------------------------------------------------


class _Answers(httpx2.Client):
    """Gets `answer` at once: what httpx2 does about a request takes longer than reading its answer."""

    answer: httpx2.Response

    def build_request(self, *_: Any, **__: Any) -> httpx2.Request:
        return _REQUEST

    def send(self, request: httpx2.Request, **_: Any) -> httpx2.Response:
        self.answer.request = request
        return self.answer


_REQUEST, _HTTP = httpx2.Request("GET", "http://host"), _Answers()


@contextmanager
def _answering(answer: httpx2.Response) -> Iterator[Client]:
    """Yield a client that gets an answer and whose clock stands still: without patience it tries once."""
    _HTTP.answer = answer
    with patch.object(blocking_session, "monotonic", lambda: 0.0):
        yield _client()


@cache
def _client() -> Client:
    return Client("http://host", patience_s=0, http=_HTTP)


@cache
def _mission() -> Mission:
    document = {"id": "m", "n": 0, "links": {"self": "/m", "events": "/m/events"}}
    with _answering(httpx2.Response(200, json=document)) as client:
        return client.mission("m")


def stream(data: bytes) -> None:
    """Read the events of a mission from a stream."""
    mission = _mission()
    with _answering(httpx2.Response(200, content=data, headers={"Content-Type": "text/event-stream"})):
        list(mission.events())


def refusal(data: bytes) -> None:
    """Read an answer: a line with its status and the time to retry, then its text."""
    first, _, text = data.partition(b"\n")
    status, _, again = first.partition(b" ")
    code = int(status) if status.isdigit() and len(status) == 3 else 503
    headers = {"Retry-After": again.decode("latin-1")} if again.isascii() and again.isalnum() else {}
    with _answering(httpx2.Response(max(200, min(code, 599)), content=text, headers=headers)) as client:
        client.ask("GET", "/v1/jobs")


# -- ROS -------------------------------------------------------------------------------------------------------------


@cache
def _ros_settings() -> Settings:
    return replace(read_settings(stored(ros_settings()[0], "fleet.yaml")), clock="/clock")


def settings(data: bytes) -> None:
    """Read the settings of the bridge."""
    read_settings(stored(data, "settings.yaml"))


def journal(data: bytes) -> None:
    """Read a bridge's stored state of its mission."""
    Journal(stored(data, "state.json")).read()


def rosbridge(data: bytes, *, packed: bool) -> None:
    """Read messages as rosbridge sends them: texts, one a line, or one in CBOR after a first map."""
    known, said = _ros_settings(), list[str]()
    frames = {robot.tf: Frames() for robot in known.robots} | {"/tf": Frames()}
    tracker = MapTracker(known.terrains, known.map.masks, known.map.free_thresh, known.map.occupied_thresh)
    line = Rosbridge("ws://host", [])
    fleet = RobotFleet(known, frames, tracker, line, said.append)
    line._listener = RosListener(known, frames, tracker, Clock(simulated=True), fleet, said.append, line.name)
    for one in [messages(packed=True)[0], data] if packed else data.splitlines():
        with suppress(UnicodeDecodeError):
            line._take(one if packed else one.decode())
        frames["/tf"].find("carrier1/base_link", "map")
        assert tracker.grid is None or tracker.grid.cells.size


def ros_settings() -> list[bytes]:
    """Return the example of the documentation."""
    return yaml_blocks("docs/ros.md")


def messages(*, packed: bool) -> list[bytes]:
    """Return one message of each kind, each a line of one text, or each as CBOR."""
    at = {"x": 0.5, "y": 1.0, "z": 0.0}
    turned = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    origin = {"position": at, "orientation": turned}
    info = {"resolution": 0.05, "width": 3, "height": 2, "origin": origin}
    link = {"header": {"frame_id": "map"}, "child_frame_id": "carrier1/base_link"}
    told: list[tuple[str, Mapping[str, Any]]] = [
        ("/map", {"info": info, "data": [0, 100, -1, 0, 0, 50]}),
        ("/map_updates", {"x": 1, "y": 0, "width": 1, "height": 2, "data": [0, 100]}),
        ("/tf", {"transforms": [{**link, "transform": {"translation": at, "rotation": turned}}]}),
        ("/clock", {"clock": {"sec": 12, "nanosec": 500}}),
    ]
    sent: list[dict[str, Any]] = [{"op": "publish", "topic": topic, "msg": message} for topic, message in told]
    sent += [
        {"op": "action_result", "id": "g", "status": 4, "values": {"success": True}, "result": True},
        {"op": "status", "level": "error", "msg": "no such topic"},
        {"op": "fragment", "id": "f", "num": 0, "total": 1, "data": json.dumps({"op": "status", "level": "warning"})},
    ]
    if not packed:
        return [b"\n".join(json.dumps(one).encode() for one in sent)]
    typed = {"op": "publish", "topic": "/map", "msg": {"info": info, "data": cbor2.CBORTag(72, bytes(6))}}
    return [cbor2.dumps(one) for one in (*sent, typed)]


def events() -> list[bytes]:
    """Return streams as the service sends them."""
    return [
        b'id: 1\nevent: log\ndata: {"event":"mission"}\n\nid: 2\nevent: commands\ndata: {"batch": 1}\n\n'
        b'id: 3\nevent: end\ndata: {"status": "complete"}\n\n',
        b": still there\n\n"
        b"id:7\nevent:state\ndata:{\ndata:}\n\nretry: 10\r\n\r\nevent: news\ndata\n\nid: 8\nevent: end\n\n",
    ]


def answers() -> list[bytes]:
    """Return answers of the service and of proxies."""
    problem = {
        "type": "urn:marsupial:problem:invalid", "title": "no", "status": 422, "detail": "is wrong", "instance": "/v1",
        "errors": [{"pointer": "/team/0", "detail": "missing"}],
    }  # fmt: skip
    return [
        b"422 0\n" + json.dumps(problem).encode(),
        b"503 5\n<html>busy</html>",
        b'200 0\n{"jobs": []}',
        b'429 9\n{"status": 429, "detail": "wait", "errors": []}',
    ]


def journals() -> list[bytes]:
    """Return a bridge's stored states of its mission."""
    return [
        json.dumps(
            {"version": 1, **asdict(Record(mission="m", frame={"width": 3, "height": 2, "origin_m": [0, 0, 0]}))}
        ).encode()
    ]

"""The client retries failures, here on a fake clock, and raises refusals."""

import itertools
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import aclosing
from typing import Any

import httpx2
import pytest

from marsupial_client import (
    AsyncClient,
    Busy,
    Client,
    ClientError,
    Conflict,
    Invalid,
    Mission,
    NotFound,
    Refused,
    Unreachable,
    blocking_session,
)
from marsupial_client.errors import REFUSALS
from marsupial_client.http import LONGEST_PAUSE_S
from marsupial_service.problems import KINDS

URL = "http://robots.example/plans"
OK = httpx2.Response(200, json={"well": True})
LINKS = {name: f"/v1/missions/m/{name}" for name in ("reports", "events", "cancel")} | {"self": "/v1/missions/m"}
EVENTS = {"Content-Type": "text/event-stream"}
MISSION = {"id": "m", "n": 4, "state": "running", "links": LINKS}

Answer = httpx2.Response | Exception


PAUSES: list[float] = []
"""The client's pauses, in which the fake clock advances."""


@pytest.fixture(autouse=True)
def _clock(monkeypatch: pytest.MonkeyPatch) -> None:
    PAUSES.clear()
    monkeypatch.setattr(blocking_session, "sleep", PAUSES.append)
    monkeypatch.setattr(blocking_session, "monotonic", lambda: sum(PAUSES))


class Scripted(httpx2.MockTransport):
    """A transport with scripted answers."""

    def __init__(self, *answers: Answer) -> None:
        super().__init__(self._answer)
        self.requests: list[httpx2.Request] = []
        self._answers = list(answers)

    def _answer(self, request: httpx2.Request) -> httpx2.Response:
        self.requests.append(request)
        answer = self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer


def service(transport: Scripted, patience_s: float = 60.0, missed: list[str] | None = None) -> Client:
    callback = None if missed is None else lambda error: missed.append(str(error))
    http = httpx2.Client(transport=transport)
    return Client(URL, key="secret", timeout_s=1.0, patience_s=patience_s, on_outage=callback, http=http)


def problem(status: int, kind: str, **more: Any) -> httpx2.Response:
    told = {"type": f"urn:marsupial:problem:{kind}", "title": "t", "status": status, "detail": "d", "instance": "/"}
    return httpx2.Response(status, json=told | more)


def broken() -> Exception:
    return httpx2.ReadError("cut")


@pytest.mark.parametrize(
    "failure",
    [
        httpx2.ConnectError("refused"),
        httpx2.ReadTimeout(""),
        httpx2.RemoteProtocolError("cut"),
        httpx2.Response(502, text="<html>Bad Gateway</html>"),
        httpx2.Response(504),
        problem(408, "too-slow"),
        problem(429, "too-many"),
        problem(503, "not-ready"),
        httpx2.Response(200, text='{"cut": '),
    ],
)
def test_failures_are_retried_after_growing_pauses(failure: Answer) -> None:
    transport = Scripted(*[failure] * 7, OK)
    assert service(transport).ask("POST", "/v1/jobs", {"a": 1}) == {"well": True}
    assert len(transport.requests) == 8
    assert {request.content for request in transport.requests} == {b'{"a": 1}'}
    assert 0.05 <= PAUSES[0] <= 0.1
    assert PAUSES[4] > PAUSES[0] * 4
    assert max(PAUSES) <= LONGEST_PAUSE_S


def test_retry_after_is_respected_but_a_zero_still_means_a_pause() -> None:
    busy, at_once = (httpx2.Response(503, headers={"Retry-After": after}) for after in ("7", "0"))
    service(Scripted(busy, busy, OK)).ask("GET", "/v1/limits")
    assert PAUSES == [7.0, 7.0]
    service(Scripted(*[at_once] * 9, OK)).ask("GET", "/v1/limits")
    assert sum(PAUSES[2:]) > 3.0


def test_a_service_busy_for_longer_than_the_patience_raises_at_once() -> None:
    transport = Scripted(httpx2.Response(429, headers={"Retry-After": "3600"}))
    with pytest.raises(Busy) as caught:
        service(transport).ask("GET", "/v1/limits")
    assert (caught.value.retry_after_s, caught.value.status, PAUSES) == (3600.0, 429, [])


@pytest.mark.parametrize(("failure", "error"), [(broken(), Unreachable), (problem(503, "not-ready"), Busy)])
def test_patience_ends(failure: Answer, error: type[Exception]) -> None:
    transport = Scripted(failure)
    with pytest.raises(error):
        service(transport, patience_s=10.0).ask("GET", "/v1/limits")
    assert sum(PAUSES) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("failure", "told"),
    [
        (httpx2.ConnectError("[Errno 111] Connection refused"), f"{URL} can't be reached (connection refused)"),
        (problem(503, "not-ready"), "the service refused the request (503): d"),
    ],
)
def test_the_callback_is_called_once_per_outage(failure: Answer, told: str) -> None:
    missed: list[str] = []
    transport = Scripted(*[failure] * 9, OK, *[failure] * 2, OK, *[failure] * 9, OK)
    asked = service(transport, missed=missed)
    counts = []
    for _ in range(3):
        asked.ask("GET", "/v1/limits")
        counts.append(len(missed))
    assert counts == [1, 1, 2]
    assert set(missed) == {told}


def test_a_refusal_has_its_problem_and_is_not_retried() -> None:
    errors = [{"pointer": "/team/0", "detail": "stands in a wall"}, {"query": "limit", "detail": "too large"}]
    transport = Scripted(problem(422, "invalid", errors=errors))
    with pytest.raises(Invalid, match=r"422.*: /team/0: stands in a wall; limit: too large") as caught:
        service(transport).ask("POST", "/v1/missions", {})
    assert (caught.value.type, caught.value.detail) == ("urn:marsupial:problem:invalid", "d")
    assert (list(caught.value.errors), len(transport.requests)) == (errors, 1)


@pytest.mark.parametrize("kind", KINDS)
def test_every_problem_of_the_service_has_its_exception(kind: str) -> None:
    status = KINDS[kind].status
    with pytest.raises(Refused) as caught:
        service(Scripted(problem(status, kind)), patience_s=0.0).ask("GET", "/")
    assert type(caught.value) is REFUSALS.get(status, Refused)
    assert caught.value.type.endswith(kind)
    assert (type(caught.value) is Refused) == (status in (405, 406, 415, 421))


@pytest.mark.parametrize(
    "text",
    ["<html>no</html>", "", "[]", '{"detail": 4}', '{"status": 404}', "[" * 100_000]
    + [f'{{"status": 404, "detail": "no", "errors": {errors}}}' for errors in ("null", "{}", "[1]", '[{"detail": 1}]')],
)
def test_a_refusal_without_a_problem_document_raises_the_same(text: str) -> None:
    with pytest.raises(NotFound) as caught:
        service(Scripted(httpx2.Response(404, text=text))).ask("GET", "/v1/x")
    assert (caught.value.type, caught.value.status, caught.value.problem["instance"]) == ("about:blank", 404, "/v1/x")


def test_an_answer_that_is_nested_too_deep_is_not_json() -> None:
    transport = Scripted(httpx2.Response(200, text="[" * 100_000))
    with pytest.raises(Unreachable, match="is not JSON"):
        service(transport, patience_s=0.0).ask("GET", "/")


def test_one_request_has_one_idempotency_key_and_two_have_two() -> None:
    transport = Scripted(broken(), broken(), httpx2.Response(202, json=MISSION))
    asked = service(transport)
    asked.submit({})
    asked.submit({})
    asked.begin({}, "mine")  # type: ignore[typeddict-item]
    keys = [request.headers["Idempotency-Key"] for request in transport.requests]
    assert (len(set(keys[:3])), len(set(keys)), keys[4]) == (1, 3, "mine")
    assert {request.headers["Authorization"] for request in transport.requests} == {"Bearer secret"}
    assert {str(request.url) for request in transport.requests[:4]} == {f"{URL}/v1/jobs"}


@pytest.mark.parametrize("url", ["ftp://somewhere", "http://", "://", "http://a b:x"])
def test_an_invalid_address_is_reported(url: str) -> None:
    with pytest.raises(ValueError, match="must be like"):
        Client(url)
    with pytest.raises(ValueError, match="must be like"):
        AsyncClient(url)


def stream(*events: tuple[int, str], rest: str = "") -> httpx2.Response:
    text = ": events\n\n" + "".join(f'id: {n}\nevent: {kind}\ndata: {{"n":{n}}}\n\n' for n, kind in events) + rest
    return httpx2.Response(200, text=text, headers=EVENTS)


def followed(transport: Scripted, after: int = 0, missed: list[str] | None = None) -> list[tuple[int, str]]:
    mission = Mission(service(transport, missed=missed)._session, MISSION)  # type: ignore[arg-type]
    return [(event.id, event.type) for event in mission.events(after)]


def test_a_stream_resumes_after_the_last_event_and_yields_each_once() -> None:
    transport = Scripted(
        stream((3, "log"), (4, "commands"), rest="id: 5\nevent: log\ndata: {"),
        broken(),
        stream((4, "commands"), (5, "state"), (6, "of the future")),
        httpx2.Response(200, text="<html>", headers={"Content-Type": "text/html"}),
        stream((7, "end"), (8, "log")),
    )
    assert followed(transport, after=2) == [(3, "log"), (4, "commands"), (5, "state"), (7, "end")]
    asked = [request.headers["Last-Event-ID"] for request in transport.requests]
    assert asked == ["2", "4", "4", "6", "6"]


def test_streams_that_end_at_once_are_retried_with_pauses_and_given_up() -> None:
    missed: list[str] = []
    transport = Scripted(*[stream()] * 10, stream((1, "end")))
    assert followed(transport, missed=missed) == [(1, "end")]
    assert sum(PAUSES) > 5.0
    assert missed == [f"{URL} can't be reached (the stream ended early)"]
    with pytest.raises(Unreachable, match="ended early"):
        followed(Scripted(stream()))


def test_a_long_silent_stream_counts_as_working() -> None:
    class Silent(httpx2.SyncByteStream):
        def __iter__(self) -> Iterator[bytes]:
            PAUSES.append(3600.0)
            yield b": still there\n\n"

    transport = Scripted(*[httpx2.Response(200, stream=Silent(), headers=EVENTS) for _ in range(3)], stream((1, "end")))
    assert followed(transport) == [(1, "end")]


@pytest.mark.parametrize("number", ["", "one", "-1", "²", "9" * 5000])
def test_a_stream_whose_events_have_no_numbers_is_resumed(number: str) -> None:
    text = f"id: {number}\nevent: state\ndata: {{}}\n\n"
    broken_one = httpx2.Response(200, text=text, headers=EVENTS)
    assert followed(Scripted(broken_one, stream((1, "end")))) == [(1, "end")]


def test_event_data_that_is_not_json_raises() -> None:
    text = "id: 1\nevent: state\ndata: {broken\n\n"
    with pytest.raises(ClientError, match=r"event 1 \(state\) is not JSON"):
        followed(Scripted(httpx2.Response(200, text=text, headers=EVENTS)))


def test_an_answer_that_trickles_in_is_given_up_when_patience_ends() -> None:
    class Dripping(httpx2.SyncByteStream):
        def __iter__(self) -> Iterator[bytes]:
            for _ in range(1000):
                PAUSES.append(0.9)  # each single read is in time
                yield b" "

    transport = Scripted(httpx2.Response(200, stream=Dripping()))
    with pytest.raises(Unreachable, match="takes longer than 60 s to answer /readyz"):
        service(transport).ready()
    assert sum(PAUSES) < 62


def test_a_stream_without_content_is_over_and_a_refused_one_raises() -> None:
    assert followed(Scripted(httpx2.Response(204)), after=9) == []
    with pytest.raises(NotFound):
        followed(Scripted(problem(404, "not-found")))


def sent(transport: Scripted) -> list[tuple[int, int]]:
    """Return number and time of each report."""
    reports = [json.loads(request.content) for request in transport.requests if request.method == "POST"]
    return [(report["n"], report["t_ms"]) for report in reports]


def accepted(n: int) -> httpx2.Response:
    return httpx2.Response(200, json={"n": n, "t_ms": 0, "revision": 1})


def report(mission: Mission, t_ms: int) -> Any:
    return mission.report({"t_ms": t_ms})


def mission_of(transport: Scripted, patience_s: float = 60.0) -> Mission:
    return Mission(service(transport, patience_s)._session, MISSION)  # type: ignore[arg-type]


def test_a_report_that_may_have_arrived_is_sent_again_before_the_next_one() -> None:
    transport = Scripted(broken(), accepted(5), accepted(6))
    mission = mission_of(transport, patience_s=0.0)
    with pytest.raises(Unreachable):
        report(mission, 10)
    assert mission.n == 4
    report(mission, 20)
    assert (sent(transport), mission.n) == ([(5, 10), (5, 10), (6, 20)], 6)


def test_the_number_of_a_report_that_is_refused_is_free_again() -> None:
    transport = Scripted(problem(422, "invalid"), accepted(5))
    mission = mission_of(transport)
    with pytest.raises(Invalid):
        report(mission, 10)
    report(mission, 20)
    assert sent(transport) == [(5, 10), (5, 20)]


@pytest.mark.parametrize(("state", "over"), [("running", False), ("cancelling", True), ("ended", True)])
def test_a_report_for_a_mission_that_is_over_is_no_error(state: str, over: bool) -> None:
    mission = mission_of(Scripted(problem(409, "conflict"), httpx2.Response(200, json={**MISSION, "state": state})))
    if over:
        assert report(mission, 10) is None
    else:
        with pytest.raises(Conflict):
            report(mission, 10)


def batch_taken(*numbers: tuple[str | None, int]) -> httpx2.Response:
    told = [{"n": n, "t_ms": 0, "revision": 1} | ({} if robot is None else {"robot": robot}) for robot, n in numbers]
    return httpx2.Response(200, json={"reports": told})


BATCH: list[Any] = [{"t_ms": 1}, {"t_ms": 2, "robot": "joey"}, {"t_ms": 3, "robot": "joey"}, {"t_ms": 4}]
LAST = httpx2.Response(200, json={"n": 4, "t_ms": 0, "robots": {"joey": 7}})
ALL_TAKEN = batch_taken((None, 5), ("joey", 8), ("joey", 9), (None, 6))


def batches(transport: Scripted) -> list[list[tuple[str | None, int]]]:
    """Return robot and number of each report of each batch."""
    bodies = [json.loads(request.content) for request in transport.requests if request.method == "POST"]
    return [[(one.get("robot"), one["n"]) for one in body["reports"]] for body in bodies]


def test_reports_of_a_batch_are_numbered_by_reporter() -> None:
    transport = Scripted(LAST, ALL_TAKEN, batch_taken(("joey", 10)))
    mission = mission_of(transport)
    assert [one["n"] for one in mission.reports(BATCH) or ()] == [5, 8, 9, 6]
    mission.reports(BATCH[1:2])
    assert batches(transport) == [[(None, 5), ("joey", 8), ("joey", 9), (None, 6)], [("joey", 10)]]
    assert (mission.n, mission.robots) == (6, {"joey": 10})
    assert [request.method for request in transport.requests] == ["GET", "POST", "POST"]


def test_a_batch_that_may_have_arrived_is_resent_unchanged_before_the_next() -> None:
    transport = Scripted(LAST, broken(), ALL_TAKEN, accepted(7))
    mission = mission_of(transport, patience_s=0.0)
    with pytest.raises(Unreachable):
        mission.reports(BATCH)
    assert (mission.n, mission.robots) == (4, {"joey": 7})
    report(mission, 20)
    assert transport.requests[1].content == transport.requests[2].content
    assert json.loads(transport.requests[3].content) == {"n": 7, "t_ms": 20}


def test_the_numbers_of_a_batch_that_is_refused_are_free_again() -> None:
    transport = Scripted(LAST, problem(422, "invalid"), ALL_TAKEN)
    mission = mission_of(transport)
    with pytest.raises(Invalid):
        mission.reports(BATCH)
    mission.reports(BATCH)
    first, second = batches(transport)
    assert first == second


def test_an_empty_batch_is_not_sent() -> None:
    transport = Scripted(OK)
    assert (mission_of(transport).reports([]), transport.requests) == ([], [])


async def test_leaving_a_loop_over_plans_closes_its_stream() -> None:
    closed: list[bool] = []

    class Endless(httpx2.AsyncByteStream):
        async def __aiter__(self) -> AsyncIterator[bytes]:
            for number in itertools.count(1):
                yield f'id: {number}\nevent: plan\ndata: {{"revision":{number}}}\n\n'.encode()

        async def aclose(self) -> None:
            closed.append(True)

    async def answer(request: httpx2.Request) -> httpx2.Response:
        if request.url.path.endswith("/events"):
            return httpx2.Response(200, stream=Endless(), headers=EVENTS)
        return httpx2.Response(200, json={"id": "j", "links": {"events": "/v1/jobs/j/events"}})

    found = []
    async with AsyncClient(URL, http=httpx2.AsyncClient(transport=httpx2.MockTransport(answer))) as asked:
        plans = (await asked.job("j")).plans()
        async with aclosing(plans):
            async for plan in plans:
                found.append(plan["revision"])
                if len(found) == 3:
                    break
    assert (found, closed) == ([1, 2, 3], [True])

"""HEAD answers as GET does, without the body."""

import httpx
from support.services.servers import Server
from support.waiting import wait_until

CHANGING = {"date", "x-request-id", "transfer-encoding", "content-length"}
"""Headers that may differ: lengths of metrics and of chunked answers do."""


def test_every_get_route_answers_head_with_the_same_headers_and_no_body(server: Server, http: httpx.Client) -> None:
    server.wait_ready()
    job = http.post("/v1/jobs", json=http.get("/v1/demo-data/yard").json(), headers={"Prefer": "wait=60"}).json()["id"]
    paths = [path for path, routes in http.get("/openapi.json").json()["paths"].items() if "get" in routes]
    filled = [path.replace("{job}", job).replace("{mission}", "none").replace("{name}", "yard") for path in paths]
    for path in ("/", "/docs", "/openapi.json", "/page/live/live.js", "/nowhere", *filled):
        expected, found = http.get(path), http.head(path)
        assert found.status_code == expected.status_code, path
        assert found.content == b""
        assert {**found.headers, **dict.fromkeys(CHANGING)} == {**expected.headers, **dict.fromkeys(CHANGING)}, path
    assert http.head("/healthz").headers["content-length"] == http.get("/healthz").headers["content-length"]


def test_head_of_a_stream_that_goes_on_ends_at_once(http: httpx.Client) -> None:
    body = {**http.get("/v1/demo-data/office-6x3").json(), "planner": "anytime", "budget": {"seconds": 120}}
    links = http.post("/v1/jobs", json=body).json()["links"]
    found = http.head(links["events"])
    assert (found.status_code, found.headers["content-type"]) == (200, "text/event-stream; charset=utf-8")
    wait_until(lambda: "marsupial_event_streams 0.0" in http.get("/metrics").text, "the end of the stream")
    http.post(links["cancel"])

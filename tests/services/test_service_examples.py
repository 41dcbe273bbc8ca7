from __future__ import annotations

import httpx


def test_the_document_says_which_events_there_are(http: httpx.Client) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    found = {
        tag: {one["properties"]["event"]["const"] for one in schema["oneOf"]}
        for tag, path in (("jobs", "/v1/jobs/{job}/events"), ("missions", "/v1/missions/{mission}/events"))
        for schema in [paths[path]["get"]["responses"]["200"]["content"]["text/event-stream"]["itemSchema"]]
    }
    assert found == {
        "jobs": {"state", "plan", "end"},
        "missions": {"state", "commands", "decision", "log", "frame", "quota", "end"},
    }

from __future__ import annotations

import httpx


def test_every_example_of_the_document_is_taken(http: httpx.Client) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    mission = http.post("/v1/missions", json=example(paths, "/v1/missions")).json()
    assert {name for name, path in paths.items() if "requestBody" in path.get("post", {})} >= {"/v1/jobs"}
    for name, path in paths.items():
        if "requestBody" in path.get("post", {}):
            answer = http.post(name.replace("{mission}", mission["id"]), json=example(paths, name))
            assert answer.status_code < 300, (name, answer.text)
    assert http.get(mission["links"]["self"]).json()["n"] == 1


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


def example(paths: dict[str, dict[str, dict[str, dict[str, dict[str, dict[str, object]]]]]], name: str) -> object:
    return paths[name]["post"]["requestBody"]["content"]["application/json"]["example"]

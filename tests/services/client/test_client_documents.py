"""The generated files of the client are current, and its events are those of the service."""

import json
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from support.services.servers import Server

import generate_api as generate
from marsupial_client import Client
from marsupial_client.events import JOB_EVENTS, MISSION_EVENTS
from marsupial_service.http.openapi import stored_text
from marsupial_service.schemas import events
from marsupial_service.schemas.enums import EventType, JobEventType


@pytest.mark.parametrize("file", ["blocking_client.py", "blocking_session.py", "documents.py", "mission_documents.py"])
def test_a_generated_file_is_current(file: str) -> None:
    kept = (generate.CLIENT / file).read_text(encoding="utf-8")
    assert kept == generate.client_files()[file], "run `make generated`"


def test_the_types_of_events_are_those_of_the_service() -> None:
    assert (set(JOB_EVENTS), set(MISSION_EVENTS)) == (set(JobEventType), set(EventType))


def test_the_events_of_a_job_match_their_schemas(server: Server) -> None:
    document: dict[str, Any] = json.loads(stored_text())
    seen = set()
    with Client(server.url) as client:
        job = client.submit({**client.demo("yard"), "budget": {"seconds": 0.3}})
        for event in job.events():
            schema = {"$ref": f"#/components/schemas/{events.JOB_EVENTS[JobEventType(event.type)].__name__}"}
            Draft202012Validator({**schema, "components": document["components"]}).validate(event.data)
            seen.add(event.type)
    assert seen == set(JobEventType)

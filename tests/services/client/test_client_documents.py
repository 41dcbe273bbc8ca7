"""The typed dicts of the client say what the OpenAPI document says, and what really comes out of streams."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired, Union, get_args, get_origin, get_type_hints, is_typeddict

import pytest
from mission_house import body, team
from servers import Server

from marsupial_client import Client, documents, mission_documents
from marsupial_client.events import JOB_EVENTS, MISSION_EVENTS
from marsupial_service.http.openapi import kept_text
from marsupial_service.missions.records import MissionPhase
from marsupial_service.schemas.words import EventType, JobEventType

SCHEMAS: dict[str, dict[str, Any]] = json.loads(kept_text())["components"]["schemas"]

SCHEMA_OF = {
    "Action": "Action",
    "ActionsPlan": "ActionsPlan",
    "Analysis": "Analysis",
    "Batch": "BatchBody",
    "Brief": "MissionBody",
    "Budget": "Budget",
    "CarrierType": "CarrierTypeBody",
    "Energy": "EnergyBody",
    "Failed": "FailedBody",
    "Feature": "Feature",
    "Frame": "FrameBody",
    "FrameGrown": "FrameData",
    "Geometry": "Geometry",
    "Goal": "GoalBody",
    "JobDocument": "Job",
    "JobLinks": "JobLinks",
    "KnownMap": "KnownMap",
    "LastReports": "LastReports",
    "Lost": "LostBody",
    "MapRuns": "MapRunsBody",
    "Member": "MemberBody",
    "MissionDocument": "Mission",
    "MissionLinks": "MissionLinks",
    "Plan": "Plan",
    "Problem": "Problem",
    "ProblemDetail": "ProblemDetail",
    "QuotaTold": "QuotaData",
    "Ready": "Ready",
    "Report": "ReportBody",
    "ReportFrame": "ReportFrameBody",
    "Revealed": "RevealedBody",
    "RobotNote": "RobotNoteBody",
    "RoverType": "RoverTypeBody",
    "Taken": "Taken",
    "SimulationDocument": "Simulation",
    "Terrain": "TerrainBody",
    "TextPlan": "TextPlan",
    "Verdict": "Verdict",
    "Violation": "Violation",
}
EVENTS = ("PlanFound", "JobMoved", "JobEnded", "Commands", "Command", "Decision", "MissionMoved", "MissionEnded")
UNLIKE = ("JobRequest", "News", "_RobotType")
"""A union in the OpenAPI document; a report without its number; what two types share."""

SIMPLE: Mapping[Any, str] = {int: "integer", float: "number", str: "string", bool: "boolean", Any: "anything"}
ONE_TYPE: Mapping[str, str] = {"ActionBody": "Action", "SecondsBudget": "Budget", "StepsBudget": "Budget"}
"""Requests that have the fields of an answer, and unions that are one typed dict."""


def typed_dicts() -> dict[str, Any]:
    both = {**vars(documents), **vars(mission_documents)}
    return {name: value for name, value in both.items() if is_typeddict(value)}


def of_type(hint: Any) -> Any:
    """Return what a type hint allows, in the words of `of_schema`."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint in SIMPLE:
        return SIMPLE[hint]
    if hint is type(None):
        return "null"
    if is_typeddict(hint):
        return hint.__name__
    if origin is NotRequired:
        return of_type(arguments[0])
    if origin is Literal:
        return frozenset(arguments)
    if origin in (Union, types.UnionType):
        return frozenset(of_type(argument) for argument in arguments)
    if origin in (list, Sequence):
        return ("array", of_type(arguments[0]))
    assert origin in (dict, Mapping), hint
    return "object"


def of_schema(schema: Mapping[str, Any]) -> Any:
    """Return what a schema allows: the name of a typed dict, a simple type, words, an array, or a set of these."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return ONE_TYPE.get(name) or next(ours for ours, theirs in SCHEMA_OF.items() if theirs == name)
    for union in ("anyOf", "oneOf"):
        if union in schema:
            found = frozenset(of_schema(variant) for variant in schema[union])
            return found if len(found) > 1 else next(iter(found))
    if "enum" in schema or "const" in schema:
        return frozenset(schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        return ("array", of_schema(schema["items"]))
    return schema.get("type", "anything")


def same(ours: Any, theirs: Any) -> bool:
    """Say whether a type allows what a schema allows; words that a plain text is documented to be are allowed for."""
    if isinstance(ours, frozenset) and isinstance(theirs, frozenset) and ours != theirs:
        flat = frozenset().union(*(part if isinstance(part, frozenset) else {part} for part in theirs))
        return frozenset().union(*(part if isinstance(part, frozenset) else {part} for part in ours)) == flat
    return bool(ours == theirs) or (theirs == "string" and isinstance(ours, frozenset))


def test_every_typed_dict_is_compared() -> None:
    assert typed_dicts().keys() == {*SCHEMA_OF, *EVENTS, *UNLIKE}


@pytest.mark.parametrize("name", SCHEMA_OF)
def test_a_typed_dict_has_the_fields_of_its_schema(name: str) -> None:
    ours, theirs = typed_dicts()[name], SCHEMAS[SCHEMA_OF[name]]
    assert ours.__required_keys__ == set(theirs.get("required", ()))
    hints = get_type_hints(ours, include_extras=True)
    assert hints.keys() == theirs["properties"].keys()
    unlike = {
        field: (of_type(hints[field]), of_schema(schema))
        for field, schema in theirs["properties"].items()
        if not same(of_type(hints[field]), of_schema(schema))
    }
    assert unlike == {}


def test_a_job_request_has_the_fields_of_both_its_schemas() -> None:
    both = SCHEMAS["SituationJobBody"]["properties"].keys() | SCHEMAS["MapStateJobBody"]["properties"].keys()
    assert documents.JobRequest.__annotations__.keys() == both


def test_the_phases_of_missions_and_the_types_of_events_are_those_of_the_service() -> None:
    assert set(get_args(mission_documents.MissionPhase)) == set(MissionPhase)
    assert (set(JOB_EVENTS), set(MISSION_EVENTS)) == (set(JobEventType), set(EventType))


def test_events_hold_what_their_types_say(server: Server) -> None:
    kinds = typed_dicts()
    with Client(server.url) as client:
        of_job = {"plan": "PlanFound", "state": "JobMoved", "end": "JobEnded"}
        job = client.submit({**client.demo("yard"), "budget": {"seconds": 0.3}})
        told = [(of_job[event.type], event.data) for event in job.events()]
        of_mission = {
            "commands": "Commands",
            "decision": "Decision",
            "state": "MissionMoved",
            "end": "MissionEnded",
        }
        mission, robots = client.begin(body()), team()
        mission.pause()
        mission.resume()
        for event in mission.events():
            if event.type != "log":
                told.append((of_mission[event.type], event.data))
            if event.type == "commands" and (report := robots.answer(event.data)) is not None:
                mission.report(report)
                told += [("Command", command) for command in event.data["commands"]]
            if event.type == "commands" and mission.n == 30:
                mission.cancel()
    assert {name for name, _ in told} == set(EVENTS)
    for name, data in told:
        assert kinds[name].__required_keys__ <= data.keys() <= kinds[name].__annotations__.keys(), (name, data)
        for field, hint in get_type_hints(kinds[name], include_extras=True).items():
            assert field not in data or fits(data[field], of_type(hint)), (name, field, data[field])


def fits(value: Any, allowed: Any) -> bool:
    """Say whether a value of JSON is one of a type, in the words of `of_type`."""
    if isinstance(allowed, frozenset):
        return any(fits(value, one) if one in (*SIMPLE.values(), "null") else value == one for one in allowed)
    if isinstance(allowed, tuple):
        return isinstance(value, list) and all(fits(item, allowed[1]) for item in value)
    json_types: dict[str, Any] = {"integer": int, "number": (int, float), "string": str, "boolean": bool}
    return isinstance(value, json_types.get(allowed, dict if value is not None else type(None)))

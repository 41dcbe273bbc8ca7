"""The OpenAPI document: which errors each route can answer with, and nothing that the models don't say.

It is kept in ``openapi.json`` beside this file, written by ``generate_api.py``; a test compares the two.
"""

import json
import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel

from marsupial_service.examples.demos import EXAMPLES
from marsupial_service.problems import KINDS, MEDIA_TYPE
from marsupial_service.schemas.answers import ProblemAnswer
from marsupial_service.schemas.events import JOB_EVENTS, MISSION_EVENTS

FILE = "openapi.json"
_REF = "#/components/schemas/{model}"

_ANSWER = re.compile(r"\b([A-Z]\w+)Answer\b")
"""Models of answers, which the document names without that suffix."""

EVENTS = "text/event-stream"

_EVENT_DATA: Mapping[str, Mapping[Any, type[BaseModel]]] = {"jobs": JOB_EVENTS, "missions": MISSION_EVENTS}
"""What the data of each type of event is, by the tag of the routes."""

_ALWAYS = ("not-acceptable", "invalid", "internal")
_BODY = ("bad-json", "too-slow", "too-large", "media-type")


def errors(*kinds: str, body: bool = False, key: bool = True) -> dict[int | str, dict[str, Any]]:
    """Return the responses of a route that may fail in these ways, besides those that every route may."""
    names = {*_ALWAYS, *kinds, *(_BODY if body else ()), *(("no-key", "no-scope") if key else ())}
    by_status: dict[int, list[str]] = {}
    for name in sorted(names, key=list(KINDS).index):
        by_status.setdefault(KINDS[name].status, []).append(KINDS[name].title)
    schema = {"schema": {"$ref": _REF.format(model="ProblemAnswer")}}
    return {
        status: {"description": "; ".join(titles), "content": {MEDIA_TYPE: schema}}
        for status, titles in by_status.items()
    }


def document(app: FastAPI, *, needs_keys: bool) -> dict[str, Any]:
    found = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
    schemas = found["components"]["schemas"]
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    problem = ProblemAnswer.model_json_schema(ref_template=_REF)
    schemas |= problem.pop("$defs", {}) | {"ProblemAnswer": problem}
    for model in (model for models in _EVENT_DATA.values() for model in models.values()):
        schema = model.model_json_schema(ref_template=_REF, mode="serialization")
        schemas |= {name: part for name, part in schema.pop("$defs", {}).items() if name not in schemas}
        schemas[model.__name__] = schema
    for path in found["paths"].values():
        for operation in path.values():
            _clean(operation, needs_keys)
    for name, example in EXAMPLES.items():
        found["paths"][name]["post"]["requestBody"]["content"]["application/json"]["example"] = example()
    if needs_keys:
        found["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    _drop_null_defaults(found)
    tidied: dict[str, Any] = json.loads(_ANSWER.sub(r"\1", json.dumps(found, sort_keys=True)))
    return tidied


def stored_text() -> str:
    """Return the document stored with the code."""
    return (files("marsupial_service.http") / FILE).read_text(encoding="utf-8")


def text_of(found: dict[str, Any]) -> str:
    """Return a document as stored text."""
    return json.dumps(found, indent=1, sort_keys=True) + "\n"


def _clean(operation: dict[str, Any], needs_keys: bool) -> None:
    for parameter in operation.get("parameters", ()):
        variants = [v for v in parameter["schema"].pop("anyOf", ()) if v != {"type": "null"}]
        for variant in variants[:1]:
            parameter["schema"] |= variant
    responses = operation["responses"]
    if EVENTS in responses.get("200", {}).get("content", {}):
        # beside `itemSchema`, `schema` is of the whole stream, which some tools read as text and others as an array
        responses["200"]["content"][EVENTS] = {"schema": {}, "itemSchema": _event(*operation["tags"])}
    if needs_keys and str(KINDS["no-key"].status) in responses:
        operation["security"] = [{"key": []}]
    elif not needs_keys:
        for name in ("no-key", "no-scope"):
            responses.pop(str(KINDS[name].status), None)


def _event(tag: str) -> dict[str, Any]:
    """Return the schema of the events of jobs or missions: what `data` holds as JSON goes by `event`."""
    variants = []
    for kind, model in _EVENT_DATA[tag].items():
        properties = {
            "id": {"type": "string", "pattern": "^[0-9]+$"},
            "event": {"type": "string", "const": kind.value},
            "data": {
                "type": "string",
                "contentMediaType": "application/json",
                "contentSchema": {"$ref": _REF.format(model=model.__name__)},
            },
        }
        about = {"title": kind.value, "description": (model.__doc__ or "").partition("\n")[0]}
        variants.append({**about, "type": "object", "properties": properties, "required": list(properties)})
    return {"oneOf": variants}


def _drop_null_defaults(node: object) -> None:
    """Remove the default null: a field that may be left out must not be null."""
    if isinstance(node, dict):
        if "default" in node and node["default"] is None and "properties" not in node:
            del node["default"]
        node = list(node.values())
    for value in node if isinstance(node, list) else ():
        _drop_null_defaults(value)

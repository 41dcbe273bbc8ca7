"""Every list of every body has a bound, and is refused by its length before anything in it is looked at."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from marsupial_service.app import create_app
from marsupial_service.intake.counts import Count, check_counts, counts_of
from marsupial_service.intake.jobs import ANALYSIS_READER, JOB_READER, VALIDATION_READER
from marsupial_service.intake.missions import MISSION_READER, REPORT_READER, ZONE_READER
from marsupial_service.intake.reading import BodyReader, read_in_process
from marsupial_service.intake.simulations import PREVIEW_READER, SIMULATION_READER
from marsupial_service.problems import HttpProblem
from marsupial_service.schemas.base import COUNTED, LIMIT
from marsupial_service.schemas.shapes import EACH, parts_of
from marsupial_service.settings import ServiceLimits, ServiceSettings

READERS: tuple[BodyReader[Any, Any], ...] = (
    JOB_READER,
    ANALYSIS_READER,
    VALIDATION_READER,
    MISSION_READER,
    ZONE_READER,
    REPORT_READER,
    SIMULATION_READER,
    PREVIEW_READER,
)
FEW = {one.name: 1_000_000 if "body" in one.name else max(3, one.metadata["at_least"]) for one in fields(ServiceLimits)}


def inside(
    schema: Mapping[str, Any], models: Mapping[str, Any], path: str = ""
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    yield path, schema
    for part, inner in parts_of(schema, models):
        yield from inside(inner, models, ".".join((path, *part)))


def is_bounded(schema: Mapping[str, Any]) -> bool:
    match schema.get("type"):
        case "array":
            # a list without a fixed length is counted; pydantic stops after a pair of numbers
            return COUNTED in schema or schema.get("minItems", 0) == schema.get("maxItems")
        case "object":
            return not isinstance(schema.get("additionalProperties"), Mapping) or COUNTED in schema
        case "string":
            return COUNTED in schema or not {"maxLength", "enum", "const"}.isdisjoint(schema)
        case _:
            return True


def test_every_list_mapping_and_text_of_every_body_has_a_bound(tmp_path: Path) -> None:
    document = create_app(ServiceSettings(data=tmp_path)).openapi()
    models, names = document["components"]["schemas"], {one.name for one in fields(ServiceLimits)}
    bodies = [
        (path, operation["requestBody"]["content"]["application/json"]["schema"])
        for path, operations in document["paths"].items()
        for operation in operations.values()
        if "requestBody" in operation
    ]
    found = [(path + where, part) for path, body in bodies for where, part in inside(body, models)]
    assert [where for where, part in found if not is_bounded(part)] == []
    assert {part[LIMIT] for _, part in found if LIMIT in part} <= names
    assert len(bodies) == len(READERS)


def body_with(path: tuple[str, ...], value: object) -> Any:
    """Return a document in which this stands at a path."""
    for part in reversed(path):
        value = [value] if part == EACH else {part: value}
    return value


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.make.__name__)
def test_a_list_that_is_too_long_is_refused_whatever_is_in_it(reader: BodyReader[Any, Any]) -> None:
    limits = ServiceLimits(**FEW)  # type: ignore[arg-type]
    counts = [one for one in reader.counts if one.limit != "body_bytes"]
    assert counts
    for count in counts:
        most = FEW[count.limit] if isinstance(count.limit, str) else count.limit
        body = json.dumps(body_with(count.path, ["x"] * (int(most) + 1))).encode()
        with pytest.raises(HttpProblem) as refusal:
            read_in_process((body, reader, limits, ()))
        (error,) = refusal.value.errors
        place = "/" + "/".join("0" if part == EACH else part for part in count.path)
        assert (refusal.value.kind, error.pointer) == ("too-large", place)
        assert error.detail == f"has {most + 1:,} {count.noun}, more than the limit of {most:,}"


def test_a_list_within_another_one_is_counted_in_all_its_items() -> None:
    counts = [one for one in counts_of(REPORT_READER.model) if one.path == ("reports", EACH, "declined")]
    assert counts == [Count(("reports", EACH, "declined"), "actions", "commands")]
    document = {"reports": [{"declined": []}, {"declined": [{}] * 4}]}
    with pytest.raises(HttpProblem) as refusal:
        check_counts(document, counts, ServiceLimits(actions=3))
    assert refusal.value.errors[0].pointer == "/reports/1/declined"

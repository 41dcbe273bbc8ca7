"""Numbers have the same bounds in all inputs."""

import json
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from marsupial.formats.fields import Fields
from marsupial.formats.scenario.map import read_terrains
from marsupial.formats.scenario.read import read_types
from marsupial.model.bounds import BOUNDS
from marsupial.model.grid import TERRAINS
from marsupial.model.plan import Action, ActionName, Plan
from marsupial_service.entries.documents import actions_text, plan_of
from marsupial_service.schemas.mapstates import RobotTypeBody

COMMON = {"speed_mps": 1, "sensor_range_m": 1, "radius_m": 0.1, "terrains": ["floor"]}
CARRIER = {"name": "c", "role": "carrier", "capacity": 1, **COMMON}
ROVER = {"name": "r", "role": "rover", "dock_s": 1, "undock_s": 1, **COMMON}


@pytest.mark.parametrize("field", ["speed_mps", "sensor_range_m", "radius_m", "capacity", "dock_s", "undock_s"])
def test_the_document_describes_the_numbers_that_are_read(field: str) -> None:
    kind, found = CARRIER if field in CARRIER else ROVER, BOUNDS[field.removeprefix("un")]
    for value in (found.least, found.least - 1, found.most, found.most + 1):
        fits = found.fault(value) is None
        assert (is_read({**kind, field: value}), is_described({**kind, field: value})) == (fits, fits), value


def test_there_are_no_more_terrains_than_codes() -> None:
    top = Fields({"terrains": [{"name": f"t{i}"} for i in range(253)]}, "", [])
    assert len(read_terrains(top)) == 255
    assert [str(problem) for problem in top.problems] == ["terrains[252]: is one more terrain than there are codes"]


def test_plans_are_stored_in_their_unchanged_form() -> None:
    plan = Plan(
        actions=(
            Action(name=ActionName.DOCK, start_ms=0, duration_ms=5, robot="r", place="m", carrier="c"),
            Action(name=ActionName.MOVE, start_ms=6, duration_ms=7, robot="c", place="é\u2028", origin="m"),
        )
    )
    text = actions_text(plan)
    assert text == (
        '[{"name":"dock","robot":"r","carrier":"c","place":"m","start_ms":0,"duration_ms":5},'
        '{"name":"move","robot":"c","origin":"m","place":"\\u00e9\\u2028","start_ms":6,"duration_ms":7}]'
    )
    assert plan_of(json.loads(text)) == plan


def is_read(kind: dict[str, Any]) -> bool:
    top = Fields({"robot_types": [kind]}, "", [])
    read_types(top, TERRAINS, None)
    return not top.problems


def is_described(kind: dict[str, Any]) -> bool:
    try:
        TypeAdapter(RobotTypeBody).validate_python(kind)
    except ValidationError:
        return False
    return True

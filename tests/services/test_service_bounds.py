"""Numbers lie within the same bounds wherever they come from."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import TypeAdapter, ValidationError

from marsupial.errors import ScenarioError
from marsupial.formats.fields import Fields
from marsupial.formats.scenario import read_scenario, scenario_text
from marsupial.formats.scenario.map import read_terrains
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.bounds import BOUNDS, LONGEST_NAME
from marsupial.model.plan import Action, ActionName, Plan
from marsupial_service.entries.documents import actions_text, plan_of
from marsupial_service.schemas.mapstates import RobotTypeBody

CARRIER, ROVER = 0, 1


@pytest.mark.parametrize(
    ("kind", "field", "bound"),
    [
        (CARRIER, "speed_mps", "speed_mps"),
        (CARRIER, "sensor_range_m", "sensor_range_m"),
        (CARRIER, "radius_m", "radius_m"),
        (CARRIER, "capacity", "capacity"),
        (ROVER, "dock_s", "dock_s"),
        (ROVER, "undock_s", "dock_s"),
    ],
)
def test_a_file_and_a_request_take_and_refuse_the_same_numbers(
    tmp_path: Path, kind: int, field: str, bound: str
) -> None:
    found, sizes = BOUNDS[bound], {"least": BOUNDS[bound].least, "most": BOUNDS[bound].most}
    for value in (sizes["least"], sizes["least"] - 1, sizes["most"], sizes["most"] + 1):
        assert is_taken_in_a_file(tmp_path, kind, field, value) == is_taken_in_a_request(kind, field, value)
        assert is_taken_in_a_request(kind, field, value) == (found.fault(value) is None), value


def test_a_name_that_is_too_long_is_refused_in_a_file_and_in_a_request(tmp_path: Path) -> None:
    name = "r" * (LONGEST_NAME + 1)
    assert not is_taken_in_a_file(tmp_path, ROVER, "name", name)
    assert not is_taken_in_a_request(ROVER, "name", name)


def test_there_are_no_more_terrains_than_codes() -> None:
    top = Fields({"terrains": [{"name": f"t{i}"} for i in range(253)]}, "", [])
    assert len(read_terrains(top)) == 255
    assert [str(problem) for problem in top.problems] == ["terrains[252]: is one more terrain than there are codes"]


def test_plans_are_kept_in_the_form_they_always_had() -> None:
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


def document(kind: int, field: str, value: object) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(scenario_text(builtin_scenario("lobby")))
    found["map"] = {"rows": ["." * 5] * 5, "resolution_m": 1000}  # on which no robot has too many cells under it
    found["robot_types"][kind][field] = value
    found["team"] = [{"name": "c", "type": found["robot_types"][CARRIER]["name"], "start": "drawn"}]
    return found


def is_taken_in_a_file(folder: Path, kind: int, field: str, value: object) -> bool:
    path = folder / "scenario.yaml"
    path.write_text(yaml.dump(document(kind, field, value)))
    try:
        read_scenario(path)
    except ScenarioError:
        return False
    return True


def is_taken_in_a_request(kind: int, field: str, value: object) -> bool:
    try:
        TypeAdapter(RobotTypeBody).validate_python(document(kind, field, value)["robot_types"][kind])
    except ValidationError:
        return False
    return True

"""Previews of simulations, read and made as in the processes of the service."""

import json
from typing import Any

import pytest
from uploaded_maps import on_map, picture

from marsupial_service.intake.reading import BodyReader, read_in_process
from marsupial_service.intake.simulations import PREVIEW_READER, SIMULATION_READER
from marsupial_service.problems import HttpProblem
from marsupial_service.settings import ServiceLimits


def made(reader: BodyReader[Any, Any], body: dict[str, Any], *more: Any) -> Any:
    return read_in_process((json.dumps(body).encode(), reader, ServiceLimits(cells=10_000), more))


def preview(body: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(made(PREVIEW_READER, body))
    return found


def test_a_preview_tells_how_a_map_is_understood_and_where_robots_start() -> None:
    found = preview(on_map(seed=3))
    assert (found["width"], found["height"], found["resolution_m"]) == (40, 30, 0.25)
    assert sum(found["runs"][1::3]) == 40 * 30
    brief, _ = made(SIMULATION_READER, on_map(seed=3), {})
    assert tuple(found["warnings"]) == brief.simulation.warnings
    starts = [list(brief.grid.centre_m(robot.cell)) for robot in brief.robots if robot.cell is not None]
    assert [one["point_m"] for one in found["robots"]] == starts


def test_what_keeps_robots_from_starting_is_told_with_the_map() -> None:
    found = preview(on_map(image=picture(free=0)))
    assert found["robots"] == []
    assert "no room" in found["errors"][0]["detail"]
    assert found["warnings"]
    assert preview(on_map(starts_m=[[0, 0]]))["errors"][0]["pointer"] == "/starts_m/0"


def test_a_map_of_too_many_cells_is_taken_coarser() -> None:
    with pytest.raises(HttpProblem) as refused:
        preview(on_map(image=picture((200, 150))))
    assert refused.value.errors[0].detail.endswith("; with cells 2 times as large it is within it")
    found = preview(on_map(image=picture((200, 150)), coarser=2))
    assert (found["width"], found["height"], found["resolution_m"]) == (100, 75, 0.5)
    with pytest.raises(HttpProblem) as hopeless:
        preview(on_map(image=picture((500, 500))))
    assert "times as large" not in hopeless.value.errors[0].detail


def test_larger_cells_are_not_offered_for_an_image_that_is_refused_with_them_too() -> None:
    blank = json.dumps(on_map(image=picture((1500, 1500)))).encode()
    with pytest.raises(HttpProblem) as refused:
        read_in_process((blank, PREVIEW_READER, ServiceLimits(cells=1_000_000), ()))
    assert refused.value.errors[0].detail == "has 2,250,000 pixels, more than the limit of 1,000,000"

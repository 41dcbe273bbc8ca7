from dataclasses import replace

import pytest
from support.missions.small_teams import drawn_grid

import marsupial
from marsupial.cli.display.report import facts, place_text, remaining_lines
from marsupial.library.metrics import Summary
from marsupial.model import Cell, Remaining

GRID = replace(drawn_grid("....", "....", resolution_m=0.5), origin_m=(-10.3, 1.0, 0.0))


@pytest.fixture(scope="module")
def summary() -> Summary:
    return marsupial.explore("lobby", "heuristic", steps=1)


def left(summary: Summary, *frontiers: tuple[int, int, int, str]) -> list[str]:
    remaining = tuple(Remaining(cell=Cell(x, y), frontier_cells=n, reason=reason) for x, y, n, reason in frontiers)
    return remaining_lines(replace(summary, remaining=remaining), GRID)


def test_a_place_is_shown_in_the_map_frame_and_as_a_cell() -> None:
    assert place_text(GRID, Cell(3, 1)) == "x -8.6, y 1.8 m (cell 3, 1, counted from the lower left)"
    assert place_text(replace(GRID, origin_m=(-0.26, -0.26, 0.0)), Cell(0, 0)).startswith("x 0.0, y 0.0 m")


def test_frontiers_are_grouped_by_reason_with_an_example_of_each(summary: Summary) -> None:
    assert left(summary, (3, 1, 1, "too narrow")) == [
        "left: a frontier of 1 cell at x -8.6, y 1.8 m (cell 3, 1, counted from the lower left): too narrow"
    ]
    assert left(summary, (0, 0, 2, "far"), (3, 1, 1, "too narrow"), (2, 1, 3, "far")) == [
        "left: 2 frontiers of 5 cells, one of them at x -10.1, y 1.2 m (cell 0, 0, counted from the lower left): far",
        "left: a frontier of 1 cell at x -8.6, y 1.8 m (cell 3, 1, counted from the lower left): too narrow",
    ]


def test_a_team_of_one_each_is_written_in_the_singular(summary: Summary) -> None:
    assert dict(facts(replace(summary, carriers=1, robots=2)))["team"] == "1 carrier, 1 rover"

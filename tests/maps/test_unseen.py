from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import aboard, carrier, draw, random_cells, rover, standing

from marsupial.maps.growth import reach_of
from marsupial.maps.territory import Territory
from marsupial.maps.unseen import FIRST_GUESS, FIRST_GUESS_M2, UnseenPart
from marsupial.model import ROUGH, UNKNOWN, Cell, CellArray, Grid, PlacedRobot, Unseen

KINDS = (carrier(), rover())


def unseen(grid: Grid, *robots: PlacedRobot) -> Unseen:
    territory = Territory(grid, KINDS)
    return UnseenPart(territory).now((), reach_of(territory, robots))


def squares_of(grid: Grid) -> dict[str, tuple[float, float, float]]:
    return {square.name: (square.x_m, square.y_m, square.share) for square in unseen(grid).squares}


def test_a_square_at_least_half_of_which_is_unknown_is_left() -> None:
    grid = draw("??.?", "????", "..?.", "..?#", resolution_m=4.0)
    assert squares_of(grid) == {
        "0_1": (pytest.approx(2.0), pytest.approx(10.0), 1.0),
        "1_1": (pytest.approx(4 * 8 / 3), pytest.approx(4 * 7 / 3), 0.75),
        "1_0": (pytest.approx(8.0), pytest.approx(2.0), 0.5),
    }
    assert {one.name: one.at for one in unseen(grid).squares} == {
        "0_1": Cell(0, 1),
        "1_1": Cell(1, 1),
        "1_0": Cell(1, 0),
    }
    assert unseen(grid).side == 2


def test_a_square_at_the_edge_of_the_map_counts_only_what_is_on_it() -> None:
    assert squares_of(draw("..?", "..?", resolution_m=4.0)) == {"1_0": (8.0, 2.0, 0.5)}
    assert squares_of(draw("..?", "...", resolution_m=4.0)) == {}


def test_the_share_of_ground_for_rovers_only_is_that_of_the_ground_seen_from_a_first_guess_on() -> None:
    def share(*rows: str) -> float:
        return unseen(draw(*rows)).rovers_only

    assert share("??#") == FIRST_GUESS
    assert share("?" + "," * 500) == pytest.approx(1.0, abs=0.05)
    assert share("?" + "." * 500) == pytest.approx(0.0, abs=0.05)
    assert share("#" * 900 + "." * 300 + "," * 300) == pytest.approx(0.5, abs=0.02)


def test_ground_behind_doors_too_narrow_for_carriers_is_for_rovers_only_as_well() -> None:
    rows = ("." * 9,) * 9
    door = "####.####"
    building = draw(*rows, door, *rows)
    team = standing("c", Cell(4, 4)), aboard("r", "c")
    beyond = 7 * 7 + 1  # where a carrier fits
    assert unseen(building, *team).rovers_only == pytest.approx(
        (beyond + FIRST_GUESS * FIRST_GUESS_M2) / (2 * 81 + 1 + FIRST_GUESS_M2)
    )
    assert unseen(draw(*rows, *rows), *team).rovers_only == pytest.approx(
        FIRST_GUESS * FIRST_GUESS_M2 / (2 * 81 + FIRST_GUESS_M2)
    )


def test_the_shared_ground_is_what_of_the_carriers_ground_rovers_can_drive_on() -> None:
    assert unseen(draw("..,,?")).shared == 1.0
    on_rough = replace(rover(), terrains=frozenset({ROUGH}))
    territory = Territory(draw("..,,?"), (carrier(), on_rough))
    assert UnseenPart(territory).now((), reach_of(territory, ())).shared == 0.0


def test_squares_keep_their_names_and_draws_while_the_map_grows() -> None:
    before = {s.name: s.draw for s in unseen(draw("????", "????", resolution_m=8.0)).squares}
    after = {s.name: s.draw for s in unseen(draw("?.??", "????", resolution_m=8.0)).squares}
    assert before.keys() - after.keys() == {"1_1"}
    assert after.items() <= before.items()
    assert len(set(before.values())) > 1


@given(random_cells(), st.integers(1, 3), st.data())
def test_incremental_squares_equal_those_from_scratch(cells: CellArray, metres: int, data: st.DataObject) -> None:
    order = data.draw(st.permutations(range(cells.size)))
    known = np.full_like(cells, UNKNOWN)
    grid = Grid(cells=known, resolution_m=float(metres))
    territory = Territory(grid, KINDS)
    kept = UnseenPart(territory)
    for i in range(0, cells.size, 5):
        news = np.array(order[i : i + 5], dtype=np.int64)
        known.ravel()[news] = cells.ravel()[news]
        territory.reveal(news)
        assert kept.now((), reach_of(territory, ())) == unseen(grid)

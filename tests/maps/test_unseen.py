from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from drawn_maps import carrier, draw, rover

from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.maps.unseen import FIRST_GUESS, MOST_SQUARES, unseen
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, Grid
from marsupial.model.unseen import Unseen

KINDS = (carrier(), rover())


def unseen_from(grid: Grid, *gates: tuple[int, int], rovers_at: Sequence[tuple[int, int]] = ()) -> Unseen:
    """Return what is unseen with targets for carriers, and for rovers only, at these cells."""
    targets = [target(x, y, grid.width, "carrier") for x, y in gates]
    return unseen(Territory(grid, KINDS), targets + [target(x, y, grid.width, "rover") for x, y in rovers_at])


def target(x: int, y: int, width: int, kind: str) -> Target:
    cells = np.array([y * width + x])
    return Target(name=f"t_{x}_{y}", cell=Cell(x, y), viewpoints={kind: Cell(x, y)}, cells=cells, reveal_m2=1.0)


def shares(grid: Grid, *gates: tuple[int, int]) -> dict[str, float]:
    return {square.name: square.share for square in unseen_from(grid, *gates).squares}


def test_a_square_at_least_half_of_which_is_unknown_is_left() -> None:
    grid = draw(
        "??.?",
        "????",
        "..?.",
        "..?#",
        resolution_m=5.0,
    )
    assert shares(grid, (0, 0)) == {"0_1": 1.0, "1_1": 0.75, "1_0": 0.5}


def test_a_square_at_the_edge_of_the_map_counts_only_what_is_on_it() -> None:
    assert shares(draw("..?", "..?", resolution_m=5.0), (0, 0)) == {"1_0": 0.5}
    assert shares(draw("..?", "...", resolution_m=5.0), (0, 0)) == {}


def test_a_known_map_has_nothing_unseen() -> None:
    assert shares(draw("..", ".#", resolution_m=5.0), (0, 0)) == {}


def test_what_no_target_for_carriers_leads_to_is_left_out() -> None:
    grid = draw(
        "..#??#.",
        "..#??#,",
        resolution_m=5.0,
    )
    assert unseen_from(grid, (0, 0), (6, 1), rovers_at=[(6, 0)]).squares == ()
    assert unseen_from(draw("..??", "..??", resolution_m=5.0), rovers_at=[(0, 0)]).squares == ()


def test_ways_lead_over_ground_for_carriers_and_all_that_is_unknown() -> None:
    grid = draw(
        "..##??..??",
        "..##??,.??",
        resolution_m=5.0,
    )
    found = unseen_from(grid, (1, 1), (7, 0), (7, 1))
    assert found.gates == ("t_1_1", "t_7_0", "t_7_1")
    assert {square.name for square in found.squares} == {"2_0", "4_0"}
    metres = dict(zip((square.name for square in found.squares), found.from_gates_m.T.tolist(), strict=True))
    slant = 5.0 * 2**0.5
    assert metres["4_0"] == pytest.approx([np.inf, 5.0, slant])
    # round the ground for rovers only
    assert metres["2_0"] == pytest.approx([np.inf, 15.0 + slant, 10.0 + slant])
    assert found.between_m == pytest.approx(np.array([[0.0, 10.0 + 2 * slant], [10.0 + 2 * slant, 0.0]]))


def test_of_many_squares_those_with_the_shortest_ways_there_are_told_of() -> None:
    found = unseen_from(draw("?" * (MOST_SQUARES + 10) + "." + "?" * 5, resolution_m=10.0), (MOST_SQUARES + 10, 0))
    columns = {int(square.name.split("_")[0]) for square in found.squares}
    assert columns == {MOST_SQUARES + 10 + k for k in range(-(MOST_SQUARES - 5), 6) if k}
    assert found.from_gates_m.shape == (1, MOST_SQUARES)
    assert found.between_m.shape == (MOST_SQUARES, MOST_SQUARES)


def test_a_wall_one_cell_thick_closes_a_fine_map_and_a_speck_does_not() -> None:
    cells = np.full((200, 400), FLOOR, dtype=np.uint8)
    cells[:, 200:] = UNKNOWN
    cells[::9, 197] = OBSTACLE
    assert shares(Grid(cells=cells, resolution_m=0.05), (100, 100)) == {"1_0": 1.0}
    cells[:, 197] = OBSTACLE
    assert shares(Grid(cells=cells, resolution_m=0.05), (100, 100)) == {}


def test_the_share_of_ground_for_rovers_only_is_that_of_the_ground_seen_from_a_first_guess_on() -> None:
    def share(*rows: str) -> float:
        return unseen(Territory(draw(*rows), KINDS), ()).rovers_only

    assert share("??#") == FIRST_GUESS
    assert share("?" + "," * 500) == pytest.approx(1.0, abs=0.05)
    assert share("?" + "." * 500) == pytest.approx(0.0, abs=0.05)
    assert share("#" * 900 + "." * 300 + "," * 300) == pytest.approx(0.5, abs=0.02)


def test_squares_keep_their_names_and_draws_while_the_map_grows() -> None:
    before = {s.name: s.draw for s in unseen_from(draw("????", "?.??", resolution_m=10.0), (1, 0)).squares}
    after = {s.name: s.draw for s in unseen_from(draw("?.??", "?.??", resolution_m=10.0), (1, 0)).squares}
    assert before.keys() - after.keys() == {"1_1"}
    assert after.items() <= before.items()
    assert len(set(before.values())) > 1

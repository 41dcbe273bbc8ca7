"""Which robots are in contact, and what is held until they are."""

from dataclasses import replace

import numpy as np
import pytest
from support.missions.small_teams import CORRIDOR, drawn_grid, kinds_of

from marsupial.model import UNKNOWN, Cell, PlacedRobot
from marsupial.sim.motion import SimulatedRobot
from marsupial.sim.radio import in_contact
from marsupial.sim.world import SimulatedWorld

KINDS = kinds_of()
CARRIER, ROVER = KINDS["carrier"], KINDS["rover"]


def robots(*xs: int, lost: int | None = None) -> list[SimulatedRobot]:
    """Return a carrier and rovers in a row."""
    kinds = [CARRIER, *[ROVER] * (len(xs) - 1)]
    placed = zip(kinds, xs, strict=True)
    return [
        SimulatedRobot(name=f"r{i}", kind=kind, cell=Cell(x, 0), carrier=None, lost=i == lost)
        for i, (kind, x) in enumerate(placed)
    ]


@pytest.mark.parametrize(
    ("xs", "lost", "heard"),
    [
        ((0, 3), None, {"r0", "r1"}),
        ((0, 4), None, {"r0"}),
        ((0, 3, 6, 9), None, {"r0", "r1", "r2", "r3"}),
        ((0, 9, 6, 3), None, {"r0", "r1", "r2", "r3"}),
        ((0, 3, 7), None, {"r0", "r1"}),
        ((0, 3, 6), 1, {"r0", "r1"}),
        ((0, 3, 6), 0, set()),
    ],
)
def test_rovers_near_a_carrier_or_a_rover_in_contact_are_in_contact(
    xs: tuple[int, ...], lost: int | None, heard: set[str]
) -> None:
    ranges = {f"r{i}": 3.0 for i in range(1, len(xs))}
    assert in_contact(robots(*xs, lost=lost), ranges) - {"r0"} == heard - {"r0"}


def test_rovers_without_a_range_and_rovers_that_dock_are_in_contact() -> None:
    team = robots(0, 50, 90)
    team[2].partner = team[0]
    assert in_contact(team, {"r2": 1.0}) == {"r0", "r1", "r2"}


def test_what_a_rover_sees_out_of_contact_is_held_until_it_is_in_contact_again() -> None:
    grid = drawn_grid(*CORRIDOR)
    kinds = KINDS | {"rover": replace(ROVER, radio_range_m=2.5)}
    placed = (
        PlacedRobot(name="c1", type="carrier", cell=Cell(1, 1)),
        PlacedRobot(name="r1", type="rover", cell=Cell(3, 1)),
    )
    world = SimulatedWorld(grid, kinds, placed)
    world.advance(0)
    world.drive("r1", [Cell(x, 1) for x in range(3, 8)])
    news = [world.advance(60_000) for _ in range(2)]
    assert (news[0].t_ms, news[0].out_of_contact) == (2000, ("r1",))
    assert (news[1].finished, news[1].revealed) == (("r1",), ())
    before = world.grid.cells.copy()
    assert before[1, 7] == UNKNOWN
    world.drive("r1", [Cell(x, 1) for x in range(7, 2, -1)])
    back = world.advance(60_000)
    assert (back.in_contact, back.finished) == (("r1",), ("r1",))
    [(name, cells)] = back.revealed
    assert name == "r1"
    fresh = np.flatnonzero(world.grid.cells != before)
    assert cells.tolist() == fresh.tolist()
    assert world.grid.cells[1, 7] != UNKNOWN


def test_a_rover_in_contact_reveals_what_another_one_saw_out_of_contact_before() -> None:
    grid = drawn_grid("#" * 30, "#" + "." * 28 + "#", "#" * 30)
    kinds = kinds_of(rover_range_m=2.0)
    kinds["rover"] = replace(kinds["rover"], radio_range_m=2.5)
    kinds["carrier"] = replace(kinds["carrier"], sensor_range_m=1.0)
    placed = [("c1", "carrier", 2), ("r1", "rover", 4), ("r2", "rover", 1)]
    robots = [PlacedRobot(name=name, type=kind, cell=Cell(x, 1)) for name, kind, x in placed]
    world = SimulatedWorld(grid, kinds, robots)
    world.advance(0)
    world.drive("r1", [Cell(x, 1) for x in range(4, 25)])
    while world.advance(60_000).finished != ("r1",):
        pass
    assert world.grid.cells[1, 10] == UNKNOWN  # r1 has seen it, and holds it
    world.drive("c1", [Cell(x, 1) for x in range(2, 8)])
    world.drive("r2", [Cell(x, 1) for x in range(1, 9)])
    while "r2" not in (news := world.advance(200_000)).finished:
        assert "r1" not in news.in_contact
    assert world.grid.cells[1, 10] != UNKNOWN

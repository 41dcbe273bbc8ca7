"""Faults in the simulator: what happens to robots and ground, and what the news says of it."""

from dataclasses import replace

import pytest
from support.missions.small_teams import CORRIDOR, carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.errors import InternalError, ScenarioError
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Cell, News, PlacedRobot, Role
from marsupial.model.faults import Fault, FaultKind, dated
from marsupial.sim.world import SimulatedWorld

LATER = 1_000_000
EAST = tuple(Cell(x, 1) for x in range(1, 8))


def fault(kind: str, robot: str | None = None, at_ms: int | None = 0, **fields: object) -> Fault:
    return Fault(kind=FaultKind(kind), robot=robot, at_ms=at_ms, **fields)  # type: ignore[arg-type]


@pytest.fixture(params=[False, True], ids=["alone", "interference"])
def begun(request: pytest.FixtureRequest):
    """Return a function that makes a world with faults, whose robots have looked round."""

    def made(*parts: PlacedRobot | Fault, capacity: int = 1) -> SimulatedWorld:
        robots = [part for part in parts if isinstance(part, PlacedRobot)]
        faults = [part for part in parts if isinstance(part, Fault)]
        kinds = kinds_of(capacity=capacity)
        world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds, robots, faults, interference=request.param)
        world.advance(0)
        return world

    return made


def until(world: SimulatedWorld, what: str) -> News:
    """Let time pass until the news has something in the field `what`."""
    while not getattr(news := world.advance(LATER), what):
        assert news.t_ms < LATER, f"no {what}"
    return news


def of(world: SimulatedWorld, name: str):
    return next(robot for robot in world.robots() if robot.name == name)


def test_a_lost_robot_returns_where_it_stands(begun) -> None:
    world = begun(carrier_at(1, 1), fault("lost", "c1", 2500), fault("returns", "c1", 9000))
    world.drive("c1", EAST)
    until(world, "lost")
    news = until(world, "returned")
    assert (news.t_ms, news.returned) == (9000, ("c1",))
    assert not of(world, "c1").lost
    world.drive("c1", EAST[2:])
    assert until(world, "finished").t_ms == 13_000


def test_rovers_lost_with_their_carrier_return_with_it_and_not_before(begun) -> None:
    times = (fault("lost", "c1", 100), fault("returns", "r1", 200), fault("returns", "c1", 300))
    world = begun(carrier_at(1, 1), rover_on("c1"), *times)
    until(world, "lost")
    assert until(world, "returned").returned == ("c1", "r1")


def test_a_rover_whose_place_was_taken_stays_lost(begun) -> None:
    faults = (fault("lost", "r1", 100), fault("returns", "r1", 50_000))
    world = begun(carrier_at(1, 1), rover_on("c1", 1), rover_at(2, 1, 2), *faults)
    until(world, "lost")
    world.dock("r2", "c1")
    until(world, "finished")
    world.advance(60_000)
    assert of(world, "r1").lost


def test_a_rover_keeps_its_place_until_its_undocking_has_not_failed(begun) -> None:
    faults = (fault("lost", "r1", 0), fault("returns", "r1", 12_000), fault("docking_fails", "r2", 11_000))
    world = begun(carrier_at(1, 1), rover_on("c1", 1), rover_at(2, 1, 2), *faults)
    world.dock("r2", "c1")
    until(world, "finished")
    world.undock("r2", "c1", Cell(2, 1))
    until(world, "failed")
    world.advance(LATER)
    assert [robot.lost for robot in world.robots()] == [False, True, False]


def test_a_robot_lost_in_the_moment_of_its_return_is_lost(begun) -> None:
    times = (fault("lost", "c1", 100), fault("returns", "c1", 200), fault("lost", "c1", 200))
    world = begun(carrier_at(1, 1), *times)
    until(world, "lost")
    news = until(world, "lost")
    assert (news.returned, news.lost, of(world, "c1").lost) == ((), (("c1", "failed"),), True)


def test_a_robot_that_joins_is_absent_until_then() -> None:
    world = SimulatedWorld(
        drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1), carrier_at(7, 1, 2)], [fault("joins", "c2", 5000)]
    )
    news = world.advance(0)
    assert news.lost == (("c2", "is absent until it joins"),)
    assert [name for name, _ in news.revealed] == ["c1"]
    assert until(world, "returned").returned == ("c2",)


def test_a_carrier_that_joins_brings_its_rovers(begun) -> None:
    world = begun(carrier_at(1, 1), carrier_at(7, 1, 2), rover_on("c2"), fault("joins", "c2", 5000))
    assert [name for name in ("c1", "c2", "r1") if of(world, name).lost] == ["c2", "r1"]
    assert until(world, "returned").returned == ("c2", "r1")


def test_a_slower_robot_keeps_its_pace_to_the_next_cell_and_says_so(begun) -> None:
    world = begun(carrier_at(1, 1), fault("slows", "c1", 1500, share=0.5))
    world.drive("c1", EAST)
    news = until(world, "slowed")
    assert (news.t_ms, news.slowed, of(world, "c1").speed) == (1500, (("c1", 0.5),), 0.5)
    news = until(world, "passages")
    assert (news.t_ms, news.passages) == (2000, (("c1", EAST[2:]),))
    assert until(world, "finished").t_ms == 2000 + 4 * 2000
    world.drive("c1", EAST[::-1])
    assert until(world, "finished").t_ms == 10_000 + 6 * 2000


def test_a_stuck_robot_fails_its_drive_and_is_free_later(begun) -> None:
    world = begun(carrier_at(1, 1), fault("stuck", "c1", 2500, for_ms=4000))
    world.drive("c1", EAST)
    news = until(world, "failed")
    assert (news.t_ms, news.failed) == (2500, (("c1", "stuck"),))
    assert (of(world, "c1").cell, of(world, "c1").free_at_ms) == (Cell(3, 1), 6500)
    with pytest.raises(InternalError, match="not free"):
        world.drive("c1", EAST[2:])
    world.advance(6500)
    world.drive("c1", EAST[2:])
    assert until(world, "finished").t_ms == 10_500


def test_a_shorter_fault_does_not_end_a_longer_one(begun) -> None:
    world = begun(carrier_at(1, 1), fault("stuck", "c1", 0, for_ms=9000), fault("stuck", "c1", 500, for_ms=1000))
    world.advance(600)
    assert of(world, "c1").free_at_ms == 9000


def test_a_robot_that_docks_is_stuck_only_afterwards(begun) -> None:
    world = begun(carrier_at(1, 1), rover_at(2, 1), fault("stuck", "c1", 1000, for_ms=4000))
    world.dock("r1", "c1")
    docked_ms = until(world, "finished").t_ms
    assert not world.advance(docked_ms + 1).failed  # it had nothing to do
    assert of(world, "c1").free_at_ms == docked_ms + 1 + 4000


def test_a_declined_command_fails_at_once_and_the_next_does_not(begun) -> None:
    world = begun(carrier_at(1, 1), rover_at(2, 1), fault("declines", "c1"), fault("declines", "r1", 5000))
    world.drive("c1", EAST[:1])
    news = until(world, "declined")
    assert (news.t_ms, news.declined) == (0, (("c1", "c1 declined"),))
    world.advance(6000)
    world.dock("r1", "c1")
    assert until(world, "declined").declined == (("c1", "r1 declined"), ("r1", "r1 declined"))
    world.dock("r1", "c1")
    assert until(world, "finished").finished == ("c1", "r1")


def test_a_docking_that_fails_leaves_both_robots_where_they_were(begun) -> None:
    world = begun(carrier_at(1, 1), rover_at(2, 1), fault("docking_fails", "c1"), fault("docking_fails", "r1", 30_000))
    world.dock("r1", "c1")
    news = until(world, "failed")
    assert news.failed == (("c1", "docking failed"), ("r1", "docking failed"))
    assert (of(world, "r1").cell, of(world, "r1").carrier) == (Cell(2, 1), None)
    world.dock("r1", "c1")
    until(world, "finished")
    world.advance(31_000)
    world.undock("r1", "c1", Cell(2, 1))
    assert [name for name, _ in until(world, "failed").failed] == ["c1", "r1"]
    assert (of(world, "r1").cell, of(world, "r1").carrier) == (None, "c1")


def test_a_door_closes_and_opens_before_a_robot_that_sees_it(begun) -> None:
    door = (Cell(3, 1), Cell(3, 1))
    shut = fault("ground", at_ms=1000, area=door, terrain=OBSTACLE)
    world = begun(carrier_at(1, 1), shut, fault("ground", at_ms=2000, area=door, terrain=FLOOR))
    for t_ms, code in ((1000, OBSTACLE), (2000, FLOOR)):
        news = until(world, "changed")
        ((name, cells),) = news.changed
        assert (news.t_ms, name, cells.tolist()) == (t_ms, "c1", [world.grid.width + 3])
        assert world.grid.cells[1, 3] == code


def test_a_door_does_not_close_on_a_robot(begun) -> None:
    here = (Cell(1, 1), Cell(1, 1))
    world = begun(carrier_at(1, 1), fault("ground", at_ms=1000, area=here, terrain=OBSTACLE))
    world.advance(5500)
    assert world.grid.cells[1, 1] == FLOOR
    world.drive("c1", EAST[:4])
    assert until(world, "changed").t_ms > 5500


@pytest.mark.parametrize(("at_ms", "end_ms"), [(1999, 10_000), (2000, 9000), (2001, 9000)])
def test_a_robot_that_slows_down_as_it_reaches_a_cell_does_so_from_the_next_one_on(begun, at_ms: int, end_ms: int):
    world = begun(carrier_at(1, 1), fault("slows", "c1", at_ms, share=0.5))
    world.drive("c1", EAST)
    assert until(world, "finished").t_ms == end_ms


def test_a_robot_stops_before_ground_that_has_closed(begun) -> None:
    world = begun(carrier_at(1, 1), fault("ground", at_ms=1500, area=(Cell(4, 1), Cell(4, 1)), terrain=OBSTACLE))
    world.drive("c1", EAST)
    news = until(world, "failed")
    assert (news.t_ms, news.failed, of(world, "c1").cell) == (2000, (("c1", "no ground ahead"),), Cell(3, 1))
    assert world.grid.cells[1, 4] == OBSTACLE
    world.drive("c1", EAST[2:])
    assert (world.advance(LATER).failed, of(world, "c1").cell) == (news.failed, Cell(3, 1))


@pytest.mark.parametrize(
    ("radius_m", "shut", "rows"),
    [(1.2, Cell(5, 3), (2, 2, 2)), (0.0, Cell(5, 3), (2, 3, 3))],
    ids=["beside a wide robot", "past the corner of a near-sighted one"],
)
def test_a_robot_stops_before_ground_that_it_sees_only_from_the_cell_before(
    radius_m: float, shut: Cell, rows: tuple[int, ...]
) -> None:
    kind = replace(kinds_of(carrier_range_m=1.1)["carrier"], radius_m=radius_m)
    closes = fault("ground", at_ms=0, area=(shut, shut), terrain=OBSTACLE)
    hall = drawn_grid("#########", *4 * ["#.......#"], "#########")
    world = SimulatedWorld(hall, {"carrier": kind}, [carrier_at(2, 2)], [closes])
    world.drive("c1", [Cell(2, 2), Cell(3, 2), *(Cell(4 + i, y) for i, y in enumerate(rows))])
    until(world, "failed")
    assert of(world, "c1").cell == Cell(4, 2)
    assert world.grid.cells[shut.y, shut.x] == OBSTACLE


def test_an_idle_robot_that_is_stuck_while_it_makes_room_says_where() -> None:
    faults = [fault("stuck", "c2", 4500, for_ms=1000)]
    kinds = {"carrier": replace(kinds_of()["carrier"], radius_m=0.4)}
    world = SimulatedWorld(
        drawn_grid(*CORRIDOR), kinds, [carrier_at(1, 1), carrier_at(3, 1, 2)], faults, interference=True
    )
    world.advance(0)
    world.drive("c1", EAST[:5])
    while not (news := world.advance(LATER)).failed:
        assert news.t_ms < 4500
    assert news.passages == (("c2", (of(world, "c2").cell,)),)


def test_no_rover_is_set_down_on_ground_that_has_closed(begun) -> None:
    closes = fault("ground", at_ms=0, area=(Cell(2, 1), Cell(2, 1)), terrain=OBSTACLE)
    world = begun(carrier_at(1, 1), rover_on("c1"), closes)
    world.undock("r1", "c1", Cell(2, 1))
    assert until(world, "failed").failed == (("c1", "no ground to land on"), ("r1", "no ground to land on"))
    assert of(world, "r1").carrier == "c1"


def test_a_fault_happens_when_its_place_is_first_seen(begun) -> None:
    shut = fault("ground", at_ms=None, seen=Cell(6, 1), area=(Cell(6, 1), Cell(6, 1)), terrain=OBSTACLE)
    world = begun(carrier_at(1, 1), shut)
    world.drive("c1", EAST[:4])
    news = until(world, "changed")
    assert news.t_ms == 3000
    assert world.grid.cells[1, 6] == OBSTACLE


def test_missed_cells_are_seen_by_later_looks() -> None:
    faults = [fault("missed_cells", at_ms=None, share=0.5)]
    worlds = [SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1)], given) for given in ((), faults)]
    seen = []
    for world in worlds:
        world.advance(0)
        seen.append(int((world.grid.cells != UNKNOWN).sum()))
        for way in (EAST, EAST[::-1], EAST, EAST[::-1]):
            world.drive("c1", way)
            until(world, "finished")
    assert seen[0] > seen[1]
    assert int((worlds[1].grid.cells != UNKNOWN).sum()) > seen[0]


def test_a_series_of_more_faults_than_a_mission_can_have_is_refused() -> None:
    series = [fault("stuck", at_ms=None, rate_per_h=1000.0)] * 1000
    with pytest.raises(ScenarioError, match="over 100000 faults before the time limit of 1e"):
        list(dated(series, {"c1": Role.CARRIER}, 10**10, seed=1))


def test_a_series_is_drawn_by_its_seed_at_its_rate() -> None:
    series = fault("stuck", at_ms=None, rate_per_h=60.0, seed=4, for_ms=1000)
    roles = {"c1": Role.CARRIER, "r1": Role.ROVER}
    found = list(dated([series], roles, 3_600_000, seed=1))
    assert found == list(dated([series], roles, 3_600_000, seed=1))
    assert found != list(dated([series], roles, 3_600_000, seed=2))
    assert {one.robot for one in dated([replace(series, role=Role.ROVER)], roles, 3_600_000, seed=1)} == {"r1"}
    assert 40 < len(found) < 80
    assert {one.robot for one in found} == {"c1", "r1"}
    assert all(0 <= one.at_ms < 3_600_000 for one in found if one.at_ms is not None)


def test_noise_lets_drives_end_beside_their_goals_but_short_ones_end_there(begun) -> None:
    ends = set()
    for seed in range(20):
        world = begun(carrier_at(1, 1), fault("position_noise", at_ms=None, share=0.2, seed=seed))
        world.drive("c1", EAST)
        assert until(world, "finished").finished == ("c1",)
        here = of(world, "c1").cell
        ends.add(here)
        world.drive("c1", (here,))
        until(world, "finished")
        assert of(world, "c1").cell == here
    assert len(ends) > 1
    # the corridor has walls
    assert {cell.y for cell in ends} == {1}


def test_noise_of_another_robot_changes_nothing(begun) -> None:
    world = begun(carrier_at(1, 1), carrier_at(2, 1, 2), fault("position_noise", "c2", at_ms=None, share=1.0))
    world.drive("c1", EAST)
    assert (until(world, "finished").t_ms, of(world, "c1").cell) == (6000, EAST[-1])


def test_robots_too_far_apart_after_a_noisy_drive_do_not_dock() -> None:
    noise = [fault("position_noise", at_ms=None, share=0.2)]
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1), rover_at(5, 1)], noise)
    world.advance(0)
    world.dock("r1", "c1")
    assert until(world, "failed").failed == (("c1", "too far apart"), ("r1", "too far apart"))
    assert of(world, "r1").cell == Cell(5, 1)


def test_a_series_for_robots_that_a_team_does_not_have_strikes_nobody() -> None:
    series = Fault(kind=FaultKind.LOST, rate_per_h=1000.0, role=Role.ROVER)
    assert list(dated([series], {"c1": Role.CARRIER}, 3_600_000, 1)) == []


def test_robots_find_their_way_round_others_on_the_ground_as_it_is_known_now() -> None:
    rows = ("#########", "#.......#", "#.......#", "#.#####.#", "#.......#", "#########")
    closes = fault("ground", at_ms=60_000, area=(Cell(4, 3), Cell(4, 4)), terrain=OBSTACLE)
    kinds = {"carrier": replace(kinds_of(carrier_range_m=20)["carrier"], radius_m=0.4)}
    robots = [carrier_at(1, 1, 1), carrier_at(4, 1, 2), carrier_at(2, 4, 3)]  # the last one sees it
    world = SimulatedWorld(drawn_grid(*rows), kinds, robots, [closes], interference=True)
    world.advance(0)

    def rows_of(route: tuple[Cell, ...]) -> set[int]:
        """Drive along a route that the second one stands on; return the rows of the ways taken instead."""
        world.drive("c1", route)
        ways: list[Cell] = []
        while "c1" not in (news := world.advance(LATER)).finished:
            assert not news.failed
            ways += [cell for name, way in news.passages for cell in way if name == "c1"]
        return {cell.y for cell in ways}

    assert rows_of(EAST) == {1, 2, 3}
    assert until(world, "changed").t_ms == 60_000
    assert rows_of(EAST[::-1]) == {1}  # the second one makes room

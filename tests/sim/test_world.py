from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from support.missions.small_missions import losses
from support.missions.small_teams import ANNEX, CORRIDOR, carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.errors import InternalError
from marsupial.model import OBSTACLE, UNKNOWN, Cell, CellArray, Grid, News, PlacedRobot, RobotType
from marsupial.paths.routes import passing_times_ms
from marsupial.sim.sensors import FieldOfView
from marsupial.sim.world import SimulatedWorld

LATER = 1_000_000
EAST = tuple(Cell(x, 1) for x in range(1, 8))
"""The route along the corridor, from its west end."""


def world_of(
    *robots: PlacedRobot, lines: tuple[str, ...] = CORRIDOR, failures: Mapping[str, int] | None = None, **kinds: float
) -> SimulatedWorld:
    """Return a world after the robots' first look."""
    world = SimulatedWorld(drawn_grid(*lines), kinds_of(**kinds), robots, losses(failures or {}))  # type: ignore[arg-type]
    world.advance(0)
    return world


def report_of(world: SimulatedWorld, name: str):
    return next(robot for robot in world.robots() if robot.name == name)


def until_finished(world: SimulatedWorld) -> News:
    while not (news := world.advance(LATER)).finished:
        assert world.now_ms < LATER
    return news


def known_cells(world: SimulatedWorld) -> set[tuple[int, int]]:
    return {(int(x), int(y)) for y, x in np.argwhere(world.grid.cells != UNKNOWN)}


def test_at_first_robots_on_the_ground_see_what_is_round_them() -> None:
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1)])
    assert not known_cells(world)
    news = world.advance(0)
    assert news.t_ms == 0
    assert [name for name, _ in news.revealed] == ["c1"]
    assert {(1, 1), (2, 1), (3, 1), (4, 1), (0, 1), (2, 0), (2, 2)} <= known_cells(world)
    assert (5, 1) not in known_cells(world)


@pytest.mark.parametrize("solid", ["#", "?"])
def test_obstacles_and_unknown_cells_of_the_map_are_seen_as_solid_and_block_sight(solid: str) -> None:
    world = world_of(carrier_at(2, 1), lines=("#######", f"#..{solid}..#", "#######"))
    assert world.grid.cells[1, 3] == OBSTACLE
    assert (4, 1) not in known_cells(world)


def test_terrain_is_recognised_when_seen_and_does_not_block_sight() -> None:
    world = world_of(carrier_at(1, 1), lines=("######", "#.,..#", "######"))
    truth = drawn_grid("######", "#.,..#", "######").cells
    assert world.grid.cells[1, 1:5].tolist() == truth[1, 1:5].tolist()


def test_cells_next_to_the_footprint_are_known_even_out_of_sight() -> None:
    world = world_of(carrier_at(2, 2), lines=("#####", "#.#.#", "##.##", "#.#.#", "#####"), carrier_range_m=0.5)
    assert known_cells(world) == {(2, 2), (1, 2), (3, 2), (2, 1), (2, 3)}


def test_cells_are_passed_at_the_times_of_the_route() -> None:
    route = (Cell(1, 1), Cell(2, 2), Cell(3, 2), Cell(4, 3))
    world = world_of(carrier_at(1, 1), lines=("######", "#....#", "#....#", "#....#", "######"), carrier_range_m=0.1)
    world.drive("c1", route)
    passed = []
    while not (news := world.advance(LATER)).finished:
        passed.append(news.t_ms)
    times = passing_times_ms(route, 1.0, 1.0).tolist()
    assert times == [0, 1414, 2414, 3828]
    assert set(passed) <= set(times)  # at other times there is no news
    assert world.now_ms == times[-1]
    assert report_of(world, "c1").cell == Cell(4, 3)


def test_each_move_of_a_robot_that_hops_takes_as_long() -> None:
    kinds = {name: replace(kind, diagonal=1.0, speed_mps=1.0) for name, kind in kinds_of().items()}
    world = SimulatedWorld(drawn_grid("....", "....", "...."), kinds, [carrier_at(0, 0)])
    world.advance(0)
    world.drive("c1", (Cell(0, 0), Cell(1, 1), Cell(2, 1), Cell(3, 2)))
    assert until_finished(world).t_ms == 3000
    assert world.distance_m("c1") == 3.0


def test_time_passes_no_further_than_asked() -> None:
    world = world_of(carrier_at(1, 1))
    world.drive("c1", EAST)
    assert world.advance(999).t_ms == 999
    assert report_of(world, "c1").cell == Cell(2, 1)  # the next one it passes
    assert report_of(world, "c1").free_at_ms == 1000


def test_a_robot_told_to_stop_between_cells_stands_at_the_next_one() -> None:
    world = world_of(carrier_at(1, 1))
    world.drive("c1", EAST)
    world.advance(1000)
    world.advance(1500)
    world.stop("c1")
    assert until_finished(world).finished == ("c1",)
    assert world.now_ms == 2000
    assert report_of(world, "c1").cell == Cell(3, 1)
    assert world.distance_m("c1") == pytest.approx(2.0)


def test_a_stopped_robot_can_be_sent_on_from_where_it_stands() -> None:
    world = world_of(carrier_at(1, 1))
    world.drive("c1", EAST)
    world.stop("c1")
    until_finished(world)
    world.drive("c1", (Cell(2, 1), Cell(1, 1)))
    until_finished(world)
    assert (world.now_ms, report_of(world, "c1").cell) == (2000, Cell(1, 1))


def test_a_drive_to_where_it_stands_ends_at_once() -> None:
    world = world_of(carrier_at(1, 1))
    world.advance(300)
    world.drive("c1", (Cell(1, 1),))
    news = world.advance(LATER)
    assert (news.t_ms, news.finished) == (300, ("c1",))
    assert world.distance_m("c1") == 0.0


def test_distance_and_driving_time_add_up() -> None:
    world = world_of(carrier_at(1, 1), lines=("######", "#....#", "#....#", "######"))
    world.drive("c1", (Cell(1, 1), Cell(2, 2), Cell(3, 2)))
    until_finished(world)
    world.advance(10_000)
    world.drive("c1", (Cell(3, 2), Cell(2, 2)))
    until_finished(world)
    assert world.distance_m("c1") == pytest.approx(2 + 2**0.5)
    assert world.driving_ms("c1") == 3414
    assert world.now_ms == 11_000


def test_undocking_takes_its_time_and_the_rover_then_looks_round() -> None:
    world = world_of(carrier_at(4, 3), rover_on("c1"), lines=ANNEX, carrier_range_m=1.0)
    assert (5, 1) not in known_cells(world)
    world.undock("r1", "c1", Cell(4, 2))
    assert report_of(world, "c1").free_at_ms == report_of(world, "r1").free_at_ms == 5000
    news = world.advance(LATER)
    assert (news.t_ms, news.finished) == (5000, ("c1", "r1"))
    assert [name for name, _ in news.revealed] == ["r1"]
    assert {(3, 1), (5, 1)} <= known_cells(world)
    assert (report_of(world, "r1").cell, report_of(world, "r1").carrier) == (Cell(4, 2), None)


def test_docking_takes_its_time_and_the_rover_is_aboard_from_its_start() -> None:
    world = world_of(carrier_at(4, 3), rover_at(4, 2), lines=ANNEX)
    world.dock("r1", "c1")
    assert (report_of(world, "r1").cell, report_of(world, "r1").carrier) == (None, "c1")
    news = world.advance(LATER)
    assert (news.t_ms, news.finished) == (10_000, ("c1", "r1"))


def test_a_carried_robot_moves_with_its_carrier_and_sees_nothing() -> None:
    world = world_of(carrier_at(1, 1), rover_on("c1"), carrier_range_m=0.1, rover_range_m=5.0)
    world.drive("c1", EAST)
    while not (news := world.advance(LATER)).finished:
        assert all(name == "c1" for name, _ in news.revealed)
    assert report_of(world, "r1").cell is None
    assert world.distance_m("r1") == 0.0
    world.undock("r1", "c1", Cell(6, 1))
    until_finished(world)
    assert report_of(world, "r1").cell == Cell(6, 1)


def test_a_busy_robot_takes_no_command() -> None:
    world = world_of(carrier_at(1, 1), rover_on("c1"))
    world.drive("c1", EAST)
    with pytest.raises(InternalError, match="c1 is not free: driving"):
        world.undock("r1", "c1", Cell(2, 1))
    with pytest.raises(InternalError, match="c1 is not free: driving"):
        world.drive("c1", EAST)


@pytest.mark.parametrize(
    ("team", "command", "refusal"),
    [
        ([rover_on("c1")], lambda world: world.drive("r1", EAST[:2]), "r1 can't drive"),
        ([], lambda world: world.drive("c1", EAST[1:3]), "c1 can't drive from"),
        ([rover_on("c1", 1), rover_at(2, 1, 2)], lambda world: world.dock("r2", "c1"), "r2 can't dock on c1"),
        ([carrier_at(3, 1, 2), rover_on("c1")], lambda world: world.undock("r1", "c2", EAST[3]), "r1 is not on c2"),
    ],
    ids=["a carried robot drives", "a drive starts elsewhere", "the carrier is full", "the rover is elsewhere"],
)
def test_a_command_is_refused_that_does_not_fit_where_robots_are(
    team: list[PlacedRobot], command: Callable[[SimulatedWorld], None], refusal: str
) -> None:
    with pytest.raises(InternalError, match=refusal):
        command(world_of(carrier_at(1, 1, 1), *team))


def test_a_rover_docks_only_where_it_has_a_seat() -> None:
    carrier, rover = kinds_of(capacity=2).values()
    seated = replace(carrier, seats=(("rover", 1), ("large", 1)))
    kinds = {"carrier": seated, "rover": rover, "large": replace(rover, name="large")}
    team = [carrier_at(1, 1), rover_on("c1", 1), rover_at(1, 1, 2), replace(rover_at(1, 1, 3), type="large")]
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds, team)
    world.advance(0)
    with pytest.raises(InternalError, match="r2 can't dock on c1"):
        world.dock("r2", "c1")
    world.dock("r3", "c1")
    assert until_finished(world).finished == ("c1", "r3")


def test_a_lost_robot_stays_where_it_is_and_takes_no_command() -> None:
    world = world_of(carrier_at(1, 1), failures={"c1": 2500})
    world.drive("c1", EAST)
    while not (news := world.advance(LATER)).lost:
        assert not news.finished
    assert (news.t_ms, news.lost) == (2500, (("c1", "failed"),))
    assert report_of(world, "c1").lost
    assert report_of(world, "c1").cell == Cell(3, 1)
    assert not world.advance(LATER).finished
    assert world.distance_m("c1") == pytest.approx(2.0)
    with pytest.raises(InternalError, match="c1 is not free: lost"):
        world.drive("c1", (Cell(3, 1), Cell(4, 1)))


def test_rovers_aboard_a_lost_carrier_are_lost_with_it() -> None:
    world = world_of(carrier_at(1, 1), rover_on("c1"), rover_at(3, 1, 2), failures={"c1": 100})
    news = world.advance(LATER)
    assert news.lost == (("c1", "failed"), ("r1", "aboard c1, which failed"))
    assert [robot.lost for robot in world.robots()] == [True, True, False]


def test_no_robot_is_lost_twice() -> None:
    failures = {"c1": 100, "r1": 50, "r2": 200}
    world = world_of(carrier_at(1, 1), rover_on("c1", 1), rover_on("c1", 2), capacity=2, failures=failures)
    assert world.advance(LATER).lost == (("r1", "failed"),)
    assert world.advance(LATER).lost == (("c1", "failed"), ("r2", "aboard c1, which failed"))
    assert world.advance(LATER).lost == ()


def test_a_carrier_lost_while_docking_leaves_the_rover_where_it_stands() -> None:
    world = world_of(carrier_at(1, 1), rover_at(2, 1), failures={"c1": 4000})
    world.dock("r1", "c1")
    assert [name for name, _ in world.advance(LATER).lost] == ["c1"]
    world.drive("r1", (Cell(2, 1), Cell(3, 1)))
    assert until_finished(world).finished == ("r1",)


def test_a_carrier_lost_while_undocking_leaves_the_rover_free_on_the_ground() -> None:
    world = world_of(carrier_at(1, 1), rover_on("c1"), failures={"c1": 4000})
    world.undock("r1", "c1", Cell(2, 1))
    assert [name for name, _ in world.advance(LATER).lost] == ["c1"]
    world.drive("r1", (Cell(2, 1), Cell(3, 1)))
    news = until_finished(world)
    assert (news.t_ms, news.finished) == (6000, ("r1",))


def test_a_rover_lost_while_docking_leaves_the_carrier_free() -> None:
    world = world_of(carrier_at(1, 1), rover_at(2, 1), failures={"r1": 4000})
    world.dock("r1", "c1")
    assert [name for name, _ in world.advance(LATER).lost] == ["r1"]
    world.drive("c1", (Cell(1, 1), Cell(2, 1)))
    assert until_finished(world).t_ms == 5000


def test_a_lost_rover_takes_up_no_place_aboard() -> None:
    world = world_of(carrier_at(1, 1), rover_on("c1", 1), rover_at(2, 1, 2), failures={"r1": 100})
    world.advance(LATER)
    world.dock("r2", "c1")
    assert until_finished(world).finished == ("c1", "r2")


def test_events_of_the_same_moment_are_reported_in_the_order_of_their_starts() -> None:
    def news_of_two() -> News:
        world = world_of(carrier_at(1, 1, 1), carrier_at(7, 1, 2), lines=CORRIDOR, carrier_range_m=0.1)
        world.drive("c2", (Cell(7, 1), Cell(6, 1)))
        world.drive("c1", (Cell(1, 1), Cell(2, 1)))
        return world.advance(LATER)

    first, second = news_of_two(), news_of_two()
    assert first.finished == second.finished == ("c2", "c1")
    assert [name for name, _ in first.revealed] == ["c2", "c1"]


def test_a_cell_is_revealed_once_by_whoever_saw_it_first() -> None:
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(3, 1, 1), carrier_at(4, 1, 2)])
    indices = np.concatenate([seen for _, seen in world.advance(0).revealed])
    assert len(np.unique(indices)) == len(indices) == len(known_cells(world))


def facing(world: SimulatedWorld, name: str) -> int | None:
    return report_of(world, name).heading


def test_a_robot_faces_along_its_last_step_or_the_one_under_way() -> None:
    world = world_of(carrier_at(1, 1))
    assert facing(world, "c1") is None
    world.drive("c1", EAST[:3])
    assert facing(world, "c1") == 0
    until_finished(world)
    world.drive("c1", EAST[2:0:-1])
    assert facing(world, "c1") == 4
    until_finished(world)
    world.drive("c1", EAST[1:2])
    until_finished(world)
    assert facing(world, "c1") == 4


def test_a_carried_robot_faces_no_way() -> None:
    world = world_of(carrier_at(3, 1), rover_at(1, 1))
    world.drive("r1", EAST[:2])
    until_finished(world)
    assert facing(world, "r1") == 0
    world.dock("r1", "c1")
    assert facing(world, "r1") is None


def test_stops_and_turns_are_counted_where_the_way_bends() -> None:
    world = world_of(carrier_at(1, 1), lines=("######", "#....#", "#....#", "######"))
    world.drive("c1", (Cell(1, 1), Cell(2, 2), Cell(3, 2), Cell(4, 2), Cell(4, 1), Cell(3, 2)))
    until_finished(world)
    made = world.manoeuvres("c1")
    assert (made.stops, made.turns) == (3, (1, 1, 1, 0))


def test_going_on_at_once_is_no_stop_and_going_on_later_is_one() -> None:
    world = world_of(carrier_at(1, 1))
    world.advance(500)
    for k in range(3):
        world.drive("c1", EAST[k : k + 2])
        until_finished(world)
        if k == 1:
            world.advance(world.now_ms + 1)
    assert (world.manoeuvres("c1").stops, world.manoeuvres("c1").turns) == (1, (0, 0, 0, 0))


def test_to_turn_back_at_once_is_a_stop_and_half_a_turn() -> None:
    world = world_of(carrier_at(1, 1))
    world.drive("c1", EAST)
    world.stop("c1")
    news = until_finished(world)
    assert (news.t_ms, report_of(world, "c1").cell) == (1000, Cell(2, 1))
    world.drive("c1", EAST[1::-1])
    assert (world.manoeuvres("c1").stops, world.manoeuvres("c1").turns) == (1, (0, 0, 0, 1))


class _Counting(FieldOfView):
    looks = 0

    def visible(
        self, truth: Grid, kind: RobotType, cell: Cell, known: CellArray | None = None
    ) -> npt.NDArray[np.int64]:
        self.looks += 1
        return super().visible(truth, kind, cell, known)


@pytest.mark.parametrize(("own", "looks"), [(False, len(EAST)), (True, 2 * len(EAST) - 1)])
def test_only_a_sensor_of_the_callers_own_looks_twice_from_a_cell(
    monkeypatch: pytest.MonkeyPatch, own: bool, looks: int
) -> None:
    counting = _Counting()
    monkeypatch.setattr("marsupial.sim.sensing.FieldOfView", lambda: counting)
    sensor = counting if own else None
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1)], sensor=sensor)
    world.advance(0)
    for way in (EAST, EAST[::-1]):
        world.drive("c1", way)
        until_finished(world)
    assert counting.looks == looks

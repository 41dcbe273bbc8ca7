import random
from collections.abc import Mapping

import numpy as np
import pytest
from flickering_world import Blinks, FlickeringWorld
from support.missions.small_missions import Watcher, greedy_strategy

from marsupial.generators.builtin import builtin_scenario
from marsupial.mission.belief.flicker import MOST_FLIPS, MOST_LOSSES, STEADY_MS, Flicker
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.placement import place_team
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, CellArray
from marsupial.model.mission import ActionEnd, ActionEnded, Changed, MissionEnded, Planned, Revealed, Status
from marsupial.model.robots import Role
from marsupial.model.scenario import MissionLimits

LOBBY = builtin_scenario("lobby")
ROVERS = {"rover1_1", "rover1_2", "rover2_1", "rover2_2"}
NOBODY = np.empty(0, dtype=np.int64)


def run(blinks: Blinks, *, forgets: bool = False) -> tuple[MissionEnded, Watcher]:
    """Explore the lobby with a map that flickers."""
    kinds, robots = {kind.name: kind for kind in LOBBY.robot_types}, place_team(LOBBY, 1)
    assert {r.name for r in robots if kinds[r.type].role is Role.ROVER} == ROVERS
    world = FlickeringWorld(LOBBY.grid, kinds, robots, blinks, forgets=forgets)
    watcher = Watcher(LOBBY.grid, kinds, robots)
    order = MissionOrder(goal=LOBBY.goal, limits=MissionLimits(time_ms=600_000), waits=True)
    return MissionLoop(world, kinds, greedy_strategy(), order, watcher).run(), watcher


def floor(count: int, seed: int) -> list[Cell]:
    cells = np.argwhere(LOBBY.grid.cells == FLOOR).tolist()
    return [Cell(x, y) for y, x in random.Random(seed).sample(cells, count)]


def every(period: int, lasting: int, cells: Mapping[Cell, int]) -> Blinks:
    return lambda _world, report: cells if report % period < lasting else {}


def plans(watcher: Watcher) -> int:
    return len(watcher.of(Planned))


STEADY_PLANS = plans(run(lambda _world, _report: {})[1])


@pytest.mark.parametrize("forgets", [False, True])
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_cells_that_are_lost_every_five_reports_do_not_keep_a_team_from_ending(seed: int, forgets: bool) -> None:
    cells = floor(4, seed)
    ended, watcher = run(every(5, 1 if forgets else 2, dict.fromkeys(cells, UNKNOWN)), forgets=forgets)
    assert (ended.status, set(ended.aboard)) == (Status.COMPLETE, ROVERS)
    assert ended.t_ms < 120_000
    assert plans(watcher) <= STEADY_PLANS + 6 * MOST_LOSSES
    assert watcher.of(Changed)
    lost = {left.cell for left in ended.remaining if left.reason.startswith("flickers between known and unknown")}
    assert lost <= {Cell(c.x + dx, c.y + dy) for c in cells for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
    assert lost or not forgets


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_cells_that_are_ground_and_obstacle_by_turns_do_not_stop_robots_each_time(seed: int) -> None:
    ended, watcher = run(every(2, 1, dict.fromkeys(floor(40, seed), OBSTACLE)))
    assert (ended.status, set(ended.aboard)) == (Status.COMPLETE, ROVERS)
    ends = [event.end for event in watcher.of(ActionEnded)]  # type: ignore[attr-defined]
    assert ends.count(ActionEnd.BLOCKED) <= 2 * MOST_FLIPS


@pytest.mark.parametrize("code", [UNKNOWN, OBSTACLE])
def test_noise_all_over_the_map_does_not_keep_a_team_from_ending(code: int) -> None:
    draw, height, width = random.Random(7), *LOBBY.grid.cells.shape

    def noise(_world: FlickeringWorld, report: int) -> Mapping[Cell, int]:
        drawn = [Cell(draw.randrange(width), draw.randrange(height)) for _ in range(height * width // 100)]
        return dict.fromkeys(drawn, code) if report % 3 else {}

    ended, _ = run(noise)
    assert (ended.status, set(ended.aboard)) == (Status.COMPLETE, ROVERS)


@pytest.mark.parametrize("code", [UNKNOWN, OBSTACLE])
def test_cells_that_flicker_under_a_robot_do_not_keep_a_mission_from_ending(code: int) -> None:
    def under(world: FlickeringWorld, report: int) -> Mapping[Cell, int]:
        at = [robot.cell for robot in world.robots() if robot.cell is not None]
        return dict.fromkeys(at, code) if report % 2 else {}

    ended, _ = run(under)
    assert (ended.status, set(ended.aboard)) == (Status.COMPLETE, ROVERS)


def test_a_region_that_is_lost_once_is_explored_again() -> None:
    region = [Cell(x, y) for x in range(14) for y in range(20)]
    ended, watcher = run(lambda _world, report: dict.fromkeys(region, UNKNOWN) if report == 30 else {}, forgets=True)
    (lost,) = watcher.of(Changed)
    count = sum(lost.runs[1::3])  # type: ignore[attr-defined]
    again = [e for e in watcher.of(Revealed) if e.t_ms > lost.t_ms]
    assert count > 50
    assert sum(sum(e.runs[1::3]) for e in again) > 0.8 * count  # type: ignore[attr-defined]
    assert (ended.status, set(ended.aboard)) == (Status.COMPLETE, ROVERS)


class Row:
    """A map of one row of floor, and its flicker filter."""

    def __init__(self) -> None:
        self.told: CellArray = np.full((1, 12), FLOOR, dtype=np.uint8)
        self.flicker = Flicker(self.told, self.told.copy())
        self.now_ms = 0

    def tell(self, code: int, cell: int = 5, *, after_ms: int = 1000, under: tuple[int, ...] = ()) -> int:
        """Report a code for a cell; return the code that the filter gives it."""
        self.now_ms += after_ms
        self.told[0, cell] = code
        self.flicker.update(np.array([cell]), self.now_ms, np.array(under, dtype=np.int64))
        return int(self.flicker.cells[0, cell])


def test_a_cell_that_is_lost_once_or_twice_is_lost_and_then_counts_as_what_it_was() -> None:
    row = Row()
    for _ in range(MOST_LOSSES):
        assert (row.tell(UNKNOWN), row.tell(FLOOR)) == (UNKNOWN, FLOOR)
    assert (row.tell(UNKNOWN), row.tell(OBSTACLE), row.tell(UNKNOWN)) == (FLOOR, OBSTACLE, OBSTACLE)
    assert [row.tell(UNKNOWN, cell) for cell in (2, 3, 7, 8)] == [UNKNOWN, FLOOR, FLOOR, UNKNOWN]


def test_a_cell_that_stays_lost_though_robots_stand_beside_it_counts_as_what_it_was() -> None:
    row = Row()
    row.tell(UNKNOWN)
    for _ in range(MOST_LOSSES):
        row.flicker.visited(np.array([4, 5, 6]))
    row.flicker.update(NOBODY, row.now_ms, NOBODY)
    assert row.flicker.cells[0, 5] == FLOOR


def test_a_door_may_close_and_open_twice_and_then_counts_as_closed_until_it_is_steady() -> None:
    row = Row()
    for _ in range(MOST_FLIPS // 2):
        assert (row.tell(OBSTACLE), row.tell(FLOOR)) == (OBSTACLE, FLOOR)
    assert (row.tell(OBSTACLE), row.tell(FLOOR)) == (OBSTACLE, OBSTACLE)
    assert row.flicker.remaining(row.now_ms)[0].cell == Cell(5, 0)
    row.flicker.update(NOBODY, row.now_ms + STEADY_MS + 1, NOBODY)
    assert row.flicker.cells[0, 5] == FLOOR
    assert row.flicker.remaining(row.now_ms + STEADY_MS + 1) == ()


def test_a_door_that_rarely_opens_and_closes_always_has_its_reported_code() -> None:
    row = Row()
    for _ in range(3 * MOST_FLIPS):
        assert row.tell(OBSTACLE, after_ms=STEADY_MS + 1) == OBSTACLE
        assert row.tell(FLOOR, after_ms=STEADY_MS + 1) == FLOOR


def test_a_cell_that_flickers_under_a_robot_counts_as_ground() -> None:
    row = Row()
    for code in (OBSTACLE, FLOOR) * (MOST_FLIPS // 2):
        row.tell(code, under=(5,))
    assert (row.tell(OBSTACLE, under=(5,)), row.tell(FLOOR, under=(5,)), row.tell(FLOOR)) == (FLOOR, FLOOR, OBSTACLE)


def test_before_a_mission_ends_flickering_cells_have_their_reported_codes() -> None:
    row = Row()
    for code in (OBSTACLE, FLOOR) * (MOST_FLIPS // 2 + 1):
        row.tell(code)
    assert row.flicker.cells[0, 5] == OBSTACLE
    known, changed = row.flicker.release(row.now_ms, NOBODY)
    assert (len(known), changed.tolist(), row.flicker.cells[0, 5]) == (0, [5], FLOOR)

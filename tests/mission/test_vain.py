"""Missions in which some cells are never revealed."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest
from glass_world import GlassWorld
from support.missions.small_missions import Recorder, greedy_strategy
from support.missions.small_teams import ANNEX, carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.maps.targets import Target
from marsupial.mission.belief.vain import APART_MS, MOST_LOOKS, UNREVEALED, VainLooks
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.model.grid import FLOOR, Cell
from marsupial.model.mission import MissionEnded, PlacedRobot, Planned, Status
from marsupial.model.plan import Action, ActionName
from marsupial.model.scenario import Goal, MissionLimits

HALL = ("#" * 14, *["#" + "." * 12 + "#"] * 6, "#" * 14)
BLACK_WALL = ("#" * 24, *["#" + "." * 22 + "#"] * 4, "#" * 24)
ROOMS = ("#########", "#...#...#", "#.......#", "#...#...#", "#########")
"""Two rooms with a door at (4, 2)."""


def explore(
    lines: Sequence[str], robots: Sequence[PlacedRobot], glass: Iterable[Cell], goal: Goal | None = None, **how: Any
) -> tuple[MissionEnded, int]:
    """Return the end of a mission with a time limit of 1000 s, and its number of plans."""
    kinds, recorder = kinds_of(), Recorder()
    world = GlassWorld(drawn_grid(*lines), kinds, robots, glass, **how)
    order = MissionOrder(goal=goal or Goal(recover_rovers=False), limits=MissionLimits(time_ms=1_000_000), waits=True)
    return MissionLoop(world, kinds, greedy_strategy(), order, recorder).run(), len(recorder.of(Planned))


def given_up(ended: MissionEnded) -> int:
    return sum(left.frontier_cells for left in ended.remaining if left.reason == UNREVEALED)


@pytest.mark.parametrize("late_ms", [0, 10_000, 20_000])
def test_a_cell_that_no_sensor_shows_is_given_up_after_three_looks_also_if_the_map_is_late(late_ms: int) -> None:
    clear, plans = explore(HALL, [carrier_at(2, 2)], [], late_ms=late_ms)
    ended, more = explore(HALL, [carrier_at(2, 2)], [Cell(7, 4)], late_ms=late_ms)
    assert (clear.status, given_up(clear)) == (Status.COMPLETE, 0)
    assert (ended.status, given_up(ended), ended.explored_area_m2) == (Status.COMPLETE, 4, clear.explored_area_m2 - 1)
    assert more <= plans + 10 * MOST_LOOKS


@pytest.mark.parametrize("carriers", [1, 6])
def test_a_black_wall_does_not_keep_a_mission_from_ending(carriers: int) -> None:
    robots = [carrier_at(2 + i, 2, i + 1) for i in range(carriers)]
    ended, plans = explore(BLACK_WALL, robots, [Cell(x, 5) for x in range(2, 22)])
    assert (ended.status, given_up(ended), ended.explored_area_m2) == (Status.COMPLETE, 20, 88.0)
    assert ended.t_ms < 120_000
    assert plans < 60


def test_a_rover_before_glass_comes_back_aboard() -> None:
    ended, plans = explore(ANNEX, [carrier_at(1, 3), rover_on("c1")], [Cell(6, 1)], Goal(recover_rovers=True))
    assert (ended.status, ended.aboard) == (Status.COMPLETE, ("r1",))
    assert given_up(ended)
    assert (ended.deployments == ended.retrievals <= MOST_LOOKS, plans < 12) == (True, True)


def test_a_robot_waits_beside_a_cell_for_a_late_map_instead_of_driving_to_and_fro() -> None:
    ended, plans = explore(ROOMS, [carrier_at(1, 1)], [Cell(4, 2)])
    assert (ended.status, plans, ended.distance_m[0][1] < 3) == (Status.COMPLETE, 1, True)
    assert ended.t_ms - 2414 == (MOST_LOOKS - 1) * APART_MS


def test_a_given_up_cell_is_looked_at_again_once_a_known_cell_beside_it_changes() -> None:
    # the second carrier is still exploring when a door opens beside the cell that the first one has given up
    rooms = ("#" * 40, "#...#" + "." * 34 + "#", "#...." + "." * 34 + "#", "#...#" + "." * 34 + "#", "#" * 40)
    robots, door = [carrier_at(1, 1), carrier_at(6, 1, 2)], Cell(4, 3)
    still, _ = explore(rooms, robots, [Cell(4, 2)])
    opened, _ = explore(rooms, robots, [Cell(4, 2)], opening=[(33_000, door, FLOOR)])
    assert (opened.status, given_up(still), given_up(opened)) == (Status.COMPLETE, 2, 3)
    assert opened.distance_m[0][1] > still.distance_m[0][1]


def test_a_rover_that_comes_back_from_out_of_contact_has_looked_at_the_targets_it_was_sent_to() -> None:
    kinds = kinds_of()
    world = GlassWorld(drawn_grid("#" * 8, "#......#", "#" * 8), kinds, [rover_at(1, 1)], [Cell(4, 1)])
    world.advance(0)
    beside = Target(name="t_3_1", cell=Cell(3, 1), viewpoints={"rover": Cell(3, 1)}, cells=np.array([11]), reveal_m2=1)
    done = Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=1, robot="r1", place="t_3_1")
    looks = VainLooks(world, kinds, lambda kind, start, goal: None)
    looks.add_looks([], [], [done])
    assert not looks.any
    looks.send("r1", [beside])
    looks.add_looks([], [], [done])  # plans have left the target to it
    assert looks.any

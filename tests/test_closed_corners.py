"""Missions of one-cell robots never end with an unreachable frontier."""

from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st
from support.maps.drawn_maps import draw, random_cells
from support.missions.simulated_missions import STEP, Insider, team_at
from support.missions.small_missions import Watcher
from support.missions.small_teams import kinds_of

from marsupial.library.missions import simulate
from marsupial.mission.placement import place_team
from marsupial.model import FLOOR, OBSTACLE, Cell, CellArray, Goal, Grid, MissionEnded, Scenario, Status
from marsupial.strategies.clairvoyant import CLAIRVOYANT

KINDS = tuple(replace(kind, radius_m=0.6) for kind in kinds_of(capacity=1).values())
"""Robots that cover only their own cell of 1 m, and touch diagonal neighbours."""


@st.composite
def scenarios(drawn: st.DrawFn) -> Scenario:
    cells = drawn(random_cells((OBSTACLE, FLOOR, FLOOR), smallest=3, largest=8))
    height, width = cells.shape
    x, y = drawn(st.integers(0, width - 1)), drawn(st.integers(0, height - 1))
    cells[y, x] = FLOOR
    return corners(cells, Cell(x, y))


def corners(cells: CellArray, start: Cell) -> Scenario:
    """Return the scenario of a carrier at that cell with a rover aboard."""
    grid = Grid(cells=cells, resolution_m=1.0)
    return Scenario(name="corners", grid=grid, robot_types=KINDS, team=team_at(start, rovers=1), goal=Goal())


def explore(scenario: Scenario, strategy: str) -> MissionEnded:
    kinds = {kind.name: kind for kind in scenario.robot_types}
    watch = Insider if strategy == CLAIRVOYANT else Watcher
    watcher = watch(scenario.grid, kinds, place_team(scenario, 1))
    simulate(scenario, strategy=strategy, planner="greedy", budget=STEP, seed=1, observer=watcher)
    assert watcher.faults == []
    ended = watcher.events[-1]
    assert isinstance(ended, MissionEnded)
    return ended


def test_ground_behind_a_closed_corner_is_not_part_of_the_mission() -> None:
    cells = draw("######", "#..###", "#.c#.#", "###..#", "######").cells
    scenario = corners(cells, Cell(2, 2))
    for ended in (explore(scenario, "heuristic"), explore(scenario, CLAIRVOYANT)):
        assert (ended.status, ended.remaining, ended.coverage) == (Status.COMPLETE, (), 1.0)


@settings(max_examples=25)
@given(scenarios())
def test_a_mission_leaves_no_frontier(scenario: Scenario) -> None:
    ended = explore(scenario, "heuristic")
    assert (ended.status, ended.remaining, ended.coverage) == (Status.COMPLETE, (), 1.0)


@settings(max_examples=25)
@given(scenarios())
def test_the_clairvoyant_leaves_only_frontiers_that_robots_can_get_to(scenario: Scenario) -> None:
    # it need not look at walls, since all reachable cells have been seen
    ended = explore(scenario, CLAIRVOYANT)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert {left.reason for left in ended.remaining} <= {"nothing reachable is behind it"}

import random
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from flickering_world import FlickeringWorld
from support.missions.small_missions import Recorder, greedy_strategy
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of, rover_on

from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.maps.footprint import footprint_of
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, Cell, Grid
from marsupial.model.mission import Changed, Planned, Status
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType, TeamMember
from marsupial.model.scenario import Goal, MissionLimits, Scenario
from marsupial.sim.sensors import FieldOfView

NICHE = drawn_grid(
    "##########",
    "#,,,,,,,,#",
    "#,,,,,,,,#",
    "#,,,,,,,,#",
    "##,,,#####",
    "###,######",
    "#...######",
    "##..######",
    "##########",
)
"""From (2, 2) all of the hall is seen, but only from (3, 2) all of the door above it."""

RECESS = drawn_grid(
    "##############",
    "#,,,,,,,,,,,,#",
    "#,,,,,,,,,,,,#",
    "#,,,,,,,,,,,,#",
    "########,,,###",
    "########,,,###",
    "########,,,###",
    "#............#",
    "##############",
)
"""From the left end of the hall (y = 1) all of it is seen, but not the ground behind the recess in its wall."""

HALL, ROVERS_CELLS = 12, 2 + 3 + 10
"""Numbers of cells that the carrier reaches, and the rover, whose disc covers its neighbouring cells."""


def kinds(carrier_range_m: float) -> dict[str, RobotType]:
    types = kinds_of(carrier_range_m=carrier_range_m)
    return {**types, "rover": replace(types["rover"], radius_m=1.2, terrains=frozenset({ROUGH}))}


def run(grid: Grid, start: Cell, carrier_range_m: float, strategy: str, sensor: FieldOfView | None = None) -> Summary:
    team = (TeamMember(name="c1", type="carrier", start=start), TeamMember(name="r1", type="rover", carrier="c1"))
    scenario = Scenario(name="x", grid=grid, robot_types=tuple(kinds(carrier_range_m).values()), team=team)
    return simulate(scenario, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=1, sensor=sensor)


class Blind(FieldOfView):
    """Sees nothing above the hall and the row of cells along it."""

    def visible(self, truth: Grid, kind: RobotType, cell: Cell) -> npt.NDArray[np.int64]:
        seen = super().visible(truth, kind, cell)
        return seen[seen < 3 * truth.width]


@pytest.mark.parametrize("strategy", ["heuristic", "assignment", "temporal"])
def test_a_carrier_goes_where_it_sees_whether_a_rover_can_be_set_down(strategy: str) -> None:
    summary = run(NICHE, Cell(2, 2), 3.0, strategy)
    assert (summary.status, summary.coverage, summary.reachable_area_m2) == (Status.COMPLETE, 1.0, 5 + 1 + 3 + 6)


@pytest.mark.parametrize("strategy", ["heuristic", "assignment", "temporal"])
def test_ground_behind_an_unseen_recess_is_explored(strategy: str) -> None:
    summary = run(RECESS, Cell(1, 1), 20.0, strategy)
    area = (summary.explored_area_m2, summary.reachable_area_m2)
    assert (summary.status, *area) == (Status.COMPLETE, HALL + ROVERS_CELLS, HALL + ROVERS_CELLS)


def test_ground_that_is_never_shown_is_looked_for_once() -> None:
    summary = run(RECESS, Cell(1, 1), 20.0, "heuristic", Blind())
    assert (summary.status, summary.explored_area_m2, summary.replans) == (Status.COMPLETE, HALL, 1)


def test_ground_that_is_never_shown_is_looked_for_once_while_the_map_changes() -> None:
    types, robots = kinds(20.0), (carrier_at(1, 1), rover_on("c1"))

    def wall_moves(_: FlickeringWorld, report: int) -> Mapping[Cell, int]:
        return {Cell(report % 12 + 1, 0): FLOOR}

    world = FlickeringWorld(RECESS, types, robots, wall_moves, sensor=Blind())
    recorder = Recorder()
    order = MissionOrder(goal=Goal(), limits=MissionLimits(time_ms=600_000))
    ended = MissionLoop(world, types, greedy_strategy(), order, recorder).run()
    looks = {action.place for event in recorder.of(Planned) for action in event.actions}
    assert (ended.status, len(looks)) == (Status.COMPLETE, 1)
    assert recorder.of(Changed)


@pytest.mark.parametrize("seed", [*range(16), 80, 261, 278, 298])
def test_the_explored_area_does_not_depend_on_the_strategy(seed: int) -> None:
    scenario = odd_world(random.Random(seed))
    for strategy in ("heuristic", "heuristic-plus", "assignment"):
        summary = simulate(scenario, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=1)
        assert summary.status is not Status.COMPLETE or summary.coverage == 1.0


def odd_world(rng: random.Random) -> Scenario:
    """Draw a world with separate ground for each role, and a team that sees little farther than it docks."""
    width, height = rng.randint(7, 11), rng.randint(6, 9)
    cells = np.full((height, width), OBSTACLE, dtype=np.uint8)
    border = rng.randint(2, height - 3)
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            ground = FLOOR if y < border or (y == border and rng.random() < 0.5) else ROUGH
            cells[y, x] = rng.choices((ground, OBSTACLE), (4, 1))[0]
    types = kinds_of(carrier_range_m=rng.choice((1.0, 1.5, 2.0, 3.0)))
    carrier = replace(types["carrier"], radius_m=rng.choice((0.0, 0.6, 1.1, 1.5)))
    rover = replace(types["rover"], radius_m=rng.choice((0.0, 0.6, 1.1)), terrains=frozenset({ROUGH}))
    grid = Grid(cells=cells, resolution_m=1.0)
    stands = np.argwhere(footprint_of(grid, carrier).standable).tolist()
    if not stands:
        return odd_world(rng)
    y, x = rng.choice(stands)
    team = (TeamMember(name="c1", type="carrier", start=Cell(x, y)), TeamMember(name="r1", type="rover", carrier="c1"))
    return Scenario(name="odd", grid=grid, robot_types=(carrier, rover), team=team)

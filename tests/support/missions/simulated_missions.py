"""Whole missions from a scenario, by a strategy or the clairvoyant, with a check of physical rules."""

from collections.abc import Mapping, Sequence

from support.missions.small_missions import Watcher
from support.missions.small_teams import drawn_grid, kinds_of

from marsupial.library.missions import simulate
from marsupial.mission.placement import place_team
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import MissionEnded, PlacedRobot, Revealed
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType, TeamMember, uniform_team
from marsupial.model.scenario import Goal, Scenario
from marsupial.strategies.clairvoyant import CLAIRVOYANT

STEP = Budget(steps=1)


class Insider(Watcher):
    """Checks robots against the true map instead of the known one: the clairvoyant may drive over unseen cells."""

    def __init__(self, grid: Grid, kinds: Mapping[str, RobotType], robots: Sequence[PlacedRobot]) -> None:
        super().__init__(grid, kinds, robots)
        self._known = grid.solid().cells

    def _reveal(self, event: Revealed) -> None:
        pass


def team_at(*carriers: tuple[int, int], rovers: int = 0) -> tuple[TeamMember, ...]:
    """Return carriers ``c1``, ``c2``... at these cells, with `rovers` docked rovers each: ``r1_1``, ``r1_2``..."""
    team: list[TeamMember] = []
    for i, at in enumerate(carriers, 1):
        team.append(TeamMember(name=f"c{i}", type="carrier", start=Cell(*at)))
        team += [TeamMember(name=f"r{i}_{j}", type="rover", carrier=f"c{i}") for j in range(1, rovers + 1)]
    return tuple(team)


def drawn_scenario(
    *lines: str, team: tuple[TeamMember, ...] = uniform_team(1, 1), goal: Goal | None = None
) -> Scenario:
    """Return the scenario of a drawing, with carriers that hold two rovers."""
    kinds = tuple(kinds_of(capacity=2).values())
    return Scenario(name="drawn", grid=drawn_grid(*lines), robot_types=kinds, team=team, goal=goal or Goal())


def watched(scenario: Scenario, strategy: str, seed: int = 1) -> tuple[MissionEnded, Watcher]:
    """Run a mission with one step for each replanning; return its end and the watcher."""
    kinds = {kind.name: kind for kind in scenario.robot_types}
    kind_of_watcher = Insider if strategy == CLAIRVOYANT else Watcher
    watcher = kind_of_watcher(scenario.grid, kinds, place_team(scenario, seed))
    simulate(scenario, strategy=strategy, planner="greedy", budget=STEP, seed=seed, observer=watcher)
    ended = watcher.events[-1]
    assert isinstance(ended, MissionEnded)
    return ended, watcher

import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.maps.drawn_maps import carrier, draw, rover
from support.missions.reference_missions import reference_log
from support.missions.simulated_missions import STEP, drawn_scenario, team_at, watched
from support.missions.small_teams import ANNEX, kinds_of

from marsupial.generators import GENERATORS
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.metrics import PlanningTimes
from marsupial.library.missions import reachable_area, simulate
from marsupial.mission.observer import Observer
from marsupial.mission.placement import place_team
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, Cell, Grid, Mask
from marsupial.model.mission import MissionEvent, Status
from marsupial.model.planning import Outcome
from marsupial.model.robots import TeamMember, uniform_team
from marsupial.model.scenario import Goal, Scenario
from marsupial.model.strategy import PlanningReport
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import RULES, STRATEGIES, frontier_rule

WITH_ROVERS = [name for name in STRATEGIES if name not in RULES]
EVERYBODY = [*WITH_ROVERS, CLAIRVOYANT]


def report(wall_s: float, first_plan_s: float | None = None) -> PlanningReport:
    return PlanningReport(planner="p", outcome=Outcome.SATISFICING, wall_s=wall_s, first_plan_s=first_plan_s)


def test_planning_statistics_are_over_all_replannings() -> None:
    stats = PlanningTimes.of([report(1.0, 0.5), report(3.0), report(2.0, 1.5)])
    assert (stats.median, stats.max, stats.total, stats.first_plan) == (2.0, 3.0, 6.0, 1.0)
    assert stats.p95 == pytest.approx(2.9)


def test_without_any_replanning_all_statistics_are_zero() -> None:
    stats = PlanningTimes.of([])
    assert (stats.median, stats.p95, stats.max, stats.total, stats.first_plan) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_the_area_to_explore_is_what_some_robot_of_the_team_can_get_to() -> None:
    alone = drawn_scenario(*ANNEX, team=uniform_team(1, 0))
    together = drawn_scenario(*ANNEX)
    assert np.count_nonzero(reachable_area(alone, place_team(alone, 1))) == 9
    assert np.count_nonzero(reachable_area(together, place_team(together, 1))) == 9 + 1 + 9


class Order(Observer):
    """Records all calls, and the reachable area."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.cells = 0

    def reachable(self, area: Mask) -> None:
        self.told.append("reachable")
        self.cells = int(np.count_nonzero(area))

    def event(self, event: MissionEvent) -> None:
        self.told.append("event")

    def analysing(self) -> None:
        self.told.append("analysing")

    def analysed(self) -> None:
        self.told.append("analysed")


def test_observers_receive_the_reachable_area_once_and_first() -> None:
    watcher = Order()
    simulate(drawn_scenario(*ANNEX), strategy="heuristic", planner="greedy", budget=STEP, seed=3, observer=watcher)
    assert watcher.told[0] == "reachable"
    assert watcher.told.count("reachable") == 1
    assert watcher.cells == 9 + 1 + 9


def test_analyses_begin_and_end_one_after_the_other() -> None:
    watcher = Order()
    simulate(drawn_scenario(*ANNEX), strategy="heuristic", planner="greedy", budget=STEP, seed=3, observer=watcher)
    analyses = [word for word in watcher.told if word.startswith("analys")]
    assert len(analyses) > 2
    assert analyses == ["analysing", "analysed"] * (len(analyses) // 2)


def test_a_mission_starts_with_what_is_fixed_and_ends_with_its_report() -> None:
    ended, watcher = watched(drawn_scenario(*ANNEX), "temporal", 1)
    first = watcher.events[0]
    assert (first.scenario, first.strategy, first.planner, first.width, first.height) == (
        "drawn", "temporal", "greedy", 11, 5
    )  # fmt: skip
    assert watcher.events[-1] == ended


def test_the_same_mission_is_the_same_bytes_in_another_process() -> None:
    code = (
        "import json, sys; from support.missions.reference_missions import reference_log as log;"
        "print(json.dumps({name: log('lobby', strategy=name, seed=4) for name in sys.argv[1:]}))"
    )
    env = os.environ | {"PYTHONHASHSEED": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code, *EVERYBODY], env=env, check=True, capture_output=True, text=True)
    logs = {name: reference_log("lobby", strategy=name, seed=4) for name in EVERYBODY}
    assert json.loads(done.stdout) == logs
    assert all(log.count("\n") > 20 for log in logs.values())


def small_cave(carriers: int, rovers: int) -> Scenario:
    grid = GENERATORS["cave"].make(width_m=20.0, height_m=15.0, resolution_m=0.25, seed=1)
    return replace(builtin_scenario("cave", carriers, rovers), grid=grid)


@pytest.mark.parametrize("strategy", WITH_ROVERS)
@pytest.mark.parametrize("name", ["lobby", "rooms", "cave"])
def test_robots_do_what_robots_can_do(name: str, strategy: str) -> None:
    ended, watcher = watched(small_cave(2, 2) if name == "cave" else builtin_scenario(name), strategy, 5)
    assert watcher.faults == []
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0)
    assert len(ended.aboard) == 4


@pytest.mark.parametrize("strategy", RULES)
def test_robots_without_rovers_do_what_robots_can_do(strategy: str) -> None:
    carriers = frontier_rule(strategy).most_robots or 4
    scenario = builtin_scenario("lobby", carriers, 0) if strategy == "covering" else small_cave(carriers, 0)
    ended, watcher = watched(scenario, strategy, 5)
    assert watcher.faults == []
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0)


@pytest.mark.parametrize("strategy", EVERYBODY)
def test_teams_of_several_carrier_and_rover_types_work_together(strategy: str) -> None:
    scenario = builtin_scenario("lobby")
    carrier, rover = scenario.robot_types
    truck = replace(carrier, name="truck", radius_m=0.45, speed_mps=1.5, capacity=1)
    midget = replace(rover, name="midget", radius_m=0.05, dock_ms=4_000, undock_ms=3_000)
    team = (
        TeamMember(name="c1", type="carrier"),
        TeamMember(name="k1", type="truck"),
        TeamMember(name="r1", type="rover", carrier="c1"),
        TeamMember(name="q1", type="midget", carrier="c1"),
        TeamMember(name="q2", type="midget", carrier="k1"),
    )
    scenario = replace(scenario, robot_types=(carrier, truck, rover, midget), team=team)
    for seed in (1, 2):
        ended, watcher = watched(scenario, strategy, seed)
        assert watcher.faults == []
        assert (ended.status, ended.coverage, len(ended.aboard)) == (Status.COMPLETE, 1.0, 3)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """Draw a small map with walls and rough ground, a team and a goal."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.integers(3, 12)), draw(st.integers(3, 12))
    walls, rough = draw(st.sampled_from([0.1, 0.25])), draw(st.sampled_from([0.0, 0.3]))
    cells = rng.choice(
        np.array([OBSTACLE, ROUGH, FLOOR], dtype=np.uint8), size=size, p=[walls, rough, 1 - walls - rough]
    )
    cells[rng.integers(size[0]), rng.integers(size[1])] = FLOOR
    floor = np.argwhere(cells == FLOOR)
    carriers, rovers = min(draw(st.integers(1, 2)), len(floor)), draw(st.integers(0, 2))
    starts = [(int(x), int(y)) for y, x in floor[rng.permutation(len(floor))[:carriers]]]
    reach = {"carrier_range_m": draw(st.sampled_from([0.5, 3.0])), "rover_range_m": draw(st.sampled_from([0.5, 2.0]))}
    return Scenario(
        name="random",
        grid=Grid(cells=cells, resolution_m=1.0),
        robot_types=tuple(kinds_of(capacity=draw(st.integers(max(1, rovers), 2)), **reach).values()),
        team=team_at(*starts, rovers=rovers),
        goal=Goal(recover_rovers=draw(st.booleans()), return_home=draw(st.booleans())),
    )


SHORT_SIGHTED = Scenario(
    name="nothing to stop for",
    grid=draw(".,.", "#.,", "..."),
    robot_types=(carrier(radius_m=0.1, range_m=0.5), rover(range_m=0.5)),
    team=team_at((0, 0), rovers=1),
    goal=Goal(recover_rovers=False),
)
"""The clairvoyant's plan for it has moves but no target."""

HOMEWARD = Scenario(
    name="two that see no farther than they stand, one of them at home when all is explored",
    grid=draw("...", "#..", "..#"),
    robot_types=(carrier(radius_m=0.1, range_m=0.5), rover(range_m=0.5)),
    team=(
        TeamMember(name="c1", type="carrier", start=Cell(1, 1)),
        TeamMember(name="c2", type="carrier", start=Cell(1, 0)),
    ),
    goal=Goal(recover_rovers=False, return_home=True),
)


@pytest.mark.parametrize("strategy", EVERYBODY)
@settings(max_examples=20)
@given(scenarios())
@example(SHORT_SIGHTED)
@example(HOMEWARD)
def test_any_small_map_is_explored_whole_and_no_rover_left_behind(strategy: str, scenario: Scenario) -> None:
    ended, watcher = watched(scenario, strategy)
    assert watcher.faults == []
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0), ended.reason
    if scenario.goal.recover_rovers or scenario.goal.return_home:
        assert len(ended.aboard) == sum(member.carrier is not None for member in scenario.team)
    if scenario.goal.return_home:
        assert all(watcher.cell[m.name] == m.start for m in scenario.team if m.start is not None)

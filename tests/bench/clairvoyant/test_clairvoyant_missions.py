from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_missions import ANNEX, CORRIDOR, Watcher, drawn_grid, kinds_of

from marsupial.bench.clairvoyant import CLAIRVOYANT
from marsupial.bench.compare.plan import Case, Contender, Trial
from marsupial.bench.compare.trial import carry_out
from marsupial.bench.simulate import MissionSummary, simulate
from marsupial.cli.comparing import contenders
from marsupial.errors import UsageError
from marsupial.formats.missionlog import encode_event
from marsupial.maps.builtin import builtin_scenario
from marsupial.mission.placement import place_team
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, Cell, Grid
from marsupial.model.mission import PlacedRobot, Revealed, Status
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType, TeamMember
from marsupial.model.scenario import Goal, Limits, Scenario

STEP = Budget(steps=1)

LONG = ("#################", "#...............#", "#################")


class Insider(Watcher):
    """Holds robots to the truth, not to what they have seen: they may drive where nobody has looked."""

    def __init__(self, grid: Grid, kinds: Mapping[str, RobotType], robots: Sequence[PlacedRobot]) -> None:
        super().__init__(grid, kinds, robots)
        self._known = grid.solid().cells

    def _reveal(self, event: Revealed) -> None:
        pass


def team(*carriers: tuple[int, int], rovers: int = 0) -> tuple[TeamMember, ...]:
    members = [TeamMember(name=f"c{i}", type="carrier", start=Cell(*at)) for i, at in enumerate(carriers, 1)]
    aboard = [
        TeamMember(name=f"r{i}_{j}", type="rover", carrier=f"c{i}")
        for i in range(1, len(carriers) + 1)
        for j in range(1, rovers + 1)
    ]
    return (*members, *aboard)


def drawn(*lines: str, members: tuple[TeamMember, ...], goal: Goal | None = None) -> Scenario:
    return Scenario(
        name="drawn",
        grid=drawn_grid(*lines),
        robot_types=tuple(kinds_of(capacity=2).values()),
        team=members,
        goal=goal or Goal(),
    )


def flown(scenario: Scenario, seed: int = 1, budget: Budget = STEP) -> tuple[MissionSummary, Insider]:
    kinds = {kind.name: kind for kind in scenario.robot_types}
    watcher = Insider(scenario.grid, kinds, place_team(scenario, seed))
    summary = simulate(scenario, strategy_name=CLAIRVOYANT, planner="none", budget=budget, seed=seed, observer=watcher)
    assert watcher.faults == []
    return summary, watcher


@pytest.mark.parametrize(
    ("lines", "starts", "seconds"),
    [
        (CORRIDOR, [(4, 1)], 0),  # both ends are 3 cells away, which is how far a carrier sees
        (CORRIDOR, [(3, 1)], 1),
        (CORRIDOR, [(1, 1)], 3),
        (LONG, [(1, 1)], 11),
        (LONG, [(6, 1)], 10),  # 2 s to the near end, 8 s back to where the far one is in sight
        (LONG, [(6, 1), (7, 1)], 5),  # one end each
    ],
)
def test_halls_are_explored_in_the_time_it_takes_at_least(
    lines: tuple[str, ...], starts: list[tuple[int, int]], seconds: int
) -> None:
    summary, _ = flown(drawn(*lines, members=team(*starts)))
    assert (summary.ended.status, summary.ended.exploration_ms) == (Status.COMPLETE, 1000 * seconds)


@pytest.mark.parametrize(("start", "seconds"), [(4, 17), (1, 20)])
def test_a_rover_is_set_down_at_the_door_and_looks_at_the_near_end_first(start: int, seconds: int) -> None:
    # 5 s to set it down, 4 s to (3, 1), from where it sees the west end, 8 s to (7, 1)
    summary, _ = flown(drawn(*ANNEX, members=team((start, 3), rovers=1)))
    assert (summary.ended.status, summary.ended.exploration_ms) == (Status.COMPLETE, 1000 * seconds)
    assert (summary.ended.deployments, summary.ended.retrievals, len(summary.ended.aboard)) == (1, 1, 1)


def test_two_rovers_share_what_is_behind_the_door() -> None:
    # the first is on the ground after 5 s and at (7, 1) 8 s later, the second after 10 s and at (3, 1) 4 s later
    summary, _ = flown(drawn(*ANNEX, members=team((4, 3), rovers=2)))
    assert (summary.ended.exploration_ms, summary.ended.deployments) == (14_000, 2)


def test_without_a_wish_for_rovers_the_mission_ends_when_all_is_seen() -> None:
    summary, _ = flown(drawn(*ANNEX, members=team((4, 3), rovers=1), goal=Goal(recover_rovers=False)))
    ended = summary.ended
    assert (ended.status, ended.exploration_ms, ended.t_ms, ended.retrievals) == (Status.COMPLETE, 17_000, 17_000, 0)


def test_the_team_comes_home_if_asked_to() -> None:
    summary, watcher = flown(
        drawn(*ANNEX, members=team((1, 3), rovers=1), goal=Goal(recover_rovers=True, return_home=True))
    )
    assert (summary.ended.status, len(summary.ended.aboard)) == (Status.COMPLETE, 1)
    assert watcher.cell["c1"] == Cell(1, 3)


def test_what_nobody_can_reach_is_left_out() -> None:
    summary, _ = flown(drawn("########", "#...#..#", "########", members=team((1, 1))))
    ended = summary.ended
    assert (ended.status, ended.coverage, ended.reachable_area_m2) == (Status.COMPLETE, 1.0, 3.0)


def test_a_time_limit_ends_the_mission_with_what_is_known_by_then() -> None:
    scenario = replace(drawn(*LONG, members=team((1, 1))), limits=Limits(time_ms=5000))
    ended = flown(scenario)[0].ended
    assert (ended.status, ended.t_ms, ended.exploration_ms) == (Status.TIME_LIMIT, 5000, None)
    assert ended.coverage == pytest.approx(9 / 15)


def test_a_cancelled_mission_says_so() -> None:
    summary = simulate(
        drawn(*LONG, members=team((1, 1))),
        strategy_name=CLAIRVOYANT, planner="none", budget=STEP, seed=1, cancelled=lambda: True,
    )  # fmt: skip
    assert summary.ended.status is Status.CANCELLED


@pytest.mark.parametrize("name", ["lobby", "rooms"])
def test_all_that_is_reachable_is_seen_on_built_in_maps_and_sooner_than_by_a_strategy(name: str) -> None:
    scenario = builtin_scenario(name)
    summary, _ = flown(scenario, seed=5)
    ended = summary.ended
    assert (ended.status, ended.coverage, ended.plans_invalid, len(ended.aboard)) == (Status.COMPLETE, 1.0, 0, 4)
    baseline = simulate(scenario, strategy_name="heuristic", planner="none", budget=STEP, seed=5).ended
    assert ended.exploration_ms is not None
    assert baseline.exploration_ms is not None
    assert ended.exploration_ms < baseline.exploration_ms


def test_the_same_mission_is_the_same_bytes() -> None:
    first, second = (
        [encode_event(event) for event in flown(builtin_scenario("lobby"), seed=2)[1].events] for _ in "ab"
    )
    assert first == second


def test_teams_of_several_carrier_and_rover_types_work_together() -> None:
    scenario = builtin_scenario("lobby")
    carrier, rover = scenario.robot_types
    truck = replace(carrier, name="truck", radius_m=0.45, speed_mps=1.5, capacity=1)
    midget = replace(rover, name="midget", radius_m=0.05, dock_ms=4_000, undock_ms=3_000)
    members = (
        TeamMember(name="c1", type="carrier"),
        TeamMember(name="k1", type="truck"),
        TeamMember(name="r1", type="rover", carrier="c1"),
        TeamMember(name="q1", type="midget", carrier="c1"),
        TeamMember(name="q2", type="midget", carrier="k1"),
    )
    ended = flown(replace(scenario, robot_types=(carrier, truck, rover, midget), team=members))[0].ended
    assert (ended.status, ended.coverage, len(ended.aboard)) == (Status.COMPLETE, 1.0, 3)


def test_a_comparison_has_a_row_of_it_as_of_any_contender() -> None:
    scenario = builtin_scenario("lobby")
    result = carry_out(Trial(Case("lobby", 2, 2), Contender(CLAIRVOYANT), 1), scenario, STEP)
    row = result.row
    assert (row.complete, row.coverage, row.plans_refused) == (True, 1.0, 0)
    assert row.exploration_time_s is not None
    assert row.mission_time_s is not None
    assert 0 < row.exploration_time_s < row.mission_time_s
    assert result.curve is not None
    assert result.curve.known[-1] == 10_000


def test_it_is_named_among_strategies_and_asks_no_planner() -> None:
    assert contenders("temporal:greedy,clairvoyant", None, STEP)[1] == Contender(CLAIRVOYANT)
    with pytest.raises(UsageError, match="asks no planner"):
        contenders("clairvoyant:greedy", None, STEP)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """Draw a small map strewn with walls and rough ground, a team, and what is asked of it."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.integers(3, 12)), draw(st.integers(3, 12))
    cells = rng.choice(np.array([OBSTACLE, ROUGH, FLOOR], dtype=np.uint8), size=size, p=[0.2, 0.2, 0.6])
    cells[rng.integers(size[0]), rng.integers(size[1])] = FLOOR
    floor = np.argwhere(cells == FLOOR)
    chosen = rng.permutation(len(floor))[: min(draw(st.integers(1, 2)), len(floor))]
    starts = [(int(x), int(y)) for y, x in floor[chosen]]
    reach = {"carrier_range_m": draw(st.sampled_from([0.5, 3.0])), "rover_range_m": draw(st.sampled_from([0.5, 2.0]))}
    return Scenario(
        name="random",
        grid=Grid(cells=cells, resolution_m=1.0),
        robot_types=tuple(kinds_of(capacity=2, **reach).values()),
        team=team(*starts, rovers=draw(st.integers(0, 2))),
        goal=Goal(recover_rovers=draw(st.booleans())),
    )


@settings(max_examples=20, deadline=None)
@given(scenarios())
def test_any_small_map_is_explored_whole(scenario: Scenario) -> None:
    ended = flown(scenario)[0].ended
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0), ended.reason


def test_a_rover_can_go_back_to_where_it_was_set_down() -> None:
    """Another carrier's meeting point is nearer to where it ends, but that carrier is full."""
    rows = ["......", ".~..~#", ".~.#.#", ".~~..~"]
    codes = {"#": OBSTACLE, ".": FLOOR, "~": ROUGH}
    cells = np.array([[codes[c] for c in row] for row in rows], dtype=np.uint8)
    scenario = Scenario(
        name="full",
        grid=Grid(cells=cells, resolution_m=1.0),
        robot_types=tuple(kinds_of(capacity=2, carrier_range_m=0.5, rover_range_m=0.5).values()),
        team=team((0, 0), (4, 3), rovers=2),
    )
    assert flown(scenario)[0].ended.status is Status.COMPLETE

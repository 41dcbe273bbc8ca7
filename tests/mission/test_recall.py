from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mission_fakes import Timed
from support.missions.small_missions import greedy_strategy, run
from support.missions.small_teams import TWO_ANNEXES, carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.formats.loglines import trigger_text
from marsupial.mission.ending import unmet
from marsupial.mission.executor import Executor
from marsupial.mission.observer import Observer
from marsupial.mission.recall import Recall
from marsupial.model.grid import Cell
from marsupial.model.mission import Cause, Planned, Status, Trigger
from marsupial.model.plan import ActionName
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal, PlanningTime
from marsupial.model.world import News, RobotReport
from marsupial.model.zones import ZoneChange
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.heuristic import Heuristic

HOME = Goal(return_home=True)
LONG_ANNEX = ("#" * 62, "#" + "," * 60 + "#", "###,##" + "#" * 56, "#......" + "#" * 55, "#" * 62)
"""A hall (y = 1) and, through a door at x = 3, a long passage of rough ground (y = 3)."""


def team() -> list:  # type: ignore[type-arg]
    return [carrier_at(2, 1), rover_on("c1")]


@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
@pytest.mark.parametrize("limit_s", [40, 60, 75, 90, 120, 150])
def test_a_team_that_runs_out_of_time_has_its_rovers_aboard(strategy: type[Heuristic], limit_s: int) -> None:
    ended, watcher = run(drawn_grid(*LONG_ANNEX), team(), strategy(), time_ms=1000 * limit_s)
    assert (ended.status, ended.aboard) == (Status.TIME_LIMIT, ("r1",))
    assert ended.reason == f"called back before the time limit of {limit_s} s, all rovers are aboard"
    assert ended.t_ms <= 1000 * limit_s
    assert ended.retrievals == ended.deployments == 1
    assert watcher.faults == []


def test_a_team_is_called_back_no_sooner_than_it_must_be() -> None:
    ended, watcher = run(drawn_grid(*LONG_ANNEX), team(), greedy_strategy(), time_ms=150_000)
    (called,) = [p for p in watcher.of(Planned) if p.trigger == (Trigger(Cause.CALLED_BACK),)]  # type: ignore[attr-defined]
    assert trigger_text(called.trigger) == "called back"  # type: ignore[attr-defined]
    back_ms = ended.t_ms - called.t_ms
    assert 150_000 - ended.t_ms < 0.15 * back_ms + 6000


@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
def test_a_team_returns_once_enough_is_explored(strategy: type[Heuristic]) -> None:
    ended, _ = run(drawn_grid(*LONG_ANNEX), team(), strategy(), coverage=0.3)
    assert (ended.status, ended.aboard) == (Status.COMPLETE, ("r1",))
    said = f"{100 * ended.coverage:.1f} % of the reachable area are explored, 30 % are enough, all rovers are aboard"
    assert ended.reason == said
    assert 0.3 <= ended.coverage < 0.5
    assert [frontier.reason for frontier in ended.remaining] == [f"still open when the mission ended: {ended.reason}"]


@pytest.mark.parametrize("after", [0, 3, 12])
def test_an_operator_calls_the_team_back_with_its_rovers(after: int) -> None:
    turns = iter(range(10**6))
    ended, _ = run(drawn_grid(*LONG_ANNEX), team(), greedy_strategy(), called_back=lambda: next(turns) > after)
    assert (ended.status, ended.aboard) == (Status.CANCELLED, ("r1",))
    assert ended.reason == "called back by the operator, all rovers are aboard"
    assert ended.coverage < 1


@pytest.mark.parametrize("limit_s", [30, 45, 60, 90])
def test_a_team_that_has_to_be_home_is_home_in_time(limit_s: int) -> None:
    grid = drawn_grid("#" * 82, "#" + "." * 80 + "#", "#" * 82)
    ended, watcher = run(grid, [carrier_at(1, 1)], greedy_strategy(), goal=HOME, time_ms=1000 * limit_s)
    assert (ended.status, watcher.cell["c1"]) == (Status.TIME_LIMIT, Cell(1, 1))
    assert ended.reason == f"called back before the time limit of {limit_s} s, the team is home"
    assert ended.t_ms > 0.8 * 1000 * limit_s
    assert ended.remaining


@pytest.mark.parametrize("strategy", [greedy_strategy, Heuristic])
def test_carriers_explore_on_alone_once_the_rovers_are_aboard(strategy: type[Heuristic]) -> None:
    wall, hall, right, left = "#" * 62, "#" + "." * 60 + "#", "#" * 60 + ".#", "#." + "#" * 60
    annex = ("#" + "," * 60 + "#", "###," + "#" * 58)
    grid = drawn_grid(wall, hall, left, hall, right, hall, left, hall, right, hall, *reversed(annex), wall)
    ended, watcher = run(grid, [carrier_at(2, 3), rover_on("c1")], strategy(), time_ms=70_000)
    assert (ended.status, ended.reason) == (Status.TIME_LIMIT, "time limit of 70 s reached")
    assert (ended.t_ms, ended.aboard, ended.exploration_ms) == (70_000, ("r1",), None)
    (called,) = [p for p in watcher.of(Planned) if p.trigger == (Trigger(Cause.CALLED_BACK),)]  # type: ignore[attr-defined]
    later = [action for p in watcher.of(Planned) if p.t_ms > called.t_ms for action in p.actions]  # type: ignore[attr-defined]
    assert {action.name for action in later} == {ActionName.EXPLORE}
    assert watcher.faults == []


@pytest.mark.parametrize(("cell", "again_ms"), [(Cell(0, 0), 5000), (Cell(1, 1), None)])
def test_a_door_that_closes_makes_the_way_back_worth_an_estimate(cell: Cell, again_ms: int | None) -> None:
    kinds = kinds_of()
    world = SimulatedWorld(drawn_grid("#" * 22, "#" + "." * 20 + "#", "#" * 22), kinds, [carrier_at(2, 1)])
    recall, work = Recall(world, kinds, HOME, 300_000), Executor(world, world.robots, lambda *_: None, Observer())
    world.advance(0)
    quiet_ms = recall.wake_ms(10**6)
    change = News(t_ms=5000, changed=(("c1", np.array([22 * cell.y + cell.x])),))
    recall.update(change)
    assert recall.wake_ms(10**6) == (again_ms or quiet_ms)
    world.advance(5000)
    assert not recall.due({"c1": Cell(2, 1)}, work, 0)
    recall.update(replace(change, t_ms=6000))  # not again at once
    assert recall.wake_ms(10**6) == (quiet_ms if again_ms is None else 35_000)


def recall_at(limit_s: int, *, goal: Goal = HOME) -> tuple[Recall, Executor]:
    """Return the recall of a carrier that stands 18 s from home, one second after it has got there."""
    kinds = kinds_of()
    world = SimulatedWorld(drawn_grid("#" * 22, "#" + "." * 20 + "#", "#" * 22), kinds, [carrier_at(1, 1)])
    recall, work = (
        Recall(world, kinds, goal, 1000 * limit_s),
        Executor(world, world.robots, lambda *_: None, Observer()),
    )
    world.advance(0)
    world.drive("c1", [Cell(x, 1) for x in range(1, 20)])
    while world.advance(19_000).t_ms < 19_000:
        pass
    return recall, work


def test_the_time_that_planning_takes_is_reserved_for_the_way_back() -> None:
    for planning_ms, is_due in ((0, False), (1000, False), (1500, True)):
        recall, work = recall_at(43)  # 18 s of driving, a tenth more, and 3 s leave 1.2 s
        assert recall.due({"c1": Cell(1, 1)}, work, planning_ms) is is_due


@pytest.mark.parametrize(
    "news",
    [
        {"slowed": (("c1", 0.5),)},
        {"lost": (("c1", "failed"),)},
        {"returned": ("c1",)},
        {"zones": (ZoneChange(name="z", zone=None),)},
        {"out_of_contact": ("r1",)},
    ],
)
def test_news_that_may_make_the_way_back_longer_is_worth_an_estimate(news: dict[str, Any]) -> None:
    recall, _ = recall_at(300)
    assert recall.wake_ms(10**6) > 100_000
    recall.update(News(t_ms=19_000))
    assert recall.wake_ms(10**6) > 100_000
    recall.update(News(t_ms=19_000, **news))
    assert recall.wake_ms(0) == 19_000


def test_planning_that_takes_time_does_not_make_a_team_late() -> None:
    slow = Timed(greedy_strategy(), wall_s=2.0)
    limit_ms = 120_000
    ended, _ = run(
        drawn_grid(*LONG_ANNEX), team(), slow, time_ms=limit_ms, planning_time=PlanningTime.CHARGED, goal=HOME
    )
    assert (ended.status, ended.aboard) == (Status.TIME_LIMIT, ("r1",))
    assert ended.reason.endswith("the team is home")


def test_a_limit_that_is_not_reached_changes_nothing() -> None:
    free, as_it_was = run(drawn_grid(*TWO_ANNEXES), team(), greedy_strategy())
    for more_ms in (40_000, 60_000, 400_000):
        ended, watcher = run(drawn_grid(*TWO_ANNEXES), team(), greedy_strategy(), time_ms=free.t_ms + more_ms)
        assert ended == free
        assert watcher.events == as_it_was.events


def test_a_team_without_rovers_to_recover_explores_until_the_end() -> None:
    grid = drawn_grid("#" * 82, "#" + "." * 80 + "#", "#" * 82)
    ended, _ = run(grid, [carrier_at(1, 1), rover_on("c1")], greedy_strategy(), time_ms=30_000)
    assert (ended.t_ms, ended.reason) == (30_000, "time limit of 30 s reached")
    ended, _ = run(drawn_grid(*LONG_ANNEX), team(), greedy_strategy(), goal=Goal(recover_rovers=False), time_ms=60_000)
    assert (ended.t_ms, ended.reason) == (60_000, "time limit of 60 s reached")


def test_no_rover_is_set_down_when_there_is_no_time_to_pick_it_up() -> None:
    ended, _ = run(drawn_grid(*LONG_ANNEX), team(), greedy_strategy(), time_ms=14_000)
    assert (ended.status, ended.deployments, ended.aboard) == (Status.TIME_LIMIT, 0, ("r1",))


def test_robots_that_are_not_back_in_time_are_named() -> None:
    hall = ("#" * 42, "#" + "." * 40 + "#", "#" * 42)
    robots = [carrier_at(1, 1), rover_at(3, 1)]
    ended, _ = run(drawn_grid(*hall), robots, greedy_strategy(), time_ms=9000)
    assert (ended.status, ended.reason) == (Status.TIME_LIMIT, "time limit of 9 s reached: r1 is not aboard")


def test_a_carrier_that_is_still_on_its_way_home_is_not_home() -> None:
    home, report = Cell(1, 1), RobotReport(name="c1", type="carrier", cell=Cell(1, 1), carrier=None, free_at_ms=9)
    assert unmet(HOME, [report], kinds_of(), {"c1": home}, {"c1"}) == ["c1 is not home"]
    assert unmet(HOME, [report], kinds_of(), {"c1": home}) == []


@pytest.mark.parametrize("limit_s", [30, 50, 150, 300])
def test_robots_that_take_long_from_cell_to_cell_turn_back_in_time_too(limit_s: int) -> None:
    kinds = kinds_of()
    kinds["carrier"] = replace(kinds["carrier"], speed_mps=0.05)  # 20 s from cell to cell
    grid = drawn_grid("#" * 22, "#" + "." * 20 + "#", "#" * 22)
    ended, watcher = run(grid, [carrier_at(1, 1)], greedy_strategy(), kinds=kinds, goal=HOME, time_ms=1000 * limit_s)
    assert (ended.status, watcher.cell["c1"]) == (Status.TIME_LIMIT, Cell(1, 1))
    assert ended.reason.endswith("the team is home")


def test_rovers_that_can_not_be_fetched_are_named_with_the_reason_and_the_others_fetched() -> None:
    hall = ("#" * 72, "#,#" + "." * 68 + "#", "#" * 72)
    robots = [carrier_at(20, 1), rover_at(21, 1, 1), rover_at(1, 1, 2)]
    kinds: dict[str, RobotType] = kinds_of(capacity=2)
    ended, _ = run(drawn_grid(*hall), robots, greedy_strategy(), kinds=kinds, time_ms=45_000)
    assert (ended.status, ended.aboard) == (Status.TIME_LIMIT, ("r1",))
    assert ended.reason.startswith("called back before the time limit of 45 s, but r2 is not aboard: ")
    assert ended.t_ms < 45_000

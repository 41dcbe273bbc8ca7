"""Missions in which the time that planning takes passes."""

from itertools import pairwise

import pytest
from mission_fakes import Timed
from support.missions.small_missions import Watcher, greedy_strategy, run
from support.missions.small_teams import ANNEX, CORRIDOR, LONG_HALL, TWO_ANNEXES, carrier_at, drawn_grid, rover_on

from marsupial.formats.loglines import trigger_text
from marsupial.model.mission import ActionStarted, DriveEnded, DriveStarted, MissionEnded, Planned, Status
from marsupial.model.scenario import PlanningTime
from marsupial.model.strategy import Briefing, Decision

WALL_MS = 2000


def charged(*lines: str) -> tuple[MissionEnded, Watcher, Timed]:
    team = [carrier_at(1, len(lines) - 2) if lines == ANNEX else carrier_at(5, 1), rover_on("c1")]
    slow = Timed(greedy_strategy(), wall_s=WALL_MS / 1000)
    ended, watcher = run(drawn_grid(*lines), team, slow, planning_time=PlanningTime.CHARGED)
    return ended, watcher, slow


def test_the_clock_advances_by_the_time_planning_took() -> None:
    _, watcher, slow = charged(*ANNEX)
    times = [plan.t_ms for plan in watcher.of(Planned)]
    assert times[0] == WALL_MS
    assert all(b - a >= WALL_MS for a, b in pairwise(times))
    assert len(times) == len(slow.briefings)


def test_meanwhile_robots_follow_the_old_plan_but_begin_no_docking() -> None:
    _, watcher, _ = charged(*TWO_ANNEXES)
    windows = [(plan.t_ms - WALL_MS, plan.t_ms) for plan in watcher.of(Planned)]
    drives = [(e.t_ms, e.robot) for e in watcher.of(DriveStarted)]
    stops = [(e.t_ms, e.robot) for e in watcher.of(DriveEnded)]
    spans = [(t, min(s for s, other in stops if other == robot and s >= t)) for t, robot in drives]
    assert any(t < begun < s or begun <= t < ready for begun, ready in windows[1:] for t, s in spans)
    docks = [e.t_ms for e in watcher.of(ActionStarted) if e.action.carrier is not None]
    assert docks
    assert not any(begun < t < ready for begun, ready in windows for t in docks)


@pytest.mark.parametrize("lines", [ANNEX, TWO_ANNEXES])
def test_the_mission_is_still_carried_out(lines: tuple[str, ...]) -> None:
    ended, watcher, _ = charged(*lines)
    assert (ended.status, ended.coverage, ended.aboard) == (Status.COMPLETE, 1.0, ("r1",))
    assert watcher.faults == []


def test_an_outdated_plan_is_replaced() -> None:
    # the loss of c1 triggers a second plan, during which c2 sees the last cells
    strategy = Timed(greedy_strategy(), 0.0)

    class Slower:
        name = "slower"

        def decide(self, briefing: Briefing) -> Decision:
            decision = strategy.decide(briefing)
            strategy.wall_s = 100.0
            return decision

    team = [carrier_at(1, 1, 1), carrier_at(2, 1, 2)]
    charged = PlanningTime.CHARGED
    ended, watcher = run(drawn_grid(*CORRIDOR), team, Slower(), failures={"c1": 500}, planning_time=charged)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    (_, second) = watcher.of(Planned)
    assert (second.t_ms, trigger_text(second.trigger), second.actions) == (100_500, "lost: c1", ())
    assert ended.t_ms == 100_500


def test_charged_planning_does_not_overrun_the_time_limit_and_what_completes_at_it_is_complete() -> None:
    slow = Timed(greedy_strategy(), wall_s=60.0)
    ended, _ = run(drawn_grid(*LONG_HALL), [carrier_at(1, 1)], slow, time_ms=2500, planning_time=PlanningTime.CHARGED)
    assert (ended.status, ended.t_ms) == (Status.TIME_LIMIT, 2500)
    ended, _ = run(drawn_grid(*CORRIDOR), [carrier_at(1, 1)], greedy_strategy(), time_ms=4000)
    assert (ended.status, ended.t_ms) == (Status.COMPLETE, 4000)


def test_a_robot_lost_while_a_plan_is_made_asks_for_the_next_one() -> None:
    team = [carrier_at(19, 1, 1), carrier_at(20, 1, 2)]
    slow = Timed(greedy_strategy(), wall_s=2.0)
    ended, watcher = run(drawn_grid(*LONG_HALL), team, slow, failures={"c1": 1000}, planning_time=PlanningTime.CHARGED)
    assert (ended.status, ended.coverage) == (Status.COMPLETE, 1.0)
    assert [trigger_text(plan.trigger) for plan in watcher.of(Planned)][:2] == ["start", "lost: c1"]
    assert watcher.faults == []

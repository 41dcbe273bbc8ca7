from collections.abc import Callable

import pytest
from failing_world import FailingWorld
from mission_fakes import Timed
from support.missions.small_missions import Watcher, greedy_strategy
from support.missions.small_teams import ANNEX, TWO_ANNEXES, begun_on, carrier_at, drawn_grid, kinds_of, rover_on

from marsupial.cli.display.progress import MissionWatch
from marsupial.formats.loglines import trigger_text
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.observer import Observers
from marsupial.mission.playback import Playback
from marsupial.model.mission import ActionEnd, ActionEnded, MissionEnded, PlacedRobot, Planned, Status
from marsupial.model.plan import ActionName
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.strategy import Strategy

TEAM = (carrier_at(1, 3), rover_on("c1"))


def explore(
    fails: Callable[[int, str], bool],
    lines: tuple[str, ...] = ANNEX,
    team: tuple[PlacedRobot, ...] = TEAM,
    strategy: Strategy | None = None,
    planning_time: PlanningTime = PlanningTime.INSTANT,
) -> tuple[MissionEnded, Watcher, MissionWatch]:
    grid, kinds = drawn_grid(*lines), kinds_of()
    watcher, watch = Watcher(grid, kinds, team), MissionWatch()
    both = Observers([watcher, watch])
    both.event(begun_on(grid, tuple(kinds.values()), team))
    order = MissionOrder(goal=Goal(), limits=MissionLimits(time_ms=600_000), planning_time=planning_time)
    world = FailingWorld(grid, kinds, team, fails)
    ended = MissionLoop(world, kinds, strategy or greedy_strategy(), order, both).run()
    return ended, watcher, watch


def failures_of(watcher: Watcher) -> list[ActionName]:
    ends = (event for event in watcher.events if isinstance(event, ActionEnded))
    return [event.action.name for event in ends if event.end is ActionEnd.FAILED]


@pytest.mark.parametrize("name", ["drive", "undock", "dock"])
def test_failed_actions_are_replanned_and_done(name: str) -> None:
    failed: list[str] = []

    def once(_number: int, command: str) -> bool:
        if command != name or failed:
            return False
        failed.append(command)
        return True

    ended, watcher, _ = explore(once)
    assert (ended.status, ended.deployments, ended.retrievals, ended.aboard) == (Status.COMPLETE, 1, 1, ("r1",))
    assert watcher.faults == []
    assert len(failures_of(watcher)) == 1
    triggers = [trigger_text(event.trigger) for event in watcher.events if isinstance(event, Planned)]
    assert sum(trigger.startswith("failed: ") and "c1" in trigger for trigger in triggers) == 1


@pytest.mark.parametrize("period", [4, 5])
@pytest.mark.parametrize("planning_time", PlanningTime)
def test_a_mission_completes_although_many_commands_fail(period: int, planning_time: PlanningTime) -> None:
    team = (carrier_at(5, 1), rover_on("c1"))
    slow = Timed(greedy_strategy(), wall_s=0.7)
    ended, watcher, watch = explore(lambda n, _: n % period == 0, TWO_ANNEXES, team, slow, planning_time)
    assert (ended.status, ended.aboard) == (Status.COMPLETE, ("r1",))
    assert watcher.faults == []
    assert failures_of(watcher)
    assert_seen_alike(watcher, watch)


def test_a_rover_that_was_not_set_down_is_aboard_for_all_who_watch() -> None:
    _, watcher, _ = explore(lambda _, name: name == "undock")
    ends = (i for i, event in enumerate(watcher.events) if isinstance(event, ActionEnded))
    first = next(i for i in ends if watcher.events[i].end is ActionEnd.FAILED)  # type: ignore[union-attr]
    events = watcher.events[: first + 1]
    watch = MissionWatch()
    for event in events:
        watch.event(event)
    last = Playback(events).robots_at(events[-1].t_ms)
    assert {view.name: view.carrier for view in last} == {"c1": None, "r1": "c1"}
    assert {view.name: view.carrier for view in watch.views()} == {"c1": None, "r1": "c1"}


def assert_seen_alike(watcher: Watcher, watch: MissionWatch) -> None:
    last = Playback(watcher.events).robots_at(watcher.events[-1].t_ms)
    assert {robot.name: robot.carrier for robot in last} == watcher.carrier
    assert {view.name: view.carrier for view in watch.views()} == watcher.carrier

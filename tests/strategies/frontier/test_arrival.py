from support.missions.small_missions import Recorder

from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model import Budget, Cause, Planned, Scenario, Status


def plans_of(scenario: Scenario, planner: str = "anytime") -> list[Planned]:
    watcher = Recorder()
    ended = simulate(scenario, strategy="temporal", planner=planner, budget=Budget(steps=2), seed=1, observer=watcher)
    assert (ended.status, ended.coverage, ended.plans_invalid) == (Status.COMPLETE, 1.0, 0), ended.reason
    return watcher.of(Planned)


def causes(plans: list[Planned]) -> set[Cause]:
    return {trigger.cause for plan in plans for trigger in plan.trigger}


def test_temporal_without_rovers_replans_when_a_robot_has_seen_behind_its_frontier() -> None:
    told = causes(plans_of(builtin_scenario("rooms", 3, 0)))
    assert Cause.GONE in told
    assert told <= {Cause.START, Cause.ROBOT_FREE, Cause.GONE, Cause.CARRIED_OUT, Cause.EXPLORED}


def test_planners_that_go_by_makespan_alone_do_so_too_and_teams_with_rovers_do_not() -> None:
    assert Cause.GONE in causes(plans_of(builtin_scenario("lobby", 3, 0), "greedy"))
    assert Cause.NEW in causes(plans_of(builtin_scenario("lobby", 1, 1)))

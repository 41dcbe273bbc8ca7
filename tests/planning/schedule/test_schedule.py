from dataclasses import replace

from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.situations import in_flight, one_room, out_of_reach

from marsupial.model import Action, ActionName, Budget, Improved, Situation
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy
from marsupial.planning.schedule.timeline import duration_ms, retime


def act(name: ActionName, robot: str, place: str, *, carrier: str | None = None, origin: str | None = None) -> Action:
    return Action(name=name, start_ms=999, duration_ms=5, robot=robot, place=place, carrier=carrier, origin=origin)


ONE_ROOM = (
    act(ActionName.MOVE, "c1", "m1", origin="c1_start"),
    act(ActionName.UNDOCK, "r1", "m1", carrier="c1"),
    act(ActionName.EXPLORE, "r1", "t1", origin="m1"),
)


def test_each_action_starts_as_soon_as_its_robots_allow() -> None:
    plan = retime(one_room(), ONE_ROOM)
    assert [(a.start_ms, a.duration_ms) for a in plan.actions] == [(0, 10_000), (10_001, 5_000), (15_002, 4_000)]
    assert check(one_room(), plan).valid


def test_running_actions_end_first() -> None:
    explore = act(ActionName.EXPLORE, "r2", "t2", origin="r2_start")
    (action,) = retime(in_flight(), [explore]).actions
    assert (action.start_ms, action.duration_ms) == (3_000, 4_000)


def test_an_action_without_a_path_is_left_for_the_checker_to_refuse() -> None:
    impossible = act(ActionName.EXPLORE, "c1", "t2", origin="c1_start")
    assert duration_ms(out_of_reach(), ActionName.EXPLORE, "c1", "t2", "c1_start") is None
    assert not check(out_of_reach(), retime(out_of_reach(), [impossible])).valid


@given(situations())
def test_a_valid_plan_stays_valid_and_gets_no_longer(situation: Situation) -> None:
    for event in Greedy().solve(situation, Budget(steps=2)):
        if isinstance(event, Improved):
            late = [replace(action, start_ms=2 * action.start_ms + 7) for action in event.plan.actions]
            plan = retime(situation, late)
            assert check(situation, plan).valid
            assert plan.makespan_ms <= event.plan.makespan_ms


def test_a_rover_aboard_is_free_when_its_carrier_is() -> None:
    situation = one_room()
    late = tuple(replace(r, free_at_ms=10**6) if r.carrier is not None else r for r in situation.robots)
    assert retime(replace(situation, robots=late), ONE_ROOM) == retime(situation, ONE_ROOM)

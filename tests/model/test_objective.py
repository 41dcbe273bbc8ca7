from dataclasses import replace

from support.planning.situations import SOLVABLE, one_hall, one_room

from marsupial.model import MAKESPAN, Budget, Plan, Situation
from marsupial.planning.greedy import Greedy


def planned(situation: Situation) -> Plan:
    event = next(iter(Greedy().solve(situation, Budget(steps=1))))
    return event.plan


def test_nothing_to_do_scores_nothing() -> None:
    assert MAKESPAN.value(SOLVABLE["one_hall"](), Plan(actions=())) == (0, 0, 0)


def test_targets_count_by_when_they_are_reached_and_what_they_may_reveal() -> None:
    situation = one_hall()
    assert [MAKESPAN.weight(target) for target in situation.targets] == [2000, 2000]
    assert MAKESPAN.value(situation, planned(situation)) == (30_002, 2000 * (10_001 + 30_002), 30_002)


def test_targets_that_reveal_more_are_worth_more() -> None:
    target = one_hall().targets[0]
    assert MAKESPAN.weight(replace(target, reveal_m2=2.5)) == 3500


def test_riding_is_no_driving_of_the_rover_and_docking_none_at_all() -> None:
    assert MAKESPAN.value(one_room(), planned(one_room()))[2] == 10_001 + 4_001

"""Batteries in plans: what the checker refuses, and plans of every engine that keep them charged."""

from dataclasses import replace

import pytest
from hypothesis import given
from support.planning.charged_teams import (
    ROVER,
    charged,
    charged_situations,
    scattered,
    waits_for_a_carrier,
    within_range,
)
from support.planning.situations import one_hall, one_room, rover_left_behind, two_rooms
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.errors import SituationError
from marsupial.model import (
    Action,
    ActionName,
    Budget,
    Finished,
    Improved,
    Outcome,
    Plan,
    PlanningBattery,
    Situation,
    SituationGoal,
)
from marsupial.planning.batteries.repair import with_batteries
from marsupial.planning.checker import ViolationKind, check
from marsupial.planning.engines import engine
from marsupial.planning.greedy import Greedy
from marsupial.planning.schedule.charges import Charges, charged_first
from marsupial.planning.schedule.timeline import Timeline

ENGINES = ("greedy", "anytime", "exact", "auto")
BACK = SituationGoal(recover_rovers=True)


def solved(name: str, situation: Situation) -> tuple[Plan | None, Finished]:
    """Return the best plan of an engine, which must be valid, and how it ended."""
    budget = Budget(seconds=2.0) if name in ("exact", "auto") else Budget(steps=8)
    events = list(engine(name).solve(situation, budget))
    plans = [event.plan for event in events if isinstance(event, Improved)]
    for plan in plans:
        assert check(situation, plan).valid, check(situation, plan).violation
    end = events[-1]
    assert isinstance(end, Finished)
    return (plans[-1] if plans else None), end


def unlimited(situation: Situation) -> Plan:
    """Return the greedy plan as if batteries had no limit."""
    plan, _ = solved("greedy", situation.without_batteries())
    assert plan is not None
    return plan


# charges by hand: `one_room` has 10 s to the door, 5 s of undocking, 4 s to the target and back, 10 s of docking


@pytest.mark.parametrize(("capacity_j", "fits"), [(156.0, True), (155.9, False)])
def test_a_sortie_takes_what_driving_docking_and_waiting_take(capacity_j: float, fits: bool) -> None:
    """5 s and 10 s at 4 W, twice 4 s at 12 W: 156 J; 1 ms between actions takes 4 mJ each."""
    situation = charged(one_room(goal=BACK), {"rover": replace(ROVER, capacity_j=capacity_j + 0.012)})
    verdict = check(situation, unlimited(situation))
    assert verdict.valid == fits
    assert fits or verdict.violation.kind is ViolationKind.BATTERY_EMPTY  # type: ignore[union-attr]


def test_a_rover_aboard_charges_from_the_battery_of_its_carrier() -> None:
    lorry = PlanningBattery(capacity_j=10_000.0, stand_w=20.0, drive_w=80.0)
    situation = charged(one_room(goal=BACK), {"rover": ROVER, "carrier": lorry}, r1=100.0)
    charges = Charges.of(situation)
    for action in unlimited(situation).actions[:1]:  # 10 s to the door
        charges.add(action)
    assert charges.level_j == pytest.approx({"r1": 100 + 500, "c1": 10_000 - 800 - 500})
    first = charged_first(situation, unlimited(situation))
    assert [wait.share for waits in first.values() for wait in waits] == pytest.approx([0.60005])


@pytest.mark.parametrize(("capacity_j", "fits"), [(1300.0, True), (1299.0, False)])
def test_a_carrier_pays_for_what_its_rovers_take_during_a_drive(capacity_j: float, fits: bool) -> None:
    """10 s of driving at 80 W, and 10 s of charging at 50 W."""
    lorry = PlanningBattery(capacity_j=capacity_j, drive_w=80.0)
    situation = charged(one_room(), {"rover": ROVER, "carrier": lorry}, r1=100.0)
    drive = unlimited(situation).actions[:1]
    verdict = check(replace(situation, goal=SituationGoal()), Plan(actions=drive), targets=frozenset())
    assert verdict.valid == fits
    assert fits or verdict.violation.kind is ViolationKind.BATTERY_EMPTY  # type: ignore[union-attr]


def test_a_full_battery_takes_no_more_charge() -> None:
    lorry = PlanningBattery(capacity_j=10_000.0, drive_w=80.0)
    situation = charged(one_room(goal=BACK), {"rover": ROVER, "carrier": lorry}, r1=900.0)
    charges = Charges.of(situation)
    charges.add(unlimited(situation).actions[0])
    assert charges.level_j == pytest.approx({"r1": 1000, "c1": 10_000 - 800 - 100})


def test_a_carrier_charges_where_it_stands_on_a_charging_place() -> None:
    truck = PlanningBattery(capacity_j=2000.0, stand_w=20.0, drive_w=80.0, charge_w=100.0)
    far = situation_of([carrier()], {"t1": hall(10), "t2": hall(-10)}, {}, {"c1_start": hall(0)})
    situation = charged(far, {"carrier": truck}, "c1_start", c1=900.0)
    plan, _ = solved("greedy", situation)
    assert plan is not None
    assert plan.explored == {"t1", "t2"}
    # 10 s there, 20 s across and 10 s back take 3200 J: it returns in between
    assert any(action.place == "charge_c1_start" for action in plan.actions)


def test_who_could_not_be_saved_before_the_plan_is_not_its_fault() -> None:
    situation = charged(rover_left_behind(), {"rover": ROVER}, r1=1.0)
    assert check(situation, Plan(actions=()), targets=frozenset()).valid


@pytest.mark.parametrize(("capacity_j", "fits"), [(156.1, True), (155.9, False), (115.0, False)])
def test_a_plan_that_leaves_a_rover_behind_too_long_strands_it(capacity_j: float, fits: bool) -> None:
    """It stays at the target: 4 s to the door, where the carrier waits, and 10 s to dock are left."""
    situation = charged(one_room(), {"rover": replace(ROVER, capacity_j=capacity_j)})
    plan = unlimited(situation)
    assert check(replace(situation, goal=BACK).without_batteries(), plan, targets=plan.explored).violation is not None
    verdict = check(situation, plan)
    assert verdict.valid == fits
    assert fits or verdict.violation.kind is ViolationKind.STRANDED  # type: ignore[union-attr]


def test_the_rover_with_the_least_charge_is_fetched_first_though_another_one_is_nearer() -> None:
    """r2 at 20 s has charge for 30 s, not for the 44 s that it would wait for r1."""
    starts = {"c1_start": hall(0), "r1_start": door(2), "r2_start": door(-20)}
    bare = situation_of(
        [carrier(), rover(), rover(2)], {}, {"m1": door(2), "m2": door(-20)}, starts, types=default_types(2), goal=BACK
    )
    situation = charged(bare, {"rover": replace(ROVER, capacity_j=400.0)}, r2=170.0)
    rescue, _ = with_batteries(situation, Plan(actions=()))
    docks = [(action.robot, action.place) for action in rescue.actions if action.name is ActionName.DOCK]
    assert docks == [("r2", "m2"), ("r1", "m1")]


@pytest.mark.parametrize("name", ENGINES)
def test_rovers_recharge_between_two_sorties(name: str) -> None:
    """Both rooms take 2 s more each way than the rover can pay for twice; it charges on the way."""
    situation = charged(replace(two_rooms(), goal=BACK), {"rover": replace(ROVER, capacity_j=170.0, charge_w=2.0)})
    plan, _ = solved(name, situation)
    free, _ = solved(name, situation.without_batteries())
    assert plan is not None
    assert free is not None
    assert plan.explored == {"t1", "t2"}
    assert plan.makespan_ms > free.makespan_ms


@pytest.mark.parametrize("name", ENGINES)
def test_batteries_that_never_bind_change_nothing(name: str) -> None:
    situation = charged(replace(two_rooms(), goal=BACK), {"rover": replace(ROVER, capacity_j=1e6)})
    assert solved(name, situation)[0] == solved(name, situation.without_batteries())[0]


@pytest.mark.parametrize("name", ENGINES)
def test_a_target_out_of_range_has_no_plan(name: str) -> None:
    situation = charged(one_room(goal=BACK), {"rover": replace(ROVER, capacity_j=120.0)})
    plan, end = solved(name, situation)
    assert plan is None
    assert (end.outcome, end.detail) == (Outcome.NO_PLAN, "found no plan that batteries suffice for")


def test_an_optimum_without_limits_is_none_with_them() -> None:
    situation = charged(replace(two_rooms(), goal=BACK), {"rover": replace(ROVER, capacity_j=170.0, charge_w=2.0)})
    plan, end = solved("exact", situation)
    assert plan is not None
    assert end.outcome is Outcome.SATISFICING
    assert end.lower_bound_ms is not None
    assert end.lower_bound_ms < plan.makespan_ms


@pytest.mark.parametrize("carriers", [1, 2])
@pytest.mark.parametrize("capacity_j", [1500.0, 1000.0, 800.0])
def test_every_situation_within_range_gets_a_plan(carriers: int, capacity_j: float) -> None:
    drawn = [scattered(seed, capacity_j, carriers) for seed in range(20)]
    assert [solved("greedy", one)[0] is not None for one in drawn] == [within_range(one) for one in drawn]


@given(charged_situations())
def test_two_sets_of_rules_agree_on_the_charges_of_a_plan(situation: Situation) -> None:
    """The checker has rules of its own; here those by which plans are made see the same plan."""
    plans = [e.plan for e in Greedy().solve(situation.without_batteries(), Budget(steps=2)) if isinstance(e, Improved)]
    for plan in plans:
        charges = Charges.of(situation)
        for action in plan.actions:
            charges.add(action)
        violation = check(situation, plan).violation
        empty = violation is not None and violation.kind is ViolationKind.BATTERY_EMPTY
        assert empty == (min(charges.least_j.values(), default=0.0) < -1e-6)


@given(charged_situations())
def test_what_missions_follow_runs_no_battery_down_and_strands_nobody(situation: Situation) -> None:
    events = list(Greedy().solve(situation.without_batteries(), Budget(steps=2)))
    plans = [event.plan for event in events if isinstance(event, Improved)]
    for plan in [Plan(actions=()), *plans]:
        kept, _ = with_batteries(situation, plan)
        physical = replace(situation, goal=SituationGoal())
        assert check(physical, kept, targets=kept.explored).valid


def test_a_carrier_that_has_to_charge_before_it_fetches_a_rover_does_so() -> None:
    situation = waits_for_a_carrier()
    timeline = Timeline.of(situation.without_batteries())
    timeline.explore("c1", "ta")
    timeline.move("c2", "m1")
    timeline.explore("c3", "tb")
    timeline.undock("r2", "m1")
    timeline.explore("r2", "tr")
    timeline.explore("c3", "tc")
    timeline.move("r2", "m2")
    kept, _ = with_batteries(situation, timeline.plan)
    assert kept.explored == {"ta", "tb", "tr"}


def test_the_others_explore_while_a_carrier_and_its_rover_can_not_be_saved() -> None:
    team = [carrier(), rover(on="c1"), carrier(2), rover(2)]
    starts = {"c1_start": hall(0), "c2_start": hall(60), "r2_start": room(61)}
    targets, meetings = {"t1": hall(10), "t2": room(12), "t3": hall(68)}, {"m1": door(9), "m2": door(60)}
    large = PlanningBattery(capacity_j=16_000.0, stand_w=20.0, drive_w=80.0, charge_w=400.0)
    batteries = {"carrier": large, "rover": ROVER}
    situation = charged(situation_of(team, targets, meetings, starts), batteries, "c1_start", c2=300.0)
    rescue, _ = with_batteries(situation, unlimited(situation))
    assert list(map(str, rescue.actions)) == ["(move r2 r2_start m2)"]  # as far as it can be saved
    starts["r2_start"] = door(60)  # it is there
    situation = charged(situation_of(team, targets, meetings, starts), batteries, "c1_start", c2=300.0)
    kept, _ = with_batteries(situation, unlimited(situation))
    assert kept.explored == {"t1", "t2"}


def one_seat_for_two(capacity_j: float, carrier_slowness: int = 1) -> Situation:
    """Return: a carrier with one seat, taken by r1, near a target; r2 stands on a charging place 42 s away."""
    team, starts = [carrier(), rover(on="c1"), rover(2)], {"c1_start": hall(18), "r2_start": room(0)}
    slow = {"carrier": carrier_slowness}
    situation = situation_of(team, {"t1": room(21)}, {"m1": door(20)}, starts, slowness=slow)
    return charged(situation, {"rover": replace(ROVER, capacity_j=capacity_j)}, "r2_start")


def explorers(situation: Situation) -> set[str]:
    """Return who explores the target after batteries have had a say in the plan that r2 does."""
    way = {"robot": "r2", "place": "t1", "origin": "r2_start"}
    sortie = Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=42_000, **way)
    plan, _ = with_batteries(situation, Plan(actions=(sortie,)))
    return {action.robot for action in plan.actions if action.name is ActionName.EXPLORE}


@pytest.mark.parametrize(("capacity_j", "robot"), [(1100.0, "r1"), (1130.0, "r2")])
def test_a_rover_without_a_seat_gets_no_farther_than_its_charging_place_allows(capacity_j: float, robot: str) -> None:
    """There and back, twice 42 s at 12 W, take 1008 J, and a tenth is kept; to dock, if it could, would take less."""
    assert explorers(one_seat_for_two(capacity_j)) == {robot}


def test_a_rover_that_can_return_to_a_charging_place_is_not_stranded() -> None:
    """It has 626 J left, too little to wait for a carrier that takes 200 s to come by, and enough to drive back."""
    assert explorers(one_seat_for_two(1130.0, carrier_slowness=100)) == {"r2"}


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("capacity_j", 0.0, "types[1].battery.capacity_j: must be positive, got 0.0"),
        ("drive_w", -1.0, "types[1].battery.drive_w: must be 0 or more, got -1.0"),
    ],
)
def test_a_wrong_battery_is_refused(field: str, value: float, message: str) -> None:
    with pytest.raises(SituationError, match=r"battery") as error:
        charged(one_room(), {"rover": replace(ROVER, **{field: value})})
    assert str(error.value.problems[0]) == message


def test_a_charge_above_the_capacity_or_without_a_battery_is_refused() -> None:
    with pytest.raises(SituationError, match=r"robots\[1\].charge_j: must be at most 1000.0, got 1001"):
        charged(one_room(), {"rover": ROVER}, r1=1001.0)
    with pytest.raises(SituationError, match=r"robots\[0\].charge_j: type carrier has no battery"):
        charged(one_hall(), {}, c1=1.0)


def test_a_relay_of_sorties_needs_the_door_nearest_to_the_target() -> None:
    """The near door saves the rover's energy, the far one the carrier's time: energy comes first."""
    doors = {"m1": door(5), "m2": door(28)}
    near = situation_of([carrier(), rover(on="c1")], {"t1": room(30)}, doors, {"c1_start": hall(0)}, goal=BACK)
    situation = charged(near, {"rover": replace(ROVER, capacity_j=160.0)})
    plan, _ = solved("greedy", situation)
    assert plan is not None
    assert {action.place for action in plan.actions if action.carrier} == {"m2"}

from support.planning.spots import DOCK_MS, UNDOCK_MS, Spot, carrier, door, hall, room, rover, situation_of

from marsupial.model import MAKESPAN, Budget, Improved, Plan, PlanningType, RobotState, Role, Situation
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy
from marsupial.planning.local_search.columns import UNDOCK
from marsupial.planning.local_search.encoding import encode, events_of, plan_of
from marsupial.planning.local_search.search import Annealing


def first_plan(situation: Situation) -> Plan:
    return next(event.plan for event in Greedy().solve(situation, Budget(steps=1)) if isinstance(event, Improved))


def two_kinds() -> Situation:
    """Return: a carrier with a climber and two rovers aboard, a cliff at 10 s and rooms at 20 and 30 s."""
    kinds = (
        PlanningType(name="carrier", role=Role.CARRIER, capacity=3),
        PlanningType(name="rover", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS),
        PlanningType(name="climber", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS),
    )
    return situation_of(
        [carrier(), rover(1, "c1"), RobotState(name="r2", type="climber", carrier="c1"), rover(3, "c1")],
        {"cliff": Spot(12_000, {"climber": 1}), "near": room(22, 2), "far": room(32, 3)},
        {
            "m1": Spot(10_000, {"carrier": 0, "rover": 1, "climber": 1}),
            "m2": Spot(20_000, {"carrier": 0, "rover": 2, "climber": 2}),
            "m3": Spot(30_000, {"carrier": 0, "rover": 3, "climber": 3}),
        },
        {"c1_start": hall(0)},
        types=kinds,
    )


def test_each_outing_is_given_to_a_rover_of_its_type() -> None:
    situation = two_kinds()
    search = Annealing(encode(situation), [events_of(situation, first_plan(situation))], 0)
    search.step(0.0, 20)
    plan = plan_of(situation, search.events)
    assert check(situation, plan).valid
    assert MAKESPAN.value(situation, plan) == search.score
    explorers = {action.place: action.robot for action in plan.actions if action.place in ("cliff", "near", "far")}
    assert explorers["cliff"] == "r2"
    assert {explorers["near"], explorers["far"]} == {"r1", "r3"}


def test_rovers_of_a_type_are_as_good_as_each_other() -> None:
    situation = two_kinds()
    events = events_of(situation, first_plan(situation))
    others = events.copy()
    others[events[:, 1] == 1, 1], others[events[:, 1] == 3, 1] = 3, 1
    others[:4] = events[:4]
    assert (events[:, 0] == UNDOCK).sum() == 3
    one, other = (Annealing(encode(situation), [some], 0) for some in (events, others))
    assert one.score == other.score
    assert one.events.tolist() == other.events.tolist()


def doors_apart(robots: list[RobotState]) -> Situation:
    """Return: three rooms with doors at 10, 14 and 40 s; rovers can't drive between them."""
    return situation_of(
        robots,
        {"t1": room(12, 1), "t2": room(16, 2), "t3": room(38, 3)},
        {"m1": door(10, 1), "m2": door(14, 2), "m3": door(40, 3)},
        {"c1_start": hall(0), "r1_start": room(11, 1)},
    )


def test_targets_are_near_that_a_carrier_can_take_rovers_to_from_door_to_door() -> None:
    situation = doors_apart([carrier(), rover()])
    t1, t2, t3 = (situation.place_index[name] for name in ("t1", "t2", "t3"))
    near = encode(situation).near
    assert near[t1, :3].tolist() == [t2, t3, -1]
    assert near[t3, :3].tolist() == [t2, t1, -1]


def test_unreachable_targets_are_never_near() -> None:
    situation = doors_apart([rover()])
    assert (encode(situation).near == -1).all()

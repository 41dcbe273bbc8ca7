"""Small situations that can be solved by hand, for tests of planning, and larger ones that are drawn."""

import json
import random

from support.planning.spots import (
    DOCK_MS,
    UNDOCK_MS,
    Spot,
    carrier,
    default_types,
    door,
    hall,
    room,
    rover,
    situation_of,
)

from marsupial.formats.situation import situation_to_json
from marsupial.model.robots import Role
from marsupial.model.seats import Seats
from marsupial.model.situation import PlanningType, RobotState, Situation, SituationGoal


def one_hall() -> Situation:
    """Return: a carrier alone, two targets it explores itself, 10 s and 30 s away on the same side."""
    return situation_of([carrier()], {"t1": hall(10), "t2": hall(30)}, {}, {"c1_start": hall(0)})


def one_room(*, goal: SituationGoal | None = None) -> Situation:
    """Return: a carrier with a rover aboard, a door 10 s away and a target in the room, 4 s further for the rover.

    Best: move 0 to 10 000, undock to 15 001, explore to 19 002 ms. The carrier has a home where it starts.
    """
    team, targets = [carrier(home="home"), rover(on="c1")], {"t1": room(12)}
    return situation_of(team, targets, {"m1": door(10)}, {"c1_start": hall(0)}, homes={"home": hall(0)}, goal=goal)


def two_rooms() -> Situation:
    """Return: one carrier with one rover, two rooms 10 s to the left and 20 s to the right, one target in each.

    The rover has to be picked up at the first door, carried to the other one and set down there.
    """
    team, targets = [carrier(), rover(on="c1")], {"t1": room(-12, 1), "t2": room(22, 2)}
    return situation_of(team, targets, {"m1": door(-10, 1), "m2": door(20, 2)}, {"c1_start": hall(0)})


def rover_left_behind(*, free_at_ms: int = 0) -> Situation:
    """Return: a rover on the ground in room 1, a target in room 2, an empty carrier between: it has to be fetched."""
    team, meetings = [carrier(), rover(free_at_ms=free_at_ms)], {"m1": door(-10, 1), "m2": door(20, 2)}
    return situation_of(team, {"t1": room(22, 2)}, meetings, {"c1_start": hall(0), "r1_start": room(-11, 1)})


def relay() -> Situation:
    """Return: carrier 1 brings the rover to a room with a second door, carrier 2 takes it on from there.

    The carriers can't reach each other's halls; the target lies in a room off the hall of carrier 2.
    """
    return situation_of(
        [carrier(1), carrier(2), rover(on="c1")],
        {"t1": room(42, 2)},
        {"m1": door(10, 1), "m2": door(20, 1, carrier_zone=1), "m3": door(40, 2, carrier_zone=1)},
        {"c1_start": hall(0), "c2_start": hall(30, 1)},
    )


def in_flight() -> Situation:
    """Return: `one_room` with running actions: the carrier docks a rover until 7 s, another one drives until 3 s."""
    return situation_of(
        [carrier(free_at_ms=7_000), rover(1, "c1", free_at_ms=7_000), rover(2, free_at_ms=3_000)],
        {"t1": room(12, 1), "t2": room(5, 2), "t3": hall(-5)},
        {"m1": door(10, 1)},
        {"c1_start": hall(0), "r2_start": room(3, 2)},
    )


def no_capacity() -> Situation:
    """Return: a carrier that can't carry, a rover on the ground; each has a target it can explore by itself."""
    team, starts = [carrier(), rover()], {"c1_start": hall(0), "r1_start": room(2)}
    return situation_of(team, {"t1": hall(10), "t2": room(3)}, {"m1": door(1)}, starts, types=default_types(0))


def out_of_reach() -> Situation:
    """Return: `one_hall` with a target in a room that nobody can enter: there is no rover and no door."""
    return situation_of([carrier()], {"t1": hall(10), "t2": room(20)}, {}, {"c1_start": hall(0)})


def full_carrier() -> Situation:
    """Return: the carrier's one place holds a rover of the wrong type; it has to make room for the right one."""
    types = (*default_types(), PlanningType(name="climber", role=Role.ROVER, dock_ms=8_000, undock_ms=4_000))
    both = {"carrier": 0, "rover": 0, "climber": 0}
    climber = RobotState(name="k1", type="climber", place="k1_start")
    return situation_of(
        [carrier(), rover(on="c1"), climber],
        {"t1": Spot(22_000, {"climber": 2})},
        {"m1": Spot(10_000, both), "m2": Spot(20_000, {"carrier": 0, "climber": 2})},
        {"c1_start": hall(0), "k1_start": Spot(9_000, {"climber": 0})},
        types=types,
    )


def too_wide() -> Situation:
    """Return: `full_carrier`, whose rover is too wide for the climber's place, so it is set down elsewhere."""
    types = (*default_types(), PlanningType(name="climber", role=Role.ROVER, dock_ms=8_000, undock_ms=4_000))
    return situation_of(
        [carrier(), rover(on="c1"), RobotState(name="k1", type="climber", place="k1_start")],
        {"t1": Spot(22_000, {"climber": 2})},
        {
            "m1": Spot(10_000, {"carrier": 0, "climber": 0}),
            "m2": Spot(20_000, {"carrier": 0, "climber": 2}),
            "m3": Spot(-10_000, {"carrier": 0, "rover": 0}),
        },
        {"c1_start": hall(0), "k1_start": Spot(9_000, {"climber": 0})},
        types=types,
    )


def bring_them_home() -> Situation:
    """Return: nothing left to explore; two carriers with one place each, two rovers on the ground, all to go home."""
    return situation_of(
        [carrier(1, home="h1"), carrier(2, home="h2"), rover(1), rover(2)],
        {},
        {"m1": door(10, 1), "m2": door(-10, 2)},
        {"c1_start": hall(0), "c2_start": hall(1), "r1_start": room(-12, 2), "r2_start": room(11, 1)},
        homes={"h1": hall(0), "h2": hall(2)},
        goal=SituationGoal(recover_rovers=True, return_home=True),
    )


def mixed_types(carriers: Seats, haulers: Seats = ()) -> tuple[PlanningType, ...]:
    """Return two types of carriers with two places and these seats, rovers, rovers at half speed, and climbers."""
    return (
        PlanningType(name="carrier", role=Role.CARRIER, capacity=2, seats=carriers),
        PlanningType(name="hauler", role=Role.CARRIER, capacity=2, seats=haulers),
        PlanningType(name="rover", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS),
        PlanningType(name="rover_at_50", role=Role.ROVER, dock_ms=DOCK_MS, undock_ms=UNDOCK_MS, seats_as="rover"),
        PlanningType(name="climber", role=Role.ROVER, dock_ms=8_000, undock_ms=4_000),
    )


def wrong_carrier() -> Situation:
    """Return: the carrier beside the door takes climbers only, so that the hauler comes 60 s for the rover.

    Best: 60 s to the door, a dock until 70 s, 40 s back to the other door, an undock until 115 s, 4 s to the target.
    """
    zones = {"carrier": 0, "hauler": 0}
    return situation_of(
        [carrier(), RobotState(name="h1", type="hauler", place="h1_start"), rover()],
        {"t1": Spot(22_000, {"rover": 2})},
        {"m1": Spot(60_000, {**zones, "rover": 1}), "m2": Spot(20_000, {**zones, "rover": 2})},
        {"c1_start": Spot(60_000, zones), "h1_start": Spot(0, zones), "r1_start": Spot(60_000, {"rover": 1})},
        types=mixed_types((("climber", 2),), (("rover", 1),)),
    )


def seat_taken() -> Situation:
    """Return: a carrier with a place for one climber and one rover, which a slow rover has: it leaves before another.

    Best: the slow rover is set down at the door where the fast one waits, which is then taken to its target's room.
    """
    both = {"carrier": 0, "rover": 0, "rover_at_50": 0}
    slow = RobotState(name="s1", type="rover_at_50", carrier="c1")
    return situation_of(
        [carrier(), slow, rover()],
        {"t1": Spot(22_000, {"rover": 2})},
        {"m1": Spot(10_000, both), "m2": Spot(20_000, {"carrier": 0, "rover": 2})},
        {"c1_start": hall(0), "r1_start": Spot(10_000, {"rover": 0})},
        types=mixed_types((("rover", 1), ("climber", 1))),
    )


def everybody_seated() -> Situation:
    """Return: two carriers and a climber and two rovers on the ground, who all end aboard in one way only."""
    zones = {"carrier": 0, "hauler": 0, "rover": 0, "climber": 0}
    return situation_of(
        [
            carrier(),
            RobotState(name="h1", type="hauler", place="h1_start"),
            rover(1),
            rover(2),
            RobotState(name="k1", type="climber", place="k1_start"),
        ],
        {},
        {"m1": Spot(10_000, zones)},
        {f"{name}_start": Spot(1000 * i, zones) for i, name in enumerate(("c1", "h1", "r1", "r2", "k1"))},
        types=mixed_types((("rover", 1), ("climber", 2)), (("rover", 1),)),
        goal=SituationGoal(recover_rovers=True),
    )


SOLVABLE = {
    make.__name__: make
    for make in (
        one_hall, one_room, two_rooms, rover_left_behind, relay, in_flight, no_capacity, full_carrier, too_wide,
        bring_them_home, wrong_carrier, seat_taken, everybody_seated,
    )
}  # fmt: skip
"""Every situation above that has a plan reaching its whole goal."""


def many_rooms(carriers: int, rovers: int, targets: int, meetings: int, *, seed: int = 0) -> Situation:
    """Return a large situation: a 100 s wide hall with `meetings` doors to as many rooms; `rovers` aboard each carrier.

    Nine targets in ten lie in a room, within 15 s of its door; the others are the carriers' own.
    """
    draw = random.Random(seed)
    doors = {
        f"m{i}": Spot(draw.randrange(100_000), {"carrier": 0, "rover": i}, draw.randrange(100_000))
        for i in range(meetings)
    }
    spots: dict[str, Spot] = {}
    for i in range(targets):
        near = draw.randrange(meetings)
        at = doors[f"m{near}"]
        x, y = at.x + draw.randrange(-15_000, 15_000), at.y + draw.randrange(-15_000, 15_000)
        spots[f"t{i}"] = Spot(x, {"carrier": 0} if i % 10 == 9 else {"rover": near}, y)
    robots: list[RobotState] = []
    starts: dict[str, Spot] = {}
    for i in range(carriers):
        robots.append(carrier(i))
        starts[f"c{i}_start"] = Spot(draw.randrange(10_000), {"carrier": 0}, draw.randrange(10_000))
        robots += [rover(i * rovers + j, f"c{i}") for j in range(rovers)]
    return situation_of(robots, spots, doors, starts, types=default_types(max(1, rovers)))


def job_source(situation: Situation) -> dict[str, object]:
    """Return the body of a request to plan for a situation."""
    return {"situation": json.loads(situation_to_json(situation))}

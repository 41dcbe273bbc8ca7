"""A situation as a problem of the canonical domain: its objects, facts and goals, and its numbers as text.

`problem_text` alone defines how a situation becomes PDDL. Actions read most of the facts. *Records* are facts that no
action reads: they hold the rest of the situation, so that it can be read back exactly.
"""

import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import product
from math import isfinite

from marsupial.errors import Problem, SituationError
from marsupial.formats.pddl.domain import domain_of, names_seats
from marsupial.formats.pddl.names import encode_name, encode_type
from marsupial.model import PlanningBattery, PlanningType, RobotState, Role, Situation
from marsupial.model.bounds import MOST

_NUMBER = re.compile(r"[-+]?[0-9./]{1,1100}(?:[eE][-+]?[0-9]{1,3})?")


def seconds(ms: int) -> str:
    """Return a time in ms as seconds with three decimals."""
    return f"{'-' if ms < 0 else ''}{abs(ms) // 1000}.{abs(ms) % 1000:03d}"


def exact(text: str) -> Fraction:
    """Return the exact number in a text: decimal, with an exponent, or a fraction; else raise a `ValueError`."""
    # Digits and size are limited: ``1e1000000`` would fill the memory.
    if _NUMBER.fullmatch(text) is None:
        raise ValueError(f"{text[:40]!r} is no number of at most 1100 digits")
    try:
        value = Fraction(text)
    except ZeroDivisionError:
        raise ValueError(f"{text!r} divides by zero") from None
    if abs(value.numerator) > int(MOST) * value.denominator:  # faster than comparing a fraction with a float
        raise ValueError(f"{text} is more than {MOST:g}")
    return value


def duration_ms(ms: int) -> int:
    """Return the duration of an action whose travel or docking takes `ms`: at least 1, as PDDL requires more than 0."""
    return max(1, int(ms))


def start_of(situation: Situation) -> dict[str, RobotState]:
    """Return the robot at each start."""
    return {robot.place: robot for robot in situation.robots if robot.place is not None}


def problem_text(situation: Situation, *, name: str = "exploration", records: bool = True) -> str:
    """Return `situation` as a problem of its canonical domain; durations in seconds with three decimals.

    `records`: whether to write the facts that no action reads. Without them the problem is shorter and has the same
    plans, but the situation read back lacks what plans don't depend on: reveals and homes that are not in the goal, and
    the times until robots are free are part of their first drives. Charging places are left out where no robot has a
    battery.
    """
    situation = situation if situation.batteries else situation.without_batteries()
    lines = [
        f"(define (problem {encode_name(name)})",
        f"  (:domain {domain_of(situation)})",
        "",
        "  (:objects",
    ]
    lines += [f"    {word} - {kind}" for word, kind in _objects(situation)]
    lines += ["  )", "", "  (:init"]
    lines += ["    ; Where everybody is", *_whereabouts(situation)]
    lines += ["    ; What everybody can do", *_abilities(situation)]
    lines += ["    ; How long drives take", *_drives(situation)]
    lines += ["    ; Batteries", *_batteries(situation)] if situation.batteries else []
    lines += ["    ; Records, read by no action", *_records(situation)] if records else []
    lines += ["  )", "", "  (:goal (and", *_goals(situation), "  ))", "", "  (:metric minimize (total-time)))", ""]
    return "\n".join(lines)


def _fact(name: str, *args: str, value: str | None = None) -> str:
    """Return a line of a predicate that is true, or of a function with its value."""
    atom = f"({' '.join((name, *args))})"
    return f"    {atom}" if value is None else f"    (= {atom} {value})"


def _goals(situation: Situation) -> Iterator[str]:
    goal = situation.goal
    for target in situation.targets:
        yield _fact("explored", encode_name(target.name))
    for rover in situation.of_role(Role.ROVER) if goal.aboard else ():
        yield _fact("aboard", encode_name(rover.name))
    for carrier in situation.of_role(Role.CARRIER) if goal.return_home else ():
        if carrier.home is not None:
            yield _fact("at", encode_name(carrier.name), encode_name(carrier.home))


def _drive_ms(situation: Situation, kind: str, origin: str, place: str, owners: Mapping[str, RobotState]) -> int | None:
    """Return the `path_cost` of a drive in ms, or None if no action can use it."""
    # Only one robot leaves a start, so each drive's cost out of it includes the rest of that robot's running action.
    owner = owners.get(origin)
    if origin == place or place in owners or (owner is not None and owner.type != kind):
        return None
    ends = (situation.target_by_name.get(end) for end in (origin, place))
    if any(target is not None and kind not in target.explorers for target in ends):
        return None
    travel = situation.travel(kind, origin, place)
    return None if travel is None else duration_ms(travel) + (0 if owner is None else int(owner.free_at_ms))


def _objects(situation: Situation) -> Iterator[tuple[str, str]]:
    for kind in situation.types:
        yield encode_type(kind.name), "robot_type"
    for robot in situation.robots:
        yield encode_name(robot.name), situation.type_of(robot.name).role.value
    places = {"start": start_of(situation), "target": situation.target_by_name}
    stops = {"meeting": situation.meetings, "home": situation.homes, "charging_place": situation.chargers}
    for leaf, names in {**places, **stops}.items():
        yield from ((encode_name(name), leaf) for name in names)


def _whereabouts(situation: Situation) -> Iterator[str]:
    for robot in situation.robots:
        name = encode_name(robot.name)
        if robot.place is not None:
            yield _fact("at", name, encode_name(robot.place))
        if robot.carrier is not None:
            yield _fact("on", name, encode_name(robot.carrier))
            yield _fact("aboard", name)
    for carrier in situation.of_role(Role.CARRIER):
        docked = sum(robot.carrier == carrier.name for robot in situation.robots)
        yield _fact("num_docked", encode_name(carrier.name), value=str(docked))
    for key, value in seat_values(situation):
        yield _fact(*key, value=value)


def _abilities(situation: Situation) -> Iterator[str]:
    for kind in situation.types:
        yield _fact(f"role_{kind.role.value}", encode_type(kind.name))
    for robot in situation.robots:
        kind, name = situation.type_of(robot.name), encode_name(robot.name)
        yield _fact("is_a", name, encode_type(kind.name))
        if kind.role is Role.CARRIER:
            yield _fact("capacity", name, value=str(int(kind.capacity)))
        else:
            yield _fact("dock_time", name, value=seconds(duration_ms(kind.dock_ms)))
            yield _fact("undock_time", name, value=seconds(duration_ms(kind.undock_ms)))
        for target in situation.targets:
            if kind.name in target.explorers:
                yield _fact("can_explore", name, encode_name(target.name))
        for fact in seat_facts(situation, robot) if kind.role is Role.ROVER else ():
            yield _fact(*fact)
        for meeting in situation.meetings if kind.role is Role.ROVER else ():
            if situation.can_stand(kind.name, meeting):
                yield _fact("can_stand", name, encode_name(meeting))


def _drives(situation: Situation) -> Iterator[str]:
    for args, cost, _ in _table(situation):
        if cost is not None:
            yield _fact("path", *args)
            yield _fact("path_cost", *args, value=seconds(cost))


def _batteries(situation: Situation) -> Iterator[str]:
    for robot in situation.robots:
        if robot.name in situation.batteries and situation.batteries[robot.name].charge_w:
            yield _fact("can_charge", encode_name(robot.name))
        if robot.free_at_ms:  # no record here: actions read how long robots rest
            yield _fact("free_at", encode_name(robot.name), value=seconds(int(robot.free_at_ms)))
    for key, value in battery_values(situation):
        yield _fact(*key, value=value)


def battery_values(situation: Situation) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each function of batteries that actions read, with its arguments and its value."""
    owners, manned = start_of(situation), _manned(situation)
    for robot in situation.robots:
        name, battery = encode_name(robot.name), situation.batteries.get(robot.name, NO_BATTERY)
        charge_j = situation.charge_j(robot.name) if robot.name in situation.batteries else 0.0
        yield ("charge", name), number(charge_j)
        for function, value in battery_numbers(battery):
            yield (function, name), number(value)
        if situation.type_of(robot.name).role is Role.CARRIER:
            yield ("gives", name), str(int(robot.name in situation.batteries))
    for place in situation.places:
        yield ("rest", encode_name(place)), seconds(int(owners[place].free_at_ms) if place in owners else 0)
        for kind in situation.types if place not in owners else ():
            if kind.name in manned:
                yield ("back", encode_type(kind.name), encode_name(place)), _back_j(situation, kind, place)


NO_BATTERY = PlanningBattery(capacity_j=0.0)
"""The numbers of robots without a battery."""


def battery_numbers(battery: PlanningBattery) -> Iterator[tuple[str, float]]:
    """Yield the names of a battery's functions, and its numbers."""
    numbers = battery.capacity_j, battery.stand_w, battery.drive_w, battery.charge_w
    return zip(BATTERY_FUNCTIONS, numbers, strict=True)


BATTERY_FUNCTIONS = ("battery", "stand_power", "drive_power", "charge_power")


def _back_j(situation: Situation, kind: PlanningType, place: str) -> str:
    """Return the least charge for the way from a place to a charging place, or to where a carrier picks a rover up."""
    battery, rover = kind.battery or NO_BATTERY, kind.role is Role.ROVER
    ends = {name: Decimal(0) for name in situation.chargers}
    if rover:
        ends |= dict.fromkeys(situation.meetings, _decimal(battery.stand_w) * duration_ms(kind.dock_ms))
    drives = ((end, 0 if end == place else situation.travel(kind.name, place, end)) for end in ends)
    ways = ((end, ms if end == place else duration_ms(ms)) for end, ms in drives if ms is not None)
    needed = [ends[end] + _decimal(battery.drive_w) * ms for end, ms in ways]
    # out of reach of all of them: more than there is
    lost = _decimal(battery.capacity_j) * 1000 if rover or situation.chargers else Decimal(0)
    return format(min(needed, default=lost) / 1000, "f")


def _decimal(value: float) -> Decimal:
    return Decimal(repr(float(value)))


def number(value: float) -> str:
    """Return a number with all its digits, without an exponent."""
    return format(_decimal(value), "f")


def _records(situation: Situation) -> Iterator[str]:
    for flag in ("recover_rovers", "return_home"):
        if getattr(situation.goal, flag):
            yield _fact(flag)
    for robot in situation.robots:
        if robot.home is not None:
            yield _fact("home_of", encode_name(robot.name), encode_name(robot.home))
        if robot.free_at_ms and not situation.batteries:
            yield _fact("free_at", encode_name(robot.name), value=seconds(int(robot.free_at_ms)))
    yield from _target_records(situation)
    for kind in situation.types:
        yield from _type_records(situation, kind)
    for args, cost, travel in _table(situation):
        # A `path_cost` is at least 1 ms, so it can't hold a travel time of 0.
        if travel is not None and (cost is None or travel == 0):
            yield _fact("travel", *args, value=seconds(travel))


def _target_records(situation: Situation) -> Iterator[str]:
    for i, target in enumerate(situation.targets):
        if not isfinite(target.reveal_m2):
            raise SituationError([Problem(f"targets[{i}].reveal_m2", f"PDDL can't hold {target.reveal_m2}")])
        if target.reveal_m2:
            yield _fact("reveal", encode_name(target.name), value=number(target.reveal_m2))
        for kind in sorted(target.explorers - _manned(situation)):
            yield _fact("explores", encode_type(kind), encode_name(target.name))


def _type_records(situation: Situation, kind: PlanningType) -> Iterator[str]:
    """Yield the numbers of a type that the facts of its robots don't hold."""
    manned = kind.name in _manned(situation)
    if kind.capacity and not (manned and kind.role is Role.CARRIER):
        yield _fact("type_capacity", encode_type(kind.name), value=str(int(kind.capacity)))
    for rover, most in kind.seats:
        yield _fact("type_seats", encode_type(kind.name), encode_type(rover), value=str(int(most)))
    for function, value in battery_numbers(kind.battery) if kind.battery and situation.batteries and not manned else ():
        yield _fact(f"type_{function}", encode_type(kind.name), value=number(value))
    if kind.seats_as:
        yield _fact("seats_as", encode_type(kind.name), encode_type(kind.seats_as))
    for name, time in (("type_dock_time", kind.dock_ms), ("type_undock_time", kind.undock_ms)):
        # The facts of rovers hold docking times, but at least 1 ms; without rovers, reading assumes 0.
        in_facts = manned and kind.role is Role.ROVER
        if time != (duration_ms(time) if in_facts else 0):
            yield _fact(name, encode_type(kind.name), value=seconds(int(time)))


def seat_values(situation: Situation) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each function of seats, with its arguments and its value; none in the plain domain."""
    takers = {situation.type_of(rover.name).seat: rover.name for rover in situation.of_role(Role.ROVER)}
    for carrier in situation.of_role(Role.CARRIER) if names_seats(situation) else ():
        aboard = [situation.type_of(one.name).seat for one in situation.robots if one.carrier == carrier.name]
        for kind, rover in takers.items():
            args = encode_name(carrier.name), encode_type(kind)
            yield ("num_seated", *args), str(aboard.count(kind))
            yield ("seats", *args), str(situation.most_aboard(carrier.name, rover))


def seat_facts(situation: Situation, rover: RobotState) -> Iterator[tuple[str, ...]]:
    """Yield the facts about the carriers that a rover fits on; none in the plain domain."""
    for carrier in situation.of_role(Role.CARRIER) if names_seats(situation) else ():
        if situation.most_aboard(carrier.name, rover.name):
            seat = encode_type(situation.type_of(rover.name).seat)
            yield "fits", encode_name(rover.name), seat, encode_name(carrier.name)


def _manned(situation: Situation) -> frozenset[str]:
    return frozenset(robot.type for robot in situation.robots)


def _table(situation: Situation) -> Iterator[tuple[tuple[str, str, str], int | None, int | None]]:
    """Yield, for each type and pair of places: the PDDL names, the `path_cost` and the travel time in ms."""
    owners = start_of(situation)
    names = {place: encode_name(place) for place in situation.places}
    manned = _manned(situation)
    for kind in situation.types:
        word = encode_type(kind.name)
        for origin, place in product(situation.places, situation.places):
            cost = _drive_ms(situation, kind.name, origin, place, owners) if kind.name in manned else None
            yield (word, names[origin], names[place]), cost, situation.travel(kind.name, origin, place)

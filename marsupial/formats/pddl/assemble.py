"""The situation that the facts of a PDDL problem describe.

Facts that actions read take precedence; records add what these leave open. If a fact contradicts another one (two
robots at one start, two carriers of a type with different capacities), its line is reported.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from marsupial.errors import SituationError
from marsupial.formats.pddl.domain import PLAIN, WITH_BATTERIES
from marsupial.formats.pddl.facts import (
    BATTERY_FUNCTIONS,
    battery_values,
    duration_ms,
    exact,
    seat_facts,
    seat_values,
    seconds,
)
from marsupial.formats.pddl.names import decode_name, decode_type
from marsupial.formats.pddl.sexpr import at_line
from marsupial.formats.pddl.table import FactKey, FactTable
from marsupial.model import (
    UNREACHABLE,
    PlanningBattery,
    PlanningType,
    RobotState,
    Situation,
    SituationGoal,
    TargetInfo,
    TravelTable,
)
from marsupial.model.bounds import team_fault
from marsupial.model.robots import Role
from marsupial.model.seats import Seats
from marsupial.wording import counted

# most entries of all travel tables together, 8 bytes each: a few lines of objects could ask for any number
MOST_ENTRIES = 20_000_000

Members = Mapping[str, str]  # the type's object of each robot, in order

N = TypeVar("N", int, float)


def assemble(table: FactTable) -> Situation:
    """Return the situation that the facts describe. Raise `SituationError` with every contradiction and its line."""
    words = table.of_kind("carrier", "rover")
    if fault := team_fault(len(words)):  # at once: what follows compares robots with all else
        raise SituationError([at_line(1, f"robots: {fault}")])
    members = {robot: _type_word(table, robot) for robot in words}
    _check_starts(table)
    _check_loads(table)
    types = tuple(_type(table, word, members) for word in table.of_kind("robot_type"))
    robots = tuple(_robot(table, robot, kind) for robot, kind in members.items())
    explorers = table.firsts("explores")
    targets = tuple(_target(table, word, members, explorers[word]) for word in table.of_kind("target"))
    travel = _travel(table, members)
    goal = _goal(table)
    table.check()
    situation = Situation(
        types=types,
        robots=robots,
        targets=targets,
        meetings=tuple(decode_name(word) for word in table.of_kind("meeting")),
        homes=tuple(decode_name(word) for word in table.of_kind("home")),
        chargers=tuple(decode_name(word) for word in table.of_kind("charging_place")),
        travel_ms=travel,
        goal=goal,
    )
    if table.domain != PLAIN:
        _check_seats(table, situation)
    if table.domain == WITH_BATTERIES:
        _check_batteries(table, situation)
    table.check()
    return situation


def _type_word(table: FactTable, robot: str) -> str:
    found = table.single("is_a", robot)
    if found is None:
        table.wrong(table.lines[robot], f"(is_a {robot} <robot_type>) is missing")
    return found or ""


def _type(table: FactTable, word: str, members: Members) -> PlanningType:
    of_type = [robot for robot, kind in members.items() if kind == word]
    carriers, rovers = ([r for r in of_type if table.kinds[r] == kind] for kind in ("carrier", "rover"))
    return PlanningType(
        name=decode_type(word),
        role=_role(table, word, carriers, rovers),
        capacity=_trait(table, "capacity", word, carriers),
        dock_ms=_trait(table, "dock_time", word, rovers),
        undock_ms=_trait(table, "undock_time", word, rovers),
        battery=_battery(table, word, of_type),
        seats=_seats(table, word, carriers),
        seats_as=_seats_as(table, word, rovers),
    )


def _seats(table: FactTable, word: str, carriers: Sequence[str]) -> Seats:
    """Return the seats of a type of carriers: its records, or where no type has any, the facts of its first carrier."""
    recorded = any(key[0] in ("type_seats", "seats_as") for key in (*table.values, *table.facts))
    first = ("type_seats", word) if recorded else ("seats", *carriers[:1])
    found = [(key[2], table.count(key)) for key in table.values if key[:2] == first]
    if not recorded and table.domain == WITH_BATTERIES:  # where all have seats, those that limit nothing are none
        places = table.count(("capacity", *carriers[:1]))
        found = [] if all(number == places for _, number in found) else found
    return tuple((decode_type(rover), number) for rover, number in found if number is not None)


def _seats_as(table: FactTable, word: str, rovers: Sequence[str]) -> str:
    """Return the type whose seats rovers of a type take, nothing for their own: by its record or a rover's fact."""
    facts = (key[2] for key in table.facts if key[0] == "fits" and key[1] in rovers)
    found = table.single("seats_as", word) or next(facts, word)
    return "" if found == word else decode_type(found)


def _battery(table: FactTable, word: str, robots: Sequence[str]) -> PlanningBattery | None:
    """Return the battery of a type: that of its robots, or its records if it has none."""
    if table.domain != WITH_BATTERIES:
        return None
    capacity_j, stand_w, drive_w, charge_w = (
        (_shared(table, name, robots, table.number) if robots else table.number((f"type_{name}", word))) or 0.0
        for name in BATTERY_FUNCTIONS
    )
    if not capacity_j:
        return None
    return PlanningBattery(capacity_j=capacity_j, stand_w=stand_w, drive_w=drive_w, charge_w=charge_w)


def _charge_j(table: FactTable, robot: str) -> float | None:
    """Return the charge of a robot's battery; None for a full one, and without a battery."""
    full = table.number(("battery", robot))
    charge_j = table.number(("charge", robot))
    return None if not full or charge_j == full else charge_j


def _check_values(table: FactTable, own: Mapping[str, str], wanted: Iterable[tuple[FactKey, str]]) -> None:
    """Check that functions have the values that the situation gives them; `own` are the table's `own` names."""
    for written, value in wanted:
        key = tuple(own.get(word, word) for word in written)
        if key not in table.values:
            table.wrong(table.lines[key[1]], f"({' '.join(key)}) is missing")
        elif table.values[key][0] != exact(value):
            table.wrong(table.line_of(key), f"({' '.join(key)}) must be {value}")


def _check_seats(table: FactTable, situation: Situation) -> None:
    """Check that the facts about seats say what `situation` says."""
    own = table.own()
    _check_values(table, own, seat_values(situation))
    wanted = {
        tuple(own.get(word, word) for word in fact)
        for rover in situation.of_role(Role.ROVER)
        for fact in seat_facts(situation, rover)
    }
    given = {key: line for key, line in table.facts.items() if key[0] == "fits"}
    for key in sorted(wanted - given.keys()):
        table.wrong(table.lines[key[1]], f"({' '.join(key)}) is missing")
    for key in given.keys() - wanted:
        table.wrong(given[key], f"({' '.join(key)}) contradicts the seats of {key[-1]}")


def _check_batteries(table: FactTable, situation: Situation) -> None:
    """Check that the facts about batteries say what `situation` says."""
    _check_values(table, table.own(), battery_values(situation))
    if not situation.batteries:
        table.wrong(1, "no robot has a battery: then a problem is one of another domain")
    able = {word for word in table.of_kind("carrier", "rover") if table.number(("charge_power", word))}
    for word in able ^ {key[1] for key in table.facts if key[0] == "can_charge"}:
        table.wrong(table.lines[word], f"(can_charge {word}) must be true if its charge_power is not 0, and only then")


def _role(table: FactTable, word: str, carriers: Sequence[str], rovers: Sequence[str]) -> Role:
    is_carrier = bool(carriers) or ("role_carrier", word) in table.facts
    is_rover = bool(rovers) or ("role_rover", word) in table.facts
    if is_carrier == is_rover:
        what = "for both carriers and rovers" if is_carrier else "for neither carriers nor rovers"
        table.wrong(table.lines[word], f"robot type {word} is {what}")
    return Role.CARRIER if is_carrier else Role.ROVER


def _trait(table: FactTable, name: str, word: str, robots: Sequence[str]) -> int:
    """Return the number in a type's record, which its robots' facts have to agree with, or else that of the facts."""
    counts, key = name == "capacity", (f"type_{name}", word)
    read, text = (table.count, str) if counts else (table.ms, seconds)
    shared, record = _shared(table, name, robots, read), read(key)
    if record is not None and shared is not None and (record if counts else duration_ms(record)) != shared:
        noun = "carriers" if counts else "rovers"
        table.wrong(table.line_of(key), f"{word} has {name} {text(record)}, its {noun} {text(shared)}")
    return (shared if record is None else record) or 0


def _shared(table: FactTable, name: str, robots: Sequence[str], read: Callable[[FactKey], N | None]) -> N | None:
    """Return the number that all robots of a type have in common; None if there are no robots."""
    shared: N | None = None
    for robot in robots:
        number = read((name, robot))
        if (name, robot) not in table.values:
            table.wrong(table.lines[robot], f"({name} {robot}) is missing")
        elif shared is not None and number is not None and number != shared:
            line = table.line_of((name, robot))
            table.wrong(line, f"({name} {robot}) differs from that of {robots[0]}, a robot of the same type")
        elif shared is None:
            shared = number
    return shared


def _robot(table: FactTable, word: str, kind: str) -> RobotState:
    places, carrier = table.args("at", word), table.single("on", word)
    if len(places) + (carrier is not None) != 1:
        table.wrong(table.lines[word], f"{word} must be at one place or on one carrier")
    for place in places:
        if table.kinds[place] != "start":
            table.wrong(table.facts["at", word, place], f"{word} must begin at a start of its own, not at {place}")
    if (carrier is not None) != (("aboard", word) in table.facts):
        table.wrong(table.lines[word], f"(aboard {word}) must be true if {word} is on a carrier, and only then")
    home = table.single("home_of", word) or _home_in_goal(table, word)
    return RobotState(
        name=decode_name(word),
        type=decode_type(kind),
        place=decode_name(places[0]) if places else None,
        carrier=None if carrier is None else decode_name(carrier),
        free_at_ms=table.ms(("free_at", word)) or 0,
        charge_j=_charge_j(table, word),
        home=None if home is None else decode_name(home),
    )


def _home_in_goal(table: FactTable, robot: str) -> str | None:
    return next((key[2] for key in table.goals if key[:2] == ("at", robot) and table.kinds[key[2]] == "home"), None)


def _check_starts(table: FactTable) -> None:
    owners: dict[str, str] = {}
    for (name, *args), line in table.facts.items():
        if name == "at" and args[1] in owners:
            table.wrong(line, f"{args[1]} is the start of {owners[args[1]]} already; each robot needs its own")
        elif name == "at":
            owners[args[1]] = args[0]
    for start in table.of_kind("start"):
        if start not in owners:
            table.wrong(table.lines[start], f"no robot is at start {start}")


def _check_loads(table: FactTable) -> None:
    """Check that `num_docked` is the number of rovers aboard."""
    aboard = table.firsts("on")
    for carrier in table.of_kind("carrier"):
        load = len(aboard[carrier])
        count = table.count(("num_docked", carrier))
        if ("num_docked", carrier) not in table.values:
            table.wrong(table.lines[carrier], f"(num_docked {carrier}) is missing")
        elif count is not None and count != load:
            table.wrong(table.line_of(("num_docked", carrier)), f"{counted(load, 'rover')} on {carrier}, not {count}")


def _target(table: FactTable, word: str, members: Members, explorers: set[str]) -> TargetInfo:
    able = {robot for robot in members if ("can_explore", robot, word) in table.facts}
    kinds = {members[robot] for robot in able}
    for robot, kind in members.items():
        if kind in kinds and robot not in able:
            table.wrong(table.lines[robot], f"{robot} can't explore {word}, but another robot of type {kind} can")
    if ("explored", word) in table.facts:
        table.wrong(table.facts["explored", word], f"{word} is explored already: leave it out")
    reveal = table.values.get(("reveal", word))
    return TargetInfo(
        name=decode_name(word),
        explorers=frozenset(decode_type(kind) for kind in kinds | explorers),
        reveal_m2=0.0 if reveal is None else float(reveal[0]),
    )


def _goal(table: FactTable) -> SituationGoal:
    """Return the goal's flags from records, or else from the goal itself; check that both agree."""
    returns = ("return_home",) in table.facts or any(key[0] == "at" for key in table.goals)
    aboard = any(key[0] == "aboard" for key in table.goals)
    recovers = ("recover_rovers",) in table.facts or (aboard and not returns)
    wanted = set(_wanted(table, recovers, returns))
    for key in sorted(wanted - table.goals.keys()):
        table.wrong(table.goal_line, f"({' '.join(key)}) is missing in the goal")
    for key in table.goals.keys() - wanted:
        table.wrong(table.goals[key], f"({' '.join(key)}) is no goal that a situation can have here")
    return SituationGoal(recover_rovers=recovers, return_home=returns)


def _wanted(table: FactTable, recovers: bool, returns: bool) -> Iterator[FactKey]:
    for target in table.of_kind("target"):
        yield "explored", target
    if recovers or returns:
        for rover in table.of_kind("rover"):
            yield "aboard", rover
    for carrier in table.of_kind("carrier") if returns else ():
        home = next(iter(table.args("home_of", carrier)), _home_in_goal(table, carrier))
        if home is not None:
            yield "at", carrier, home


def _travel(table: FactTable, members: Members) -> dict[str, TravelTable]:
    """Return the travel tables, without the rest of a running action that `path_cost` of a first drive includes."""
    owners = {key[2]: key[1] for key in table.facts if key[0] == "at"}
    starts = [place for robot in members for place in table.args("at", robot)]
    places = [*starts, *table.of_kind("target"), *table.of_kind("meeting"), *table.of_kind("home", "charging_place")]
    index = {place: i for i, place in enumerate(places)}
    shape, entries = (len(places), len(places)), len(places) ** 2 * len(table.of_kind("robot_type"))
    if entries > MOST_ENTRIES:
        squared = "(robot types times places squared)"
        table.wrong(1, f"travel tables of {entries} entries {squared}, more than {MOST_ENTRIES}")
        return {}
    tables = {word: np.full(shape, UNREACHABLE, dtype=np.int64) for word in table.of_kind("robot_type")}
    for (word, origin, place), time in _drives(table, members, owners):
        if origin in index and place in index:
            tables[word][index[origin], index[place]] = time
    rovers, meetings = table.of_kind("rover"), {word: index[word] for word in table.of_kind("meeting")}
    for kind, times in tables.items():
        _stand(table, [rover for rover in rovers if members[rover] == kind], times, meetings)
    return {decode_type(word): rows for word, rows in tables.items()}


def _stand(table: FactTable, rovers: Sequence[str], times: TravelTable, meetings: Mapping[str, int]) -> None:
    """Record where rovers of a type can be set down; report where one can't although another can, or drives there."""
    for meeting, at in meetings.items():
        fits = [rover for rover in rovers if ("can_stand", rover, meeting) in table.facts]
        reached = bool((times[:, at] != UNREACHABLE).any())
        why = "a drive leads there" if reached else f"{fits[0]} of the same type can" if fits else ""
        for rover in rovers if why else ():
            if rover not in fits:
                table.wrong(table.lines[rover], f"(can_stand {rover} {meeting}) is missing, but {why}")
        if fits and not reached:
            times[at, at] = 0


def _drives(table: FactTable, members: Members, owners: Mapping[str, str]) -> Iterator[tuple[FactKey, int]]:
    for (name, *args), line in table.facts.items():
        if name == "path":
            time = _drive_ms(table, tuple(args), line, members, owners)
            if time is not None:
                yield tuple(args), time
    for key, (_, line) in table.values.items():
        if key[0] == "path_cost" and ("path", *key[1:]) not in table.facts:
            table.wrong(line, f"({' '.join(key)}) without (path {' '.join(key[1:])})")
        record = table.ms(key) if key[0] == "travel" else None
        if record is not None:
            yield key[1:], record


def _drive_ms(table: FactTable, args: FactKey, line: int, members: Members, owners: Mapping[str, str]) -> int | None:
    """Return the travel time of a drive for which there is a path fact."""
    key = ("path_cost", *args)
    cost = table.ms(key)
    if key not in table.values:
        table.wrong(line, f"({' '.join(key)}) is missing")
    if cost is None:
        return None
    owner = owners.get(args[1])
    free = (table.ms(("free_at", owner)) if owner is not None and members.get(owner) == args[0] else None) or 0
    if cost <= free:
        table.wrong(table.line_of(key), f"({' '.join(key)}) must be more than {seconds(free)}, got {seconds(cost)}")
    record = table.ms(("travel", *args))
    if record is not None and duration_ms(record) != cost - free:
        table.wrong(table.line_of(("travel", *args)), f"(travel {' '.join(args)}) contradicts (path_cost ...)")
    return cost - free

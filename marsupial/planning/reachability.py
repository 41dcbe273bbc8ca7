"""Prove cheaply that a situation has no plan.

The relaxation ignores time and conflicts with other robots: a robot keeps access to every place it has ever reached,
and a carrier may carry a rover from any meeting they share to any other meeting of that carrier. A place unreachable in
the relaxation is unreachable. Whether all rovers can end aboard is a matching of rovers to places on carriers.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType

import numpy as np

from marsupial.arrays import Flags
from marsupial.model import RobotState, Role, Situation
from marsupial.wording import counted


def reach(situation: Situation) -> dict[str, Flags]:
    """Return, per robot, which places (bool, order of `situation.places`) it could ever get to, carried or not."""
    carriers = situation.of_role(Role.CARRIER)
    reached = _each(situation, carriers, {}, _closure)
    meetings = _flags(situation, situation.meetings)
    rovers_of: dict[str, list[RobotState]] = {}
    for rover in situation.of_role(Role.ROVER):
        rovers_of.setdefault(rover.type, []).append(rover)
    for kind, rovers in rovers_of.items():
        fits = {
            carrier.name: reached[carrier.name] & meetings & situation.standing[kind]
            for carrier in carriers
            if situation.most_aboard(carrier.name, rovers[0].name)
        }
        distinct = np.array(list({flags.tobytes(): flags for flags in fits.values()}.values()), dtype=np.bool_)
        reached |= _each(situation, rovers, fits, partial(_carried, distinct))
    return reached


def hopeless_targets(
    situation: Situation, reached: Mapping[str, Flags], robot_types: Mapping[str, str] = MappingProxyType({})
) -> dict[str, str]:
    """Return the targets that no plan can explore, each with the reason as a sentence; `reached` is of `reach`.

    `robot_types` has the robot types of planning types that are called otherwise.
    """
    by_type: dict[str, Flags] = {}
    for robot in situation.robots:
        by_type[robot.type] = by_type.get(robot.type, False) | reached[robot.name]
    reasons = {}
    for target in situation.targets:
        column = situation.place_index[target.name]
        explorers = sorted(target.explorers & by_type.keys())
        if not explorers:
            reasons[target.name] = f"no robot of the team is of a type that can explore {target.name}"
        elif not any(by_type[kind][column] for kind in explorers):
            kinds = sorted({robot_types.get(kind, kind) for kind in explorers})
            reasons[target.name] = f"no {' or '.join(kinds)} can get to {target.name}, not even carried"
    return reasons


def impossible(situation: Situation) -> str | None:
    """Return a sentence that proves that no plan reaches the goal, or None where there may be one."""
    return next(obstacles(situation), None)


def obstacles(situation: Situation, robot_types: Mapping[str, str] = MappingProxyType({})) -> Iterator[str]:
    """Yield sentences, each of which proves that no plan reaches the goal; there may be other obstacles."""
    reached = reach(situation)
    yield from hopeless_targets(situation, reached, robot_types).values()
    goal = situation.goal
    if goal.aboard:
        yield from _seatless(situation, reached)
    for robot in situation.of_role(Role.CARRIER) if goal.return_home else ():
        if robot.home is not None and not reached[robot.name][situation.place_index[robot.home]]:
            yield f"{robot.name} has no path to its home {robot.home}"
    dead_end = _dead_end(situation, reached)
    if dead_end is not None:
        yield dead_end


def _seatless(situation: Situation, reached: Mapping[str, Flags]) -> Iterator[str]:
    """Yield which rovers can't all end aboard, and why; those that are aboard keep their places if they can."""
    carriers = situation.of_role(Role.CARRIER)
    boards = list(zip(situation.of_role(Role.ROVER), _boards(situation, reached), strict=True))
    boards.sort(key=lambda pair: pair[0].carrier is None)
    # by the type whose seats they take
    groups = {situation.type_of(rover.name).seat: rover.name for rover, _ in boards}
    places = [situation.type_of(carrier.name).capacity for carrier in carriers]
    most = [[situation.most_aboard(carrier.name, rover) for rover in groups.values()] for carrier in carriers]
    group = [list(groups).index(situation.type_of(rover.name).seat) for rover, _ in boards]
    seats = matching([options for _, options in boards], group, places, most)
    without: dict[str, list[str]] = {}
    for (rover, options), own, seat in zip(boards, group, seats, strict=True):
        if seat < 0:
            able = [carriers[k].name for k in options]
            if able:
                total = counted(sum(most[k][own] for k in options), "place")
                why = f"of the carriers only {', '.join(able)} can get there, with {total} in all"
            else:
                why = f"no carrier with places {'can get there' if any(row[own] for row in most) else 'is left'}"
            without.setdefault(why, []).append(rover.name)
    for why, names in without.items():
        yield f"no place aboard for {', '.join(names)}: {why}"


def matching(
    options: Sequence[Sequence[int]], groups: Sequence[int], places: Sequence[int], most: Sequence[Sequence[int]]
) -> list[int]:
    """Give as many rovers as possible a place on a carrier; return the carrier of each, -1 for none.

    `options` has per rover the carriers it can go on, the preferred one first, and `groups` its group. A rover that has
    a place keeps one, and the same one unless a later rover would otherwise find none. `places` has the number of
    places per carrier, `most` how many of them rovers of each group can have.
    """
    chosen = [-1] * len(options)
    aboard: list[list[int]] = [[] for _ in places]

    def all_taken(carrier: int, group: int) -> bool:
        return sum(groups[other] == group for other in aboard[carrier]) >= most[carrier][group]

    def seat(rover: int, seen: set[tuple[int, int]]) -> bool:
        group = groups[rover]
        seen.add((-1, rover))
        roomy = (k for k in options[rover] if len(aboard[k]) < places[k] and not all_taken(k, group))
        found = next(roomy, -1)
        for carrier in options[rover] if found < 0 else ():
            # Where the seats of its group are taken, only a rover of that group makes room.
            alike = all_taken(carrier, group)
            where = (carrier, group if alike else -1)
            if where in seen:
                continue
            seen.add(where)
            leave = (
                other
                for other in aboard[carrier]
                if (groups[other] == group or not alike) and (-1, other) not in seen and seat(other, seen)
            )
            other = next(leave, None)
            if other is not None:
                aboard[carrier].remove(other)
                found = carrier
                break
        if found >= 0:
            aboard[found].append(rover)
            chosen[rover] = found
        return found >= 0

    for rover in range(len(options)):
        seat(rover, set())
    return chosen


def _dead_end(situation: Situation, reached: Mapping[str, Flags]) -> str | None:
    """Return a sentence on a target whose explorers all get stuck before where they have to end, if there is one.

    A rover has to get to a meeting that a carrier with places for it gets to, a carrier to its home if it has to return
    there.
    """
    if not situation.goal.aboard:
        return None
    carriers, meetings = situation.of_role(Role.CARRIER), _flags(situation, situation.meetings)
    served: dict[str, Flags] = {}
    for rover in situation.of_role(Role.ROVER):
        if rover.type not in served:
            fitting = [c.name for c in carriers if situation.most_aboard(c.name, rover.name)]
            served[rover.type] = meetings & np.logical_or.reduce([meetings & False, *(reached[c] for c in fitting)])
    drives = {kind.name: _drives(situation, kind.name) for kind in situation.types}
    closed: dict[tuple[str, bytes], Flags] = {}

    def ends_well(robot: RobotState, target: int) -> bool:
        first = drives[robot.type][target]
        key = (robot.type, first.tobytes())
        if key not in closed:
            closed[key] = _closure(drives[robot.type], first)
        ends = True
        if situation.type_by_name[robot.type].role is Role.ROVER:
            ends = bool((closed[key] & served[robot.type]).any())
        elif situation.goal.return_home and robot.home is not None:
            ends = bool(closed[key][situation.place_index[robot.home]])
        return ends and bool(reached[robot.name][target])

    for target in situation.targets:
        explorers = (robot for robot in situation.robots if robot.type in target.explorers)
        if not any(ends_well(robot, situation.place_index[target.name]) for robot in explorers):
            return f"whoever explores {target.name} can't get from there to where it has to end"
    return None


def _boards(situation: Situation, reached: Mapping[str, Flags]) -> list[list[int]]:
    """Return, per rover, the carriers it could be aboard at the end."""
    rovers, carriers = situation.of_role(Role.ROVER), situation.of_role(Role.CARRIER)
    columns = [situation.place_index[name] for name in situation.meetings]

    def meets(team: Sequence[RobotState]) -> Flags:
        rows = [reached[robot.name][columns] for robot in team]
        return np.array(rows, dtype=np.bool_).reshape(len(team), len(columns))

    boards = meets(rovers) @ meets(carriers).T
    for i, rover in enumerate(rovers):
        if rover.carrier is not None:
            boards[i, [carrier.name for carrier in carriers].index(rover.carrier)] = True
    return [
        [k for k in np.flatnonzero(row).tolist() if situation.most_aboard(carriers[k].name, rover.name)]
        for rover, row in zip(rovers, boards, strict=True)
    ]


def _each(
    situation: Situation,
    robots: Sequence[RobotState],
    served: Mapping[str, Flags],
    close: Callable[[Flags, Flags], Flags],
) -> dict[str, Flags]:
    """Return what each robot reaches: its start, or where it is set down (`served`), and what `close` adds."""
    drives = {kind: _drives(situation, kind) for kind in {robot.type for robot in robots}}
    # no place is a start and something else, so robots that first get to the same places reach the same
    closed: dict[tuple[str, bytes], Flags] = {}
    reached = {}
    for robot in robots:
        start = None if robot.place is None else situation.place_index[robot.place]
        first = served[robot.carrier or ""] if start is None else drives[robot.type][start]
        key = (robot.type, first.tobytes())
        if key not in closed:
            closed[key] = close(drives[robot.type], first)
        reached[robot.name] = closed[key].copy()
        if start is not None:
            reached[robot.name][start] = True
    return reached


def _drives(situation: Situation, kind: str) -> Flags:
    """Return where a type can drive from where in one action: bool (places, places)."""
    enterable = [target.name for target in situation.targets if kind in target.explorers]
    return (situation.travel_ms[kind] >= 0) & _flags(situation, (*enterable, *situation.meetings, *situation.homes))


def _flags(situation: Situation, names: Sequence[str]) -> Flags:
    flags = np.zeros(len(situation.places), dtype=np.bool_)
    flags[[situation.place_index[name] for name in names]] = True
    return flags


def _closure(drives: Flags, seed: Flags) -> Flags:
    while True:
        grown = seed | drives[seed].any(axis=0)
        if np.array_equal(grown, seed):
            return seed
        seed = grown


def _carried(served: Flags, drives: Flags, seed: Flags) -> Flags:
    """Return the closure of driving and being carried; `served` are the meetings of carriers, (carriers, places)."""
    reached = _closure(drives, seed)
    while len(served):
        grown = _closure(drives, reached | served[(served & reached).any(axis=1)].any(axis=0))
        if np.array_equal(grown, reached):
            break
        reached = grown
    return reached

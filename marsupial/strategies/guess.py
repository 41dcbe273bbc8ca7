"""Guesses the work in the unknown part of the map, so that plans prepare for it.

A plan for the known targets alone is short-sighted: carriers share the nearest frontiers, rovers are set down although
they will soon be needed elsewhere, and tours end far from future targets. So `guess` adds targets in the unknown to the
situation, the planner plans for all of them, and `Guess.real_part` translates the plan back.

How it works
------------
::

        known ground            frontier          unknown

    carrier ------------------> gate t_1 . . . . . . . ?a       hall: a carrier explores it, or also a
            known travel time    |   .  straight x BEND         rover that can drive on carriers' ground
                                 |     .
    carrier ------------------> gate t_2 . . . . . ?door_b - ?b  room: a carrier sets a rover down at
                                                     ROOM_MS     the door, the rover explores the room

1. `marsupial.maps.unseen` divides the unknown into squares. The nearest `MOST_SQUARES` become guessed targets.
2. A square is a *room*, for rovers only, or a *hall*. The share of rooms is the share of the seen ground that only
   rovers can drive on or get to; the share of halls that rovers can explore as well is the share of carriers' ground
   that they can drive on. Where rooms are islands (rovers can't drive on carriers' ground at all), carriers have to
   bring them; elsewhere a rover on the ground drives on by itself. Each square has a random number that stays the same
   for the whole mission (`Square.draw`), so that it does not change its kind from plan to plan.
3. The path to a square leads through a *gate*, a known target that the robot can explore, then straight on; `BEND`
   allows for walls. The travel time from any place is the least over all gates.
4. The objective weights a real target with the area that it may reveal, to the power `early` and 1 in the mean, and a
   square with `WORTH` times its unknown share; both times their priority, 1 without priority zones. So most of the
   ground is seen early. Corners that show hardly anything are left for when a robot is near, as a target within
   `NEAR_MS` of one weighs at least 1, or for the end.
5. Robots get a small discount on their current drives, as turning round for an equally good plan wastes driving.
6. In the plan, each robot's actions are real up to its first one in a square. This one becomes a drive to the gate on
   the way, even if another robot explores that target: the robot is then near when the ground behind it is revealed.
   Later actions are dropped; they are planned again once the map has grown.

The guess is often wrong, which costs little: docs/strategies.md has the figures, and the rejected variants.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from marsupial.arrays import Floats
from marsupial.model import Action, ActionName, Briefing, Cell, GuessedGround, Plan, Role, Square
from marsupial.model.situation import UNREACHABLE, Situation, TargetInfo, TravelTable
from marsupial.model.team import after
from marsupial.planning.schedule.timeline import retime

WORTH = 0.5  # weight of a completely unknown square, relative to a real target
BEND = 2.0  # length of a path through the unknown relative to a straight line, to allow for walls
ROOM_MS = 6000  # travel time of a rover from the door of a room to its target
MOST_SQUARES = 40  # greatest number of guessed targets; planning time grows with it

LEAST_M2 = 4.0
"""Targets that may reveal less than this count as much: leaving all of them for later would make the end longer."""

NEAR_MS = 5000
"""Targets that a robot on the ground can reach in this time weigh at least 1: it won't be as near again."""

HEAD_START_MS = 2000  # discount on a robot's current drive: the price of changing the plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """The situation with guessed targets, the worth of each target, the real situation, and gates to squares."""

    situation: Situation
    worth: Mapping[str, float]
    real: Situation
    # by the place in a square that carriers drive to (its target, or the door of a room): the known targets that lead
    # there, with the path length from each in metres
    gates: Mapping[str, Sequence[tuple[str, float]]] = field(default_factory=dict)
    speed_mps: Mapping[str, float] = field(default_factory=dict)  # by robot type
    ground: GuessedGround | None = None  # the squares, for those who read the log

    def real_part(self, plan: Plan) -> Plan:
        """Return the real part of a plan for the guessed situation, with the travel times of the real one."""
        return retime(self.real, self.real_actions(plan))

    def real_actions(self, plan: Plan) -> list[Action]:
        """Return the actions of the real part, with other times."""
        at = {robot.name: robot.place for robot in self.real.robots}
        halted: set[str] = set()  # robots whose next action was guessed
        kept: list[Action] = []
        for action in plan.actions:
            # a docking needs both robots: if one has halted, the other halts as well
            if halted.isdisjoint(action.robots) and action.place in self.real.place_index:
                kept.append(action)
                at[action.robot] = after(action).at
                continue
            for robot in sorted(set(action.robots) - halted):
                origin = at[robot]
                if origin is not None:
                    kept += self._drive_to_gate(robot, origin, action.place, kept)
            halted.update(action.robots)
        return kept

    def _drive_to_gate(self, robot: str, origin: str, place: str, done: Sequence[Action]) -> list[Action]:
        """Return the drive to the target that a robot can explore on its fastest path to a square, if there is one."""
        kind = self.real.robot_by_name[robot].type
        options = [
            (travel + 1000 * metres / self.speed_mps[kind], target)
            for target, metres in self.gates.get(place, ())
            if kind in self.real.target_by_name[target].explorers
            and (travel := self.real.travel(kind, origin, target)) is not None
        ]
        _, target = min(options, default=(0.0, origin))
        if target == origin or any(action.robot == robot and action.place == target for action in done):
            return []
        return [Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=0, robot=robot, place=target, origin=origin)]


def guess(briefing: Briefing, *, early: float) -> Guess:
    """Return the guess for a briefing; `early` is the power of the area in the worth of targets, 0 if all count alike.

    It adds no targets if no gate leads into the unknown, or if there are no carriers, which bring rovers to rooms. A
    single robot gets none either: it has no other robot to spread out from and no rover to keep aboard, and guessed
    targets only divert it from near ones.
    """
    real = briefing.situation
    worth = _worth(real, early)
    begun = _with_head_starts(real, briefing.previous)
    nothing = Guess(situation=begun, worth=worth, real=real)
    present = {robot.type for robot in real.robots}
    carriers, rovers = (
        frozenset(kind.name for kind in real.types if kind.role is role and kind.name in present)
        for role in (Role.CARRIER, Role.ROVER)
    )
    if len(real.robots) == 1 or not carriers:
        return nothing
    unseen = briefing.unseen()
    # without rovers in the team, no robot could explore a room
    share, shared = (unseen.rovers_only, unseen.shared) if rovers else (0.0, 0.0)
    driving = carriers | rovers if shared > 0 else carriers
    gates = tuple(t.name for t in real.targets if t.explorers & driving and t.name in unseen.at_m)
    if not gates or not unseen.squares:
        return nothing
    where = np.array([unseen.at_m[name] for name in gates])
    metres = _path_m(np.array([(s.x_m, s.y_m) for s in unseen.squares]), where)
    # what is worth more counts as nearer; stable sorting keeps missions reproducible where distances are equal
    apart = metres.min(axis=1) / np.array([square.priority for square in unseen.squares])
    nearest = np.sort(np.argsort(apart, kind="stable")[:MOST_SQUARES])
    chosen, metres = [unseen.squares[i] for i in nearest.tolist()], metres[nearest]
    # halls before rooms, as `_extended` expects
    order = sorted(range(len(chosen)), key=lambda i: chosen[i].draw < share)
    squares = []
    for square in (chosen[i] for i in order):
        room = square.draw < share
        # the part of the random number above the share of rooms decides about halls
        both = (square.draw - share) < shared * (1 - share)
        explorers = rovers if room else carriers | rovers if both else carriers
        squares.append(_Guessed(square=square, room=room, explorers=explorers))
    situation = _extended(begun, squares, driving, gates, metres[order], unseen.speed_mps)
    worth |= {one.target: WORTH * one.square.share * one.square.priority for one in squares}
    ways = [list(zip(gates, row, strict=True)) for row in metres[order].tolist()]
    by_place = {place: way for one, way in zip(squares, ways, strict=True) for place in (one.target, one.entry)}
    placed = [(one.room, one.square.at) for one in squares if one.square.at is not None]
    halls, rooms = (tuple(cell for room, cell in placed if room is kind) for kind in (False, True))
    ground = GuessedGround(corner=Cell(0, 0), side=unseen.side, halls=halls, rooms=rooms)
    return Guess(situation=situation, worth=worth, real=real, gates=by_place, speed_mps=unseen.speed_mps, ground=ground)


def _worth(real: Situation, early: float) -> dict[str, float]:
    """Return the worth of each real target, given the power of the area that it may reveal."""
    areas = {target.name: max(LEAST_M2, target.reveal_m2) ** early for target in real.targets}
    mean = sum(areas.values()) / max(1, len(areas))
    on_ground = [(robot.type, robot.place) for robot in real.robots if robot.place is not None]
    worth = {}
    for target in real.targets:
        times = [real.travel(kind, place, target.name) for kind, place in on_ground if kind in target.explorers]
        near = any(time is not None and time <= NEAR_MS for time in times)
        worth[target.name] = target.priority * max(areas[target.name] / mean, float(near))
    return worth


@dataclass(frozen=True, slots=True, kw_only=True)
class _Guessed:
    """A square, whether it is a room, and the robot types that can explore it."""

    square: Square
    room: bool
    explorers: frozenset[str]

    @property
    def target(self) -> str:
        """Name of the guessed target."""
        return f"?{self.square.name}"

    @property
    def entry(self) -> str:
        """The place that paths lead to: the door of a room, the target in a hall."""
        return f"?door_{self.square.name}" if self.room else self.target


def _with_head_starts(situation: Situation, previous: Plan | None) -> Situation:
    """Return the situation with less travel time for the first drive of every robot in the previous plan."""
    travel = {name: table.copy() for name, table in situation.travel_ms.items()}
    seen: set[str] = set()
    for action in () if previous is None else previous.actions:
        for name in action.robots:
            robot = situation.robot_by_name[name]
            # only the first drive counts, and a rover aboard does not drive
            if name in seen or robot.place is None or robot.place == action.place:
                continue
            seen.add(name)
            way = situation.place_index[robot.place], situation.place_index[action.place]
            table = travel[robot.type]
            if table[way] != UNREACHABLE:
                table[way] = max(0, int(table[way]) - HEAD_START_MS)
    return replace(situation, travel_ms=travel)


def _path_m(some: Floats, others: Floats) -> Floats:
    """Return the estimated path lengths between positions (n, 2) and (m, 2) as (n, m), in metres."""
    return BEND * np.hypot(some[:, None, 0] - others[:, 0], some[:, None, 1] - others[:, 1])


def _extended(
    situation: Situation,
    squares: Sequence[_Guessed],
    driving: frozenset[str],
    gates: Sequence[str],
    metres: Floats,
    speed_mps: Mapping[str, float],
) -> Situation:
    """Return the situation with these squares added as targets, halls before rooms.

    Robots of the types `driving` drive through gates, at `metres` (squares, gates); others are carried to rooms' doors.
    """
    targets = [TargetInfo(name=one.target, explorers=one.explorers) for one in squares]
    rooms = [one for one in squares if one.room]
    # the order of `Situation.places`
    starts = [robot.place for robot in situation.robots if robot.place is not None]
    names = starts + [t.name for t in situation.targets] + [t.name for t in targets] + list(situation.meetings)
    names += [one.entry for one in rooms] + list(situation.homes)
    index = {name: i for i, name in enumerate(names)}
    old = np.array([index[name] for name in situation.places])
    guessed = np.setdiff1d(np.arange(len(names)), old)
    new = np.array([index[one.entry] for one in squares])
    doors, inside = [index[one.entry] for one in rooms], [index[one.target] for one in rooms]
    middles = np.array([(one.square.x_m, one.square.y_m) for one in squares])
    between = _path_m(middles, middles)
    travel = {}
    for kind in situation.types:
        table = np.full((len(names), len(names)), UNREACHABLE, dtype=np.int64)
        known = situation.travel_ms[kind.name]
        table[np.ix_(old, old)] = known
        mine = [i for i, name in enumerate(gates) if kind.name in situation.target_by_name[name].explorers]
        if mine and kind.name in driving:
            via = np.array([situation.place_index[gates[i]] for i in mine])
            # (places, squares, gates): the time to each gate and on to each square, and the other way round
            beyond = 1000 * metres[:, mine] / speed_mps[kind.name]
            table[np.ix_(old, new)] = _fastest(known[:, via][:, None, :] + beyond, known[:, via][:, None, :])
            table[np.ix_(new, old)] = _fastest(beyond[:, None, :] + known[via].T, known[via].T[None])
            table[np.ix_(new, new)] = 1000 * between / speed_mps[kind.name]
        if kind.role is Role.ROVER:
            # in and out of rooms by their doors
            table[doors, doors] = 0
            table[:, inside] = np.where(table[:, doors] == UNREACHABLE, UNREACHABLE, table[:, doors] + ROOM_MS)
            table[inside] = np.where(table[doors] == UNREACHABLE, UNREACHABLE, table[doors] + ROOM_MS)
        table[guessed, guessed] = 0
        travel[kind.name] = table
    return replace(
        situation,
        targets=(*situation.targets, *targets),
        meetings=(*situation.meetings, *(one.entry for one in rooms)),
        travel_ms=travel,
    )


def _fastest(times: Floats, known: TravelTable) -> TravelTable:
    """Return the least of `times` along the last axis, without those whose `known` part has no path."""
    best = np.where(known == UNREACHABLE, np.inf, times).min(axis=-1)
    return np.where(np.isfinite(best), best, UNREACHABLE).astype(np.int64)

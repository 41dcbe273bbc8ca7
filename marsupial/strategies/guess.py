"""What may still have to be done, guessed: the situation with jobs in the part of the map that nobody has seen.

Every square of the unknown (`marsupial.maps.unseen`) is taken for one more job. In as many squares as there has been
ground for rovers only so far it is a room: a rover has to be set down there. The others are for a carrier to see. The
way to a square leads over a target that carriers can explore, then straight on, with some allowance for walls.

A plan for the guess spreads carriers over the unknown, keeps rovers aboard that will be needed there, ends tours
where more work may turn up. Of such a plan robots do what is real, up to the first thing that is not: instead of going
to a square they go to the target on the way there, even if another robot explores it, so as to be there when it has.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Floats
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, Situation, TargetInfo, TravelTable
from marsupial.model.strategy import Briefing
from marsupial.model.team import after
from marsupial.model.unseen import Square
from marsupial.planning.schedule import retime

WORTH = 0.5
"""What a square all of which is unknown counts as beside a target."""

BEND = 2.0
"""How much longer than straight the ways are, walls being where nobody has seen any yet."""

ROOM_MS = 6000
"""How long a rover takes from the door of a guessed room to what there is to see."""

MOST_SQUARES = 40
"""How many squares are planned for: those nearest to a target."""

HEAD_START_MS = 2000
"""By how much the way is shortened that a robot is on already: the price of another plan for it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """The guessed situation and what each of its targets is worth, the real one, and the ways to the squares.

    `gates` are by the place in a square that carriers drive to.
    """

    situation: Situation
    worth: Mapping[str, float]
    real: Situation
    gates: Mapping[str, _Gate]

    def real_part(self, plan: Plan) -> Plan:
        """Return what robots do of a plan for the guess, on the clock of the real situation."""
        at = {robot.name: robot.place for robot in self.real.robots}
        halted: set[str] = set()
        kept: list[Action] = []
        for action in plan.actions:
            if halted.isdisjoint(action.robots) and action.place in self.real.place_index:
                kept.append(action)
                at[action.robot] = after(action).at
                continue
            for robot in sorted(set(action.robots) - halted):
                gate = self.gates.get(action.place)
                if gate is not None and at[robot] is not None:
                    kept += self._to_gate(robot, str(at[robot]), gate, kept)
            halted.update(action.robots)
        return retime(self.real, kept)

    def _to_gate(self, robot: str, origin: str, gate: _Gate, done: Sequence[Action]) -> list[Action]:
        target = gate.nearest(self.real, self.real.robot_by_name[robot].type, origin)
        been = any(action.robot == robot and action.place == target for action in done)
        if target is None or target == origin or been:
            return []
        explore = ActionName.EXPLORE
        return [Action(name=explore, start_ms=0, duration_ms=0, robot=robot, place=target, carrier=None, origin=origin)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Gate:
    """The ways to a square: over which targets, and how long it is from each (m)."""

    targets: tuple[str, ...]
    metres: tuple[float, ...]
    speed_mps: Mapping[str, float]

    def nearest(self, situation: Situation, kind: str, origin: str) -> str | None:
        """Return the target over which a robot gets there soonest."""
        options = [
            (travel + 1000 * metres / self.speed_mps[kind], target)
            for target, metres in zip(self.targets, self.metres, strict=True)
            if (travel := situation.travel(kind, origin, target)) is not None
        ]
        return min(options)[1] if options else None


def guess(briefing: Briefing) -> Guess:
    """Return the guess for a moment.

    It holds nothing new without targets that carriers can explore, nor for a robot by itself: that has nobody to keep
    away from and no rover to keep aboard, and is only drawn away from what is near.
    """
    real = briefing.situation
    worth = dict.fromkeys((target.name for target in real.targets), 1.0)
    begun = _with_head_starts(real, briefing.previous)
    carriers = frozenset(kind.name for kind in real.types if kind.role is Role.CARRIER)
    if len(real.robots) == 1:
        return Guess(situation=begun, worth=worth, real=real, gates={})
    unseen = briefing.unseen()
    gates = tuple(t.name for t in real.targets if t.explorers & carriers and t.name in unseen.at_m)
    if not gates or not unseen.squares:
        return Guess(situation=begun, worth=worth, real=real, gates={})
    where = np.array([unseen.at_m[name] for name in gates])
    apart = _apart(np.array([(s.x_m, s.y_m) for s in unseen.squares]), where)
    nearest = np.sort(np.argsort(apart.min(axis=1), kind="stable")[:MOST_SQUARES])
    chosen, apart = [unseen.squares[i] for i in nearest.tolist()], apart[nearest]
    rovers = frozenset(kind.name for kind in real.types if kind.role is Role.ROVER)
    share = unseen.rovers_only if any(robot.type in rovers for robot in real.robots) else 0.0
    rooms = [square for square in chosen if square.draw < share]
    halls = [square for square in chosen if square.draw >= share]
    order = [chosen.index(square) for square in halls + rooms]
    situation = _grown(begun, halls, rooms, (carriers, rovers), gates, apart[order], unseen.speed_mps)
    worth |= {_job(square): WORTH * square.share for square in chosen}
    ways = {
        name: _Gate(targets=gates, metres=tuple(row), speed_mps=unseen.speed_mps)
        for name, row in zip(_ends(halls, rooms), apart[order].tolist(), strict=True)
    }
    return Guess(situation=situation, worth=worth, real=real, gates=ways)


def _with_head_starts(situation: Situation, previous: Plan | None) -> Situation:
    """Return the situation with the first way of every robot in the previous plan a little shorter."""
    travel = {name: table.copy() for name, table in situation.travel_ms.items()}
    seen: set[str] = set()
    for action in () if previous is None else previous.actions:
        for name in action.robots:
            robot = situation.robot_by_name[name]
            if name in seen or robot.place is None or robot.place == action.place:
                continue
            seen.add(name)
            way = situation.place_index[robot.place], situation.place_index[action.place]
            table = travel[robot.type]
            if table[way] != UNREACHABLE:
                table[way] = max(0, int(table[way]) - HEAD_START_MS)
    return replace(situation, travel_ms=travel)


def _job(square: Square) -> str:
    return f"?{square.name}"


def _door(square: Square) -> str:
    return f"?door_{square.name}"


def _ends(halls: Iterable[Square], rooms: Iterable[Square]) -> list[str]:
    """Return the places in squares that carriers drive to."""
    return [_job(square) for square in halls] + [_door(square) for square in rooms]


def _apart(some: Floats, others: Floats) -> Floats:
    """Return the length of the ways between positions, in metres."""
    return BEND * np.hypot(some[:, None, 0] - others[:, 0], some[:, None, 1] - others[:, 1])


def _grown(
    situation: Situation,
    halls: Sequence[Square],
    rooms: Sequence[Square],
    kinds: tuple[frozenset[str], frozenset[str]],
    gates: Sequence[str],
    apart: Floats,
    speed_mps: Mapping[str, float],
) -> Situation:
    """Return the situation with these squares added; `kinds` are the carriers' and the rovers' types.

    `apart` is (squares, gates), in metres, halls before rooms.
    """
    targets = [TargetInfo(name=_job(square), explorers=kinds[0]) for square in halls]
    targets += [TargetInfo(name=_job(square), explorers=kinds[1]) for square in rooms]
    starts = [robot.place for robot in situation.robots if robot.place is not None]
    names = starts + [t.name for t in situation.targets] + [t.name for t in targets] + list(situation.meetings)
    names += [_door(square) for square in rooms] + list(situation.homes)
    index = {name: i for i, name in enumerate(names)}
    old = np.array([index[name] for name in situation.places])
    new = np.array([index[name] for name in _ends(halls, rooms)])
    middles = np.array([(square.x_m, square.y_m) for square in [*halls, *rooms]])
    between = _apart(middles, middles)
    via = np.array([situation.place_index[name] for name in gates])
    travel = {}
    for kind in situation.types:
        table = np.full((len(names), len(names)), UNREACHABLE, dtype=np.int64)
        known = situation.travel_ms[kind.name]
        table[np.ix_(old, old)] = known
        if kind.role is Role.CARRIER:
            beyond = 1000 * apart / speed_mps[kind.name]
            table[np.ix_(old, new)] = _least(known[:, via][:, None, :] + beyond, known[:, via][:, None, :])
            table[np.ix_(new, old)] = _least(beyond[:, None, :] + known[via].T, known[via].T[None])
            table[np.ix_(new, new)] = 1000 * between / speed_mps[kind.name]
        else:
            for square in rooms:
                door, job = index[_door(square)], index[_job(square)]
                table[door, job] = table[job, door] = ROOM_MS
        np.fill_diagonal(table, 0)
        travel[kind.name] = table
    return replace(
        situation,
        targets=(*situation.targets, *targets),
        meetings=(*situation.meetings, *(_door(square) for square in rooms)),
        travel_ms=travel,
    )


def _least(times: Floats, known: TravelTable) -> TravelTable:
    """Return the least of the times along the last axis, of those whose known part is a path."""
    best = np.where(known == UNREACHABLE, np.inf, times).min(axis=-1)
    return np.where(np.isfinite(best), best, UNREACHABLE).astype(np.int64)

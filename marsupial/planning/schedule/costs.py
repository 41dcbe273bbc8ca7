"""Driving durations as arrays that can be added: the lookup tables of list scheduling.

A travel table written by hand may have holes: pairs of places without a direct path, but with a path via others. List
scheduling plans with one drive at a time, so `Detours` fills holes for it and expands its plan afterwards.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import EPSILON_MS, UNREACHABLE, Action, ActionName, Plan, Role, Situation, TravelTable

NEVER = 1 << 56  # times from here on mean never; a dozen of them add up without overflow


class Seating(NamedTuple):
    """Rovers in groups that take the same seats; a single group where rovers of all types fit everywhere."""

    firsts: list[str]  # the first rover of each group
    groups: Ints  # (robots,): the group of each rover, 0 for carriers
    places: Ints  # (carriers,): how many rovers each can carry
    seats: Ints  # (carriers, groups): how many of them may be of each group


def _seating(situation: Situation) -> Seating:
    firsts: dict[str, str] = {}
    groups = np.zeros(len(situation.robots), dtype=np.int64)
    for i, robot in enumerate(situation.robots):
        kind = situation.type_by_name[robot.type]
        if kind.role is Role.ROVER:
            seat = kind.seat if situation.has_seats else ""
            firsts.setdefault(seat, robot.name)
            groups[i] = list(firsts).index(seat)
    carriers = situation.of_role(Role.CARRIER)
    places = np.array([situation.type_by_name[one.type].capacity for one in carriers], dtype=np.int64)
    seats = [situation.most_aboard(one.name, first) for one in carriers for first in firsts.values()]
    table = np.array(seats, dtype=np.int64).reshape(len(carriers), len(firsts))
    return Seating(list(firsts.values()), groups, places, table)


class Costs:
    """Durations of driving as actions have them: at least 1 ms, `NEVER` without a path; with gaps between meetings."""

    def __init__(self, situation: Situation) -> None:
        self.seating = _seating(situation)
        index = situation.place_index
        meetings = np.array([index[name] for name in situation.meetings], dtype=np.intp)
        targets = np.array([index[target.name] for target in situation.targets], dtype=np.intp)
        kinds, places = len(situation.types), len(index)
        # (types, places, targets): exploring a target from a place
        self.explore: Ints = np.empty((kinds, places, len(targets)), dtype=np.int64)
        # (types, places, meetings): from being ready at a place to being ready at a meeting, 0 where it is the same
        self.meet: Ints = np.empty((kinds, places, len(meetings)), dtype=np.int64)
        for k, kind in enumerate(situation.types):
            drive = driving_ms(situation.travel_ms[kind.name])
            may = np.array([kind.name in target.explorers for target in situation.targets], dtype=np.bool_)
            self.explore[k] = np.where(may, drive[:, targets], NEVER)
            self.meet[k] = drive[:, meetings] + EPSILON_MS
            # Staying takes no action, hence no gap between actions either; `NEVER` where the type can't stand.
            self.meet[k, meetings, np.arange(len(meetings))] = staying_ms(situation, kind.name)[meetings]
        # (types, meetings, targets): the same from a meeting
        self.sortie: Ints = np.ascontiguousarray(self.explore[:, meetings])
        # (types, meetings, meetings): the same from a meeting
        self.stay: Ints = np.ascontiguousarray(self.meet[:, meetings])
        # the same with `NEVER` on the diagonal: a transport that goes nowhere is useless
        self.transport: Ints = self.stay.copy()
        self.transport[:, np.arange(len(meetings)), np.arange(len(meetings))] = NEVER


def driving_ms(table: TravelTable) -> Ints:
    """Return the durations of a travel table's actions: at least 1 ms, `NEVER` without a path."""
    return np.where(table == UNREACHABLE, NEVER, np.maximum(table, 1))


def staying_ms(situation: Situation, kind: str) -> Ints:
    """Return per place 0, or `NEVER` where robots of a type can't stand."""
    return np.where(situation.standing[kind], 0, NEVER)


class Detours:
    """A situation with its holes filled."""

    def __init__(self, situation: Situation) -> None:
        stops = np.array([situation.place_index[name] for name in situation.meetings + situation.homes], dtype=np.intp)
        self._hops: Mapping[str, Ints] = {}
        self.situation = self._before = situation
        torn = [kind for kind, table in situation.travel_ms.items() if _has_detour(table, stops)]
        if torn:
            filled = {kind: _filled(situation.travel_ms[kind], stops) for kind in torn}
            tables = dict(situation.travel_ms) | {kind: table for kind, (table, _) in filled.items()}
            self._hops = {kind: hops for kind, (_, hops) in filled.items()}
            # the situation with each hole filled, where that is possible, by the time of a detour over meetings and
            # homes, gaps between actions included; the situation itself if it has no such holes
            self.situation = replace(situation, travel_ms=tables)

    def expanded(self, plan: Plan) -> Plan:
        """Return a plan for the filled situation as one for the original situation."""
        return Plan.of(drive for action in plan.actions for drive in self._drives(action)) if self._hops else plan

    def _drives(self, action: Action) -> Iterator[Action]:
        kind, places = self._before.robot_by_name[action.robot].type, self._before.places
        if action.origin is None or self._before.travel(kind, action.origin, action.place) is not None:
            yield action
            return
        at, start_ms = action.origin, action.start_ms
        while at != action.place:
            index = self._before.place_index
            place = places[self._hops[kind][index[at], index[action.place]]]
            travel_ms = max(1, self._before.travel(kind, at, place) or 0)
            name = action.name if place == action.place else ActionName.MOVE
            yield replace(action, name=name, start_ms=start_ms, duration_ms=travel_ms, origin=at, place=place)
            at, start_ms = place, start_ms + travel_ms + EPSILON_MS


def _has_detour(table: TravelTable, stops: Ints) -> bool:
    """Return whether some hole has a detour with a single stop; if none has, no hole has one with more stops."""
    roads = table != UNREACHABLE
    np.fill_diagonal(roads, True)
    # Packed rows: a stop makes a detour if it reaches what some place that reaches the stop does not.
    packed = np.packbits(roads, axis=1)
    return any((packed[stop] & ~packed[roads[:, stop]]).any() for stop in stops)


def _filled(table: TravelTable, stops: Ints) -> tuple[TravelTable, Ints]:
    """Return the table with its holes filled, and per pair of places the next place on the way (Floyd and Warshall)."""
    ms = driving_ms(table)
    hops = np.broadcast_to(np.arange(len(table)), table.shape).copy()
    for stop in stops:
        by_way = ms[:, stop, None] + EPSILON_MS + ms[stop]
        shorter = (by_way < ms) & (by_way < NEVER)
        ms[shorter] = by_way[shorter]
        hops[shorter] = np.broadcast_to(hops[:, stop, None], table.shape)[shorter]
    holes = (table == UNREACHABLE) & (ms < NEVER)
    np.fill_diagonal(holes, False)
    return np.where(holes, ms, table), hops

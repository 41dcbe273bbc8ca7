"""Holes in travel tables: where there is no road from one place to another, but there is one by way of others.

Travel times taken from a map have no such holes; those written by hand may. They are filled for those who plan with
one drive at a time, and the plan is then told in the drives there are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from marsupial.model.plan import EPSILON_MS, Action, ActionName, Plan
from marsupial.model.situation import UNREACHABLE, Situation, TravelTable
from marsupial.planning.list_scheduling.costs import NEVER, Indices, driving_ms


class Detours:
    """A situation whose holes are filled.

    Attributes
    ----------
    situation
        The situation with, in every hole that there is a way round, the time that takes by way of meetings and homes,
        gaps between actions included; the situation as it was where there is none.
    """

    def __init__(self, situation: Situation) -> None:
        stops = np.array([situation.place_index[name] for name in situation.meetings + situation.homes], dtype=np.intp)
        self._hops: Mapping[str, Indices] = {}
        self.situation = self._before = situation
        torn = [kind for kind, table in situation.travel_ms.items() if _has_detour(table, stops)]
        if torn:
            filled = {kind: _filled(situation.travel_ms[kind], stops) for kind in torn}
            tables = dict(situation.travel_ms) | {kind: table for kind, (table, _) in filled.items()}
            self._hops = {kind: hops for kind, (_, hops) in filled.items()}
            self.situation = replace(situation, travel_ms=tables)

    def told(self, plan: Plan) -> Plan:
        """Return a plan for the filled situation as one for the situation as it was."""
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


def _has_detour(table: TravelTable, stops: Indices) -> bool:
    """Say whether somewhere there is no road but one with a single stop; if not, then none with more stops either."""
    roads = table != UNREACHABLE
    np.fill_diagonal(roads, True)
    packed = np.packbits(roads, axis=1)
    return any((packed[stop] & ~packed[roads[:, stop]]).any() for stop in stops)


def _filled(table: TravelTable, stops: Indices) -> tuple[TravelTable, Indices]:
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

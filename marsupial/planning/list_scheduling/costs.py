"""Durations of driving as arrays that can be added up: the lookup tables of list scheduling."""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Flags, Ints
from marsupial.model import EPSILON_MS, UNREACHABLE, Situation, TravelTable

Times = Ints
Indices = Ints
Mask = Flags
NEVER = 1 << 56  # times from here on mean never; a dozen of them add up without overflow


class Costs:
    """Durations of driving, as they will stand in actions: at least 1 ms, `NEVER` without a path.

    All tables are int64 and contiguous. Those between being ready at one place and at another count the gap between
    actions.
    """

    def __init__(self, situation: Situation) -> None:
        index = situation.place_index
        meetings = np.array([index[name] for name in situation.meetings], dtype=np.intp)
        targets = np.array([index[target.name] for target in situation.targets], dtype=np.intp)
        kinds, places = len(situation.types), len(index)
        # (types, places, targets): exploring a target from a place
        self.explore: Times = np.empty((kinds, places, len(targets)), dtype=np.int64)
        # (types, places, meetings): from being ready at a place to being ready at a meeting, 0 where it is the same
        self.meet: Times = np.empty((kinds, places, len(meetings)), dtype=np.int64)
        for k, kind in enumerate(situation.types):
            drive = driving_ms(situation.travel_ms[kind.name])
            may = np.array([kind.name in target.explorers for target in situation.targets], dtype=np.bool_)
            self.explore[k] = np.where(may, drive[:, targets], NEVER)
            self.meet[k] = drive[:, meetings] + EPSILON_MS
        # Staying takes no action, hence no gap between actions either.
        self.meet[:, meetings, np.arange(len(meetings))] = 0
        # (types, meetings, targets): the same from a meeting
        self.sortie: Times = np.ascontiguousarray(self.explore[:, meetings])
        # (types, meetings, meetings): the same from a meeting
        self.stay: Times = np.ascontiguousarray(self.meet[:, meetings])
        # the same with `NEVER` on the diagonal: a transport that goes nowhere is useless
        self.transport: Times = self.stay.copy()
        self.transport[:, np.arange(len(meetings)), np.arange(len(meetings))] = NEVER


def driving_ms(table: TravelTable) -> Times:
    """Return the durations of a travel table's actions: at least 1 ms, `NEVER` without a path."""
    return np.where(table == UNREACHABLE, NEVER, np.maximum(table, 1))

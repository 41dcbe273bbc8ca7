"""The states of missions that this server was asked about, each brought up to date before it judges.

Reports of one mission may come through any server. So a report is judged within the transaction that stores it, and
by then the state has taken in whatever other servers have stored.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from marsupial_service.missions import packed
from marsupial_service.missions.kept import brief_in
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.state import MissionState
from marsupial_service.missions.values import MissionBrief, MissionReport
from marsupial_service.store import packing
from marsupial_service.store.transaction import StoreReader

_MOST_CELLS = 200_000_000  # bytes of all maps that are held


@dataclass(slots=True)
class _Known:
    """A state, and how many of the mission's inputs and events it has taken in."""

    brief: MissionBrief
    state: MissionState
    inputs: int = 0
    events: int = 0


class MissionStates:
    """The states; those that were not asked for of late are forgotten. Used by one thread, but for `brief`."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, _Known] = OrderedDict()

    def brief(self, mission: str) -> MissionBrief | None:
        """Return what a mission was created with, if it is known here; for any thread."""
        known = self._known.get(mission)
        return None if known is None else known.brief

    def of(self, reader: StoreReader, record: MissionRecord) -> MissionState:
        """Return the state of a mission with all that is stored of it, commands before reports."""
        known = self._known.get(record.id)
        if known is None:
            found = brief(reader, record)
            known = self._known[record.id] = _Known(found, MissionState(found))
        self._known.move_to_end(record.id)
        if record.events > known.events:
            for _, event in packed.events_after(reader, record.number, known.events):
                known.state.publish(event)
            known.events = record.events
        if record.inputs > known.inputs:
            for report, digest in packed.inputs_after(reader, record.number, known.inputs):
                if digest is not None:
                    assert isinstance(report, MissionReport)
                    known.state.take(report, digest)
            known.inputs = record.inputs
        self._forget()
        return known.state

    def replace(self, record: MissionRecord, state: MissionState) -> Callable[[], None]:
        """Replace a state by `state`, to which all inputs of `record` were applied; return what undoes that."""
        known = self._known[record.id]
        known.state, known.inputs = state, record.inputs
        return lambda: self.drop(record.id)

    def drop(self, mission: str) -> None:
        """Forget a state."""
        self._known.pop(mission, None)

    def _forget(self) -> None:
        # the one that was asked for last stays, however large it is
        while len(self._known) > 1 and sum(known.state.cells.size for known in self._known.values()) > _MOST_CELLS:
            self._known.popitem(last=False)


def brief(reader: StoreReader, record: MissionRecord) -> MissionBrief:
    """Return what a mission was created with."""
    row = reader.execute("SELECT brief FROM mission_briefs WHERE mission = ?", (record.number,)).fetchone()
    return brief_in(packing.unpack(row["brief"]))

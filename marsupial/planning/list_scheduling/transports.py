"""Carrying a rover: one transport, or a chain of them, added to a timeline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from marsupial.planning.list_scheduling.timeline import Timeline


@dataclass(frozen=True, slots=True, kw_only=True)
class Transport:
    """One stage of a rover's journey: aboard `carrier` from a meeting to another, then by itself to a third."""

    carrier: str
    pickup: str | None  # None where it is aboard from the start
    set_down: str
    then_to: str


def transport(timeline: Timeline, rover: str, stage: Transport) -> bool:
    """Add a transport; return False if a robot has no path (the timeline then ends in the middle of it)."""
    if stage.pickup is not None:
        if not (timeline.can_drive(stage.carrier, stage.pickup) and timeline.can_drive(rover, stage.pickup)):
            return False
        board(timeline, rover, stage.carrier, stage.pickup)
    if not timeline.can_drive(stage.carrier, stage.set_down):
        return False
    timeline.undock(rover, stage.set_down)
    if not timeline.can_drive(rover, stage.then_to):
        return False
    timeline.move(rover, stage.then_to)
    return True


def board(timeline: Timeline, rover: str, carrier: str, meeting: str) -> None:
    """Dock `rover`; a full carrier first sets down its first rover there."""
    if timeline.is_full(carrier):
        timeline.undock(timeline.cargo[carrier][0], meeting)
    timeline.dock(rover, carrier, meeting)


def follow(timeline: Timeline, rover: str, meeting: int, transports: Mapping[int, Transport]) -> bool:
    """Add the transports that bring `rover` to a meeting; return False if one of them is not possible."""
    names = timeline.situation.meetings
    # From the last transport back to the one that begins where the rover is.
    chain: list[Transport] = []
    at = meeting
    while at in transports:
        chain.append(transports[at])
        pickup = chain[-1].pickup
        if pickup is None:
            break
        at = names.index(pickup)
    if not all(transport(timeline, rover, stage) for stage in reversed(chain)):
        return False
    if not timeline.can_drive(rover, names[meeting]):
        return False
    timeline.move(rover, names[meeting])
    return True

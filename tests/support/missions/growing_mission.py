"""The synthetic mission on a map that grows beyond its frame twice, and changes in between."""

from support.missions.synthetic_mission import synthetic_mission

from marsupial.model import Cell, Changed, FrameGrown, FrameShift, MissionEvent, MissionStarted
from marsupial.model.frames import moved_event

EVENTS = synthetic_mission()
START = EVENTS[0]
assert isinstance(START, MissionStarted)
SHIFT = FrameShift(Cell(3, 2), START.width, START.width + 7, START.height + 2)
MORE = FrameShift(Cell(0, 5), SHIFT.width, SHIFT.width, SHIFT.height + 5)


def growing_mission(at: int = 9, later: int = 15) -> tuple[MissionEvent, ...]:
    """Return the mission with a frame that grows twice, and known cells that change in between."""
    first, second, third = EVENTS[:at], EVENTS[at:later], EVENTS[later:]
    t_ms = second[0].t_ms
    change = Changed(t_ms=t_ms, robot="carrier1", runs=(20 * SHIFT.width + 30, 3, 0, 22 * SHIFT.width + 12, 2, 255))
    return (
        *first,
        FrameGrown(t_ms=t_ms, width=SHIFT.width, height=SHIFT.height, origin_m=(-1.0, -2.0, 0.0), shift=SHIFT.by),
        change,
        *(moved_event(event, SHIFT) for event in second),
        FrameGrown(t_ms=third[0].t_ms, width=MORE.width, height=MORE.height, origin_m=(-1.0, -3.0, 0.0), shift=MORE.by),
        *(moved_event(moved_event(event, SHIFT), MORE) for event in third),
    )

"""Rewrites the events of a mission whose map grew, as if the map had had its final frame from the start.

When a frame grows to the left or downwards, all cell coordinates change. Playback and exports read the rewritten events
and so deal with one frame only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from marsupial.maps.survey import moved_meeting
from marsupial.model import mission as log
from marsupial.model.frames import FrameShift
from marsupial.model.runs import run_table


def in_last_frame(events: Sequence[log.MissionEvent]) -> tuple[log.MissionEvent, ...]:
    """Return the events with all cells in the last frame, and without `FrameGrown`."""
    mission = events[0]
    assert isinstance(mission, log.MissionStarted)
    width, origin_m = mission.width, mission.origin_m
    shifts: list[FrameShift] = []
    for event in events:
        if isinstance(event, log.FrameGrown):
            shifts.append(FrameShift(event.shift, width, event.width, event.height))
            width, origin_m = event.width, event.origin_m
    # from the last event to the first, since an event is moved by all growth after it
    later: FrameShift | None = None  # all shifts after the current event, combined
    found: list[log.MissionEvent] = []
    for event in reversed(events):
        if isinstance(event, log.FrameGrown):
            shift = shifts.pop()
            later = shift if later is None else shift.then(later)
        else:
            found.append(event if later is None else moved_event(event, later))
    started = found[-1]
    assert isinstance(started, log.MissionStarted)
    found[-1] = replace(started, origin_m=origin_m)
    return tuple(reversed(found))


def moved_event(event: log.MissionEvent, shift: FrameShift) -> log.MissionEvent:
    """Return an event with its cells in a frame that has grown."""
    match event:
        case log.MissionStarted():
            robots = tuple(replace(r, cell=None if r.cell is None else shift.cell(r.cell)) for r in event.robots)
            return replace(event, width=shift.width, height=shift.height, robots=robots)
        case log.Revealed() | log.Changed():
            return replace(event, runs=moved_runs(event.runs, shift))
        case log.DriveStarted() | log.DriveEnded():
            return replace(event, cell=shift.cell(event.cell))
        case log.Planned():
            return moved_plan(event, shift)
        case log.ActionStarted():
            return replace(event, action=shift.action(event.action), cell=shift.cell(event.cell))
        case log.ActionEnded():
            return replace(event, action=shift.action(event.action))
        case log.MissionEnded():
            return replace(event, remaining=tuple(replace(r, cell=shift.cell(r.cell)) for r in event.remaining))
    return event


def moved_plan(plan: log.Planned, shift: FrameShift) -> log.Planned:
    """Return a plan with its cells and place names in a frame that has grown."""
    return replace(
        plan,
        targets=tuple(replace(t, name=shift.place(t.name), cell=shift.cell(t.cell)) for t in plan.targets),
        meetings=tuple(moved_meeting(point, shift) for point in plan.meetings),
        actions=tuple(map(shift.action, plan.actions)),
    )


def moved_runs(runs: Sequence[int], shift: FrameShift) -> tuple[int, ...]:
    """Return runs (start, length, code) in a frame that has grown; a run over several rows is split."""
    table = run_table(runs)
    starts, ends, width = table[:, 0], table[:, 0] + table[:, 1], shift.width_before
    # an old row is a contiguous piece of a new row, so split each run at the ends of old rows
    first = starts // width
    rows = (ends - 1) // width - first + 1
    of = np.repeat(np.arange(len(table)), rows)
    row = first[of] + np.arange(len(of)) - np.repeat(np.cumsum(rows) - rows, rows)
    begin, end = np.maximum(starts[of], row * width), np.minimum(ends[of], (row + 1) * width)
    pieces = np.stack((shift.indices(begin), end - begin, table[of, 2]), axis=1)
    return tuple(pieces.ravel().tolist())

"""Growth of the map's frame: new indices for cells.

A frame grows by whole rows and columns on any side, while the lattice of cells stays where it is in the world. Cells
then have new coordinates. Targets, meeting points and charging places are named after their cells in the first frame
(`Grid.name_of`), and so keep their names.

Playback and exports read the events of a mission as if its map had had the final frame from the start
(`in_last_frame`), and so handle one frame only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from marsupial.model import mission as log
from marsupial.model.grid import Cell
from marsupial.model.runs import run_table

S = TypeVar("S", bound=np.generic)
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class FrameShift:
    """The change from one frame to a larger one that contains it."""

    by: Cell  # columns and rows added on the left and below; neither is negative
    width_before: int
    width: int  # of the new frame
    height: int

    def cell(self, cell: Cell) -> Cell:
        """Return a cell's coordinates in the new frame."""
        return Cell(cell.x + self.by.x, cell.y + self.by.y)

    def cells(self, cells: Mapping[str, Cell]) -> dict[str, Cell]:
        """Return each cell's coordinates in the new frame."""
        return {key: self.cell(cell) for key, cell in cells.items()}

    def indices(self, indices: Indices) -> Indices:
        """Return row-major indices in the new frame."""
        x, y = indices % self.width_before + self.by.x, indices // self.width_before + self.by.y
        return y * self.width + x

    def index(self, index: int) -> int:
        """Return one row-major index in the new frame."""
        return int(self.indices(np.array(index)))

    def laid_out(self, cells: npt.NDArray[S], fill: int) -> npt.NDArray[S]:
        """Return an array (height, width) of the old frame in the new one; new cells are `fill`."""
        larger = np.full((self.height, self.width), fill, dtype=cells.dtype)
        larger[self.by.y : self.by.y + cells.shape[0], self.by.x : self.by.x + cells.shape[1]] = cells
        return larger

    def meeting(self, point: log.MapMeeting) -> log.MapMeeting:
        """Return a meeting point with its cells in the new frame."""
        return replace(point, carrier_cell=self.cell(point.carrier_cell), rover_cell=self.cell(point.rover_cell))

    def then(self, later: FrameShift) -> FrameShift:
        """Return this shift and a later one combined."""
        return FrameShift(
            Cell(self.by.x + later.by.x, self.by.y + later.by.y), self.width_before, later.width, later.height
        )


def in_last_frame(events: Sequence[log.MissionEvent]) -> tuple[log.MissionEvent, ...]:
    """Return the events with all cells in the last frame, and without `FrameGrown`."""
    mission = log.started(events)
    width, origin_m = mission.width, mission.origin_m
    shifts: list[FrameShift] = []
    for event in events:
        if isinstance(event, log.FrameGrown):
            shifts.append(FrameShift(event.shift, width, event.width, event.height))
            width, origin_m = event.width, event.origin_m
    # from the last event to the first, since all growth after an event shifts its cells
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
            chargers = tuple(map(shift.cell, event.chargers))
            return replace(event, width=shift.width, height=shift.height, robots=robots, chargers=chargers)
        case log.Revealed() | log.Changed():
            return replace(event, runs=moved_runs(event.runs, shift))
        case log.ContactLost():
            return replace(event, cell=shift.cell(event.cell), targets=tuple(map(shift.cell, event.targets)))
        case log.DriveStarted() | log.DriveEnded() | log.ActionStarted():
            return replace(event, cell=shift.cell(event.cell))
        case log.Planned():
            return moved_plan(event, shift)
        case log.MissionEnded():
            return replace(event, remaining=tuple(replace(r, cell=shift.cell(r.cell)) for r in event.remaining))
    return event


def moved_plan(plan: log.Planned, shift: FrameShift) -> log.Planned:
    """Return a plan with its cells in a frame that has grown."""
    targets = tuple(replace(target, cell=shift.cell(target.cell)) for target in plan.targets)
    guess = None if plan.guess is None else replace(plan.guess, corner=shift.cell(plan.guess.corner))
    return replace(plan, targets=targets, meetings=tuple(map(shift.meeting, plan.meetings)), guess=guess)


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

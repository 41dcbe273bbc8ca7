"""Apply reports to the map and the team of a mission.

The server applies every report before it checks the next one (`state`); the mission's process does before it replans
(`world`). Both use these classes, so that they can't draw different conclusions from the same reports.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from marsupial.model.frames import FrameShift
from marsupial.model.grid import Cell, CellArray
from marsupial.model.mission import ActionEnd
from marsupial.model.missionframe import MissionFrame, embedded
from marsupial.model.plan import ActionName
from marsupial.model.robots import RobotType
from marsupial.model.runs import cells_in, drawn
from marsupial.model.seats import has_place
from marsupial.model.team import Whereabouts
from marsupial_service.missions.values import MissionReport


class MapChange(NamedTuple):
    """Cells (row-major indices) with their old and new codes; `robot` saw them (None: the reporter)."""

    robot: str | None
    indices: npt.NDArray[np.int64]
    before: npt.NDArray[np.uint8]
    codes: npt.NDArray[np.uint8]


class ReportedMap:
    """The known map: its cells, shape (height, width), in a frame that grows to contain that of every report.

    With a `margin`, the frame has this many more unknown cells on each side.
    """

    def __init__(self, cells: CellArray, frame: MissionFrame, margin: int = 0) -> None:
        self.first_frame, self._margin = frame, margin
        self.frame = frame.widened(margin)
        self.cells = embedded(cells, frame, self.frame)

    def frame_with(self, report: MissionReport) -> MissionFrame:
        """Return the frame after a report."""
        return self.frame if report.frame is None else self.frame.grown(report.frame.widened(self._margin))

    def grow(self, report: MissionReport) -> FrameShift | None:
        """Grow the frame to contain that of a report; return the shift of its cells, or None if it didn't grow."""
        before, self.frame = self.frame, self.frame_with(report)
        if before == self.frame:
            return None
        self.cells = embedded(self.cells, before, self.frame)
        return before.shift_to(self.frame)

    def draw(self, report: MissionReport) -> list[MapChange]:
        """Draw the cells of a report, whose frame the map already contains; return the changes."""
        of = report.frame or self.first_frame
        changes = []
        for seen in report.revealed:
            indices, codes = cells_in(seen.runs)
            if of != self.frame:
                indices = of.shift_to(self.frame).indices(indices)
            changes.append(self._set(seen.robot, indices, codes))
        if report.map is not None:
            cells = drawn(report.map.runs, (of.height, of.width))
            changes.append(self.redraw(embedded(cells, of, self.frame)))
        return changes

    def redraw(self, cells: CellArray) -> MapChange:
        """Draw a whole map (height, width)."""
        flat = cells.ravel()
        indices = np.flatnonzero(flat != self.cells.ravel())
        return self._set(None, indices, flat[indices])

    def _set(self, name: str | None, indices: npt.NDArray[np.int64], codes: npt.NDArray[np.uint8]) -> MapChange:
        flat = self.cells.reshape(-1)
        before = flat[indices]
        flat[indices] = codes
        return MapChange(name, indices, before, codes)


@dataclass(slots=True, kw_only=True)
class RobotCommand:
    """A command that was sent and has not ended."""

    id: int
    name: str
    robot: str
    carrier: str | None = None
    route: tuple[Cell, ...] = ()  # of a drive
    cell: Cell | None = None  # where the rover docks or is set down
    passed: int = 0  # index in the route of the robot's current or next cell
    stopped: bool = False
    halted: bool = False  # stopped because of a pause
    clear: bool = True  # whether the map showed room on all its cells when it was sent

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots that take part, in the order of their names."""
        return (self.robot,) if self.carrier is None else tuple(sorted((self.robot, self.carrier)))


P = TypeVar("P")


@dataclass(slots=True)
class ReportedRobot(Generic[P]):
    """A robot: where it is, and whether it has failed for good."""

    where: Whereabouts[P]
    lost: bool = False
    lost_with: str | None = None  # the carrier with which it was lost


R = TypeVar("R", bound=ReportedRobot)


class ReportedTeam(Generic[R]):
    """The robots, and the commands that have not ended."""

    def __init__(self, robots: Mapping[str, R], kinds: Mapping[str, RobotType]) -> None:
        self.robots = dict(robots)
        self._kinds = kinds  # of the robots, by name
        self.commands: dict[int, RobotCommand] = {}

    def begin(self, command: RobotCommand, at: object) -> None:
        """Add a command; `at` is the place of a docking or undocking."""
        self.commands[command.id] = command
        if command.carrier is not None:
            rover = self.robots[command.robot]
            rover.where = rover.where.begun(ActionName(command.name), at, command.carrier)

    def end(self, number: int, end: ActionEnd) -> RobotCommand | None:
        """End a command and return it; None if it had already ended."""
        command = self.commands.pop(number, None)
        if command is not None and command.carrier is not None:
            rover, name = self.robots[command.robot], ActionName(command.name)
            if end is ActionEnd.DONE and rover.where.at is not None:
                # begun again: a client may finish this command after a later one has failed
                rover.where = rover.where.begun(name, rover.where.at, command.carrier)
            rover.where = rover.where.ended(name, end)
        return command

    def mark_lost(self, name: str) -> tuple[str, ...]:
        """Mark a robot and the rovers aboard it as lost; return the newly lost robots, this robot first."""
        riders = (rover for rover, robot in self.robots.items() if robot.where.aboard == name)
        newly_lost = tuple(one for one in (name, *riders) if not self.robots[one].lost)
        for one in newly_lost:
            self.robots[one].lost, self.robots[one].lost_with = True, None if one == name else name
        return newly_lost

    def mark_returned(self, name: str) -> tuple[str, ...]:
        """Mark a lost robot as able to act, with the rovers lost aboard it; return them, this robot first.

        A rover aboard a lost carrier stays lost, and one whose place aboard was taken.
        """
        carrier = self.robots[name].where.aboard
        seated = carrier is None or has_place(self._kinds[carrier], self._kinds[name].name, self._aboard(carrier))
        if not self.robots[name].lost or not seated or (carrier is not None and self.robots[carrier].lost):
            return ()
        self.robots[name].lost = False
        aboard = ((rover, robot) for rover, robot in self.robots.items() if robot.where.aboard == name)
        riders = [rover for rover, robot in aboard if robot.lost and robot.lost_with == name]
        return (name, *(one for rider in riders for one in self.mark_returned(rider)))

    def _aboard(self, carrier: str) -> list[str]:
        """Return the types of rovers with a place; an undocking may fail, so its rover keeps its place."""
        aboard = [name for name, robot in self.robots.items() if robot.where.carrier == carrier and not robot.lost]
        aboard += [one.robot for one in self.commands.values() if one.name == "undock" and one.carrier == carrier]
        return [self._kinds[name].name for name in aboard]

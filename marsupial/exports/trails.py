"""What robots do in a mission: their drives, where rovers were set down and picked up, who is busy with what when."""

from bisect import bisect_right
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby, pairwise

import numpy as np
import numpy.typing as npt

from marsupial.mission.playback import Playback
from marsupial.mission.state import Leg, RobotView, views
from marsupial.model import ActionEnd, ActionEnded, ActionName, ActionStarted, Cell

Points = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Drive:
    """The cells that a robot passed on one drive, (n, 2), and their times, (n,) in ms."""

    cells: Points
    times_ms: npt.NDArray[np.int64]

    def upto(self, t_ms: int) -> Points:
        """Return the part driven by `t_ms`, (m, 2): the cells passed, and the point on the way to the next one."""
        count = int(np.searchsorted(self.times_ms, t_ms, side="right"))
        if count in (0, len(self.cells)) or self.times_ms[count - 1] == t_ms:
            return self.cells[:count]
        here = [np.interp(t_ms, self.times_ms, self.cells[:, axis]) for axis in (0, 1)]
        return np.vstack([self.cells[:count], here])


@dataclass(frozen=True, slots=True)
class Handover:
    """A rover set down (undock) or picked up (dock) at `cell`, done at `t_ms`."""

    t_ms: int
    name: ActionName
    cell: Cell


def drives(playback: Playback) -> dict[str, list[Drive]]:
    """Return all drives of each robot in order of time, each up to the point where the robot stopped."""
    found: dict[str, list[Drive]] = {name: [] for name in playback.timeline}
    legs: dict[str, Leg | None] = {}
    for number, tracks in playback.moments:
        t_ms = playback.events[number].t_ms
        for name, track in tracks.items():
            leg, before = track.where.at, legs.get(name)
            # A leg is shared by all moments of a drive: another object is another drive, or a stop.
            if leg is not before:
                if before is not None:
                    _add(found[name], before, t_ms)
                legs[name] = leg
    for name, leg in legs.items():
        # The leg of a lost robot extends to its planned end, but how far the robot came is unknown.
        if leg is not None and not playback.moments[-1][1][name].lost:
            _add(found[name], leg, playback.end_ms)
    return found


def _add(drives: list[Drive], leg: Leg, end_ms: int) -> None:
    passed = bisect_right(leg.times_ms, end_ms)
    if len(leg.cells) > 1 and passed > 1:
        cells = np.array(leg.cells[:passed], dtype=np.float64)
        drives.append(Drive(cells, np.array(leg.times_ms[:passed], dtype=np.int64)))


def trail(drives: list[Drive], t_ms: int) -> Points:
    """Return the drives up to `t_ms` as one line (n, 2), with nan after each, where matplotlib lifts the pen."""
    gap = np.full((1, 2), np.nan)
    parts = [part for drive in drives if len(upto := drive.upto(t_ms)) > 1 for part in (upto, gap)]
    return np.concatenate(parts) if parts else np.empty((0, 2))


def handovers(playback: Playback) -> list[Handover]:
    """Return the dockings and undockings that were carried out, in order of time."""
    cells: dict[str, Cell] = {}
    found = []
    for event in playback.events:
        if isinstance(event, ActionStarted):
            cells[event.action.robot] = event.cell
        elif isinstance(event, ActionEnded) and event.end is ActionEnd.DONE and event.action.carrier is not None:
            found.append(Handover(event.t_ms, event.action.name, cells[event.action.robot]))
    return found


class Activity(StrEnum):
    """Keys of `Palette.actions` and words of legends; the page has the same words in ``draw/legend.js``."""

    DRIVE = "drive"
    EXPLORE = "explore"
    ABOARD = "aboard"
    DOCK = "dock"
    UNDOCK = "undock"
    WAIT = "wait"


_TEXTS = {Activity.DRIVE: "drives", Activity.EXPLORE: "explores", Activity.WAIT: "waits"}


def activity(robot: RobotView) -> Activity:
    """Return what a robot does; a rover that docks or undocks is not aboard."""
    if robot.action is not None:
        name = robot.action.name
        return Activity.DRIVE if name is ActionName.MOVE else Activity(name)
    return Activity.WAIT if robot.carrier is None else Activity.ABOARD


def activity_text(robot: RobotView) -> str:
    """Return what a robot does as words to follow its name."""
    if robot.lost:
        return "lost"
    does, action = activity(robot), robot.action
    if does is Activity.ABOARD:
        return f"aboard {robot.carrier}"
    if action is None or action.carrier is None:
        return _TEXTS[does]
    if action.robot == robot.name:
        return f"docks on {action.carrier}" if does is Activity.DOCK else f"undocks from {action.carrier}"
    return f"{does}s {action.robot}"


def stretches(playback: Playback) -> dict[str, dict[Activity, list[tuple[float, float]]]]:
    """Return for each robot and activity the start and length (minutes) of every stretch of it."""
    moments: dict[str, list[tuple[int, Activity]]] = {name: [] for name in playback.timeline}
    for number, tracks in playback.moments:
        t_ms = playback.events[number].t_ms
        for robot in views(tracks, t_ms):
            moments[robot.name].append((t_ms, activity(robot)))
    found: dict[str, dict[Activity, list[tuple[float, float]]]] = {name: {} for name in moments}
    for name, times in moments.items():
        changes = [next(alike) for _, alike in groupby(times, key=lambda moment: moment[1])]
        for (start_ms, does), (end_ms, _) in pairwise([*changes, (playback.end_ms, Activity.WAIT)]):
            if end_ms > start_ms:
                found[name].setdefault(does, []).append((start_ms / 60_000, (end_ms - start_ms) / 60_000))
    return found

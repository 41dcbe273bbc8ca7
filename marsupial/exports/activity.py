"""What a robot is doing: the words and colours of all pictures of a mission, and when each robot does what."""

from __future__ import annotations

from enum import StrEnum
from itertools import pairwise

from marsupial.mission.playback import Playback
from marsupial.mission.state import RobotView, views
from marsupial.model.plan import ActionName


class Activity(StrEnum):
    """Keys of `Palette.actions` and words of legends; the page has the same words in ``legend.js``."""

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
    found: dict[str, dict[Activity, list[tuple[float, float]]]] = {}
    for name, changes in _changes(playback).items():
        own = found.setdefault(name, {})
        for (start_ms, does), (end_ms, _) in pairwise([*changes, (playback.end_ms, Activity.WAIT)]):
            if end_ms > start_ms:
                own.setdefault(does, []).append((start_ms / 60_000, (end_ms - start_ms) / 60_000))
    return found


def _changes(playback: Playback) -> dict[str, list[tuple[int, Activity]]]:
    """Return for each robot the moments (ms) at which its activity changes, and to what."""
    found: dict[str, list[tuple[int, Activity]]] = {name: [] for name in playback.timeline}
    for number, tracks in playback.moments:
        t_ms = playback.events[number].t_ms
        for robot in views(tracks, t_ms):
            changes, does = found[robot.name], activity(robot)
            if not changes or changes[-1][1] is not does:
                changes.append((t_ms, does))
    return found

"""What a robot is doing, in the words and colours that every picture of a mission has for it."""

from __future__ import annotations

from enum import StrEnum

from marsupial.mission.state import RobotView
from marsupial.model.plan import ActionName


class Activity(StrEnum):
    """Keys of `Palette.actions`, and what keys of pictures call them; the page has the same words in ``legend.js``."""

    DRIVE = "drive"
    EXPLORE = "explore"
    ABOARD = "aboard"
    DOCK = "dock"
    UNDOCK = "undock"
    WAIT = "wait"


_OF_ACTION = {
    ActionName.MOVE: Activity.DRIVE,
    ActionName.EXPLORE: Activity.EXPLORE,
    ActionName.DOCK: Activity.DOCK,
    ActionName.UNDOCK: Activity.UNDOCK,
}

_TEXTS = {Activity.DRIVE: "drives", Activity.EXPLORE: "explores", Activity.WAIT: "waits"}


def activity(robot: RobotView) -> Activity:
    """Return what a robot does; a rover that docks or undocks is not aboard."""
    if robot.action is not None:
        return _OF_ACTION[robot.action.name]
    return Activity.WAIT if robot.carrier is None else Activity.ABOARD


def activity_text(robot: RobotView) -> str:
    """Return that as words to follow a robot's name."""
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

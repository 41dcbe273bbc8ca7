"""What a robot is doing, in the words and colours that every picture of a mission has for it."""

from __future__ import annotations

from enum import StrEnum

from marsupial.mission.state import RobotView
from marsupial.model.plan import ActionName


class Activity(StrEnum):
    """Keys of `Palette.actions`."""

    DRIVE = "drive"
    EXPLORE = "explore"
    RIDE = "ride"
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
    """Return what a robot does; being aboard is riding unless it docks or undocks."""
    if robot.action is not None:
        return _OF_ACTION[robot.action.name]
    return Activity.WAIT if robot.carrier is None else Activity.RIDE


def activity_text(robot: RobotView) -> str:
    """Return that as words to follow a robot's name."""
    if robot.lost:
        return "lost"
    does, action = activity(robot), robot.action
    if does is Activity.RIDE:
        return f"aboard {robot.carrier}"
    if action is None or action.carrier is None:
        return _TEXTS[does]
    if action.robot == robot.name:
        return f"docks on {action.carrier}" if does is Activity.DOCK else f"leaves {action.carrier}"
    return f"picks up {action.robot}" if does is Activity.DOCK else f"sets down {action.robot}"

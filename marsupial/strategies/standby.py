"""What robots do that no target is left for: they go where something may turn up, or where they can be picked up."""

from __future__ import annotations

from collections.abc import Iterable

from marsupial.model.robots import Role
from marsupial.strategies.outlook import Outlook


def stand_by(outlook: Outlook, robots: Iterable[str]) -> None:
    """Send robots without a target to where others explore, so that they are near what turns up there.

    They are assigned to the targets once more, as often as it takes. A carrier goes as far as it can itself: where it
    would set a rover down, it waits. A rover that gets to no target waits at the nearest meeting.
    """
    waiting = list(robots)
    while sent := outlook.assign([outlook.options(robot) for robot in waiting]):
        for option, target in sent:
            outlook.approach(option, target)
            waiting.remove(option.robot)
    for robot in waiting:
        if outlook.situation.type_of(robot).role is Role.ROVER:
            outlook.wait_at_meeting(robot)

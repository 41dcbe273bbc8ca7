"""The mission's goal besides exploring: rovers aboard, carriers at home; which parts are met, in words."""

from collections.abc import Iterable, Mapping, Set

from marsupial.model import Cell, Goal, RobotReport, RobotType, Role


def homes_of(robots: Iterable[RobotReport], kinds: Mapping[str, RobotType]) -> dict[str, Cell]:
    """Return the cell of each carrier, by name."""
    return {r.name: r.cell for r in robots if r.cell is not None and kinds[r.type].role is Role.CARRIER}


def achieved(goal: Goal) -> str:
    """Return the part of a complete mission's reason that names the goal besides exploring."""
    if goal.return_home:
        return ", the team is home"
    return ", all rovers are aboard" if goal.recover_rovers else ""


def unmet(
    goal: Goal,
    robots: Iterable[RobotReport],
    kinds: Mapping[str, RobotType],
    homes: Mapping[str, Cell],
    under_way: Set[str] = frozenset(),
) -> list[str]:
    """Return in words which parts of the goal are not met; robots `under_way` have not arrived yet."""
    found = []
    for robot in robots:
        if robot.lost:
            continue
        if kinds[robot.type].role is Role.ROVER:
            if goal.aboard and (robot.carrier is None or robot.name in under_way):
                found.append(f"{robot.name} is not aboard")
        elif (
            goal.return_home
            and robot.name in homes
            and (robot.name in under_way or robot.cell not in (homes[robot.name], None))
        ):
            found.append(f"{robot.name} is not home")
    return found

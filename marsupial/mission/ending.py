"""How a mission ends: what its status means, and what its reason names.

=============  =========================================================================================================
``complete``   No target is left that the team could explore, lost robots included, and the goal is met: where it asks
               for rovers aboard, all are, and where it asks for the way home, all carriers are there too. Or enough is
               explored (`MissionLimits.coverage`), and the goal is met.
``stalled``    Something is left that no robot can do now: a target, or a robot that can't get where the goal wants it,
               as nothing can fetch it, or as it is lost.
``time_limit`` The time limit has come, or the team was called back before it.
``cancelled``  The operator ended the mission.
``failed``     Every robot is lost, or the strategy made an invalid plan.
=============  =========================================================================================================

A mission that would end ``stalled``, or with all robots lost, waits while the world says that a lost robot is expected
to return (`RobotReport.returns`): the robot may then be fetched, or do what is left. Whatever the status, the reason
names the robots that are lost or out of contact, and where they are (`absent`).
"""

from collections.abc import Iterable, Mapping, Set

from marsupial.maps.survey import Surveyor
from marsupial.maps.territory import Territory
from marsupial.mission.belief.belief import Belief
from marsupial.model import Cell, Goal, Grid, RobotReport, RobotType, Role, Status
from marsupial.model.scenario import ReturnGoal

MissionEnding = tuple[Status, str]
"""How a mission ends, and why."""


def explored(goal: Goal, reason: str, left: Iterable[str], needed: Iterable[str]) -> MissionEnding:
    """Return how a mission ends if robots that can act have explored all they can, as `reason` says.

    `left` says which parts of the goal are not met (`unmet`), and `needed` are the lost robots that could explore more.
    """
    names = ", ".join(needed)
    undone = [*left, *([f"only {names} could explore the rest"] if names else ())]
    if undone:
        return Status.STALLED, f"{reason}, but {', '.join(undone)}"
    return Status.COMPLETE, reason + achieved(goal)


def needed_lost(belief: Belief, goal: Goal) -> list[str]:
    """Return the names of the lost robots that could explore what no other robot can."""
    robots = belief.robots()
    if not any(robot.lost for robot in robots):
        return []
    territory = Territory(belief.grid, tuple(belief.kinds.values()))
    left = Surveyor(territory, {}, goal).left_to_lost(robots)
    return sorted({name for _, names in left for name in names})


def achieved(goal: Goal) -> str:
    """Return the part of a complete mission's reason that names the goal besides exploring."""
    if goal.return_home:
        return ", the team is home"
    return ", all rovers are aboard" if goal.recover_rovers else ""


def unmet(
    goal: ReturnGoal,
    robots: Iterable[RobotReport],
    kinds: Mapping[str, RobotType],
    homes: Mapping[str, Cell],
    under_way: Set[str] = frozenset(),
) -> list[str]:
    """Return in words which parts of the goal these robots don't meet; those `under_way` have not arrived yet."""
    found = []
    for robot in robots:
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


def absent(robots: Iterable[RobotReport], grid: Grid) -> list[str]:
    """Return in words which robots are lost or out of contact, and where they are (expected), in metres."""
    groups: dict[str, list[str]] = {}
    for robot in robots:
        if robot.lost:
            what = "lost, expected back" if robot.returns else "lost"
        elif robot.away is not None:
            what = "out of contact"
        else:
            continue
        groups.setdefault(what, []).append(f"{robot.name} {_place(robot, grid)}")
    return [f"{what}: {', '.join(groups[what])}" for what in sorted(groups)]


def _place(robot: RobotReport, grid: Grid) -> str:
    if robot.cell is None:
        return f"aboard {robot.carrier}"
    x, y = (round(metres, 1) + 0.0 for metres in grid.centre_m(robot.cell))
    return f"at ({x:.1f}, {y:.1f})"

"""The goals of ROS actions for the commands of a mission.

Drives use nav2's own actions; docking and undocking use those of `marsupial_interfaces`, beside this file. Goals set
only fields that every nav2 release since Humble has; the others keep their defaults.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

from marsupial.model.robots import Role
from marsupial_client.mission_documents import Command
from marsupial_ros.messages import final_yaw, path_of, pose_stamped
from marsupial_ros.settings import DriveAction, RobotSettings, Settings
from marsupial_ros.transforms import Point
from marsupial_ros.transport import ActionResult, GoalStatus

DRIVE_TYPES = {
    DriveAction.FOLLOW_PATH: "nav2_msgs/action/FollowPath",
    DriveAction.NAVIGATE_TO_POSE: "nav2_msgs/action/NavigateToPose",
}
DOCK_TYPE = "marsupial_interfaces/action/Dock"
UNDOCK_TYPE = "marsupial_interfaces/action/Undock"


# distance of the points on straight stretches of paths: near enough for controllers, and a long path stays a short
# message; turning points are all kept
SPACING_M = 0.5
# turns by less are rounding
STRAIGHT_RAD = 1e-6


@dataclass(frozen=True, slots=True)
class ActionGoal:
    """A goal: the action's name and type, and the values of its fields."""

    action: str
    type: str
    values: dict[str, Any]


def drive_action(robot: RobotSettings) -> str:
    """Return the name of the action that carries a robot's drives out."""
    return f"{robot.namespace}/{robot.drive.value}"


def handover_actions(rover: RobotSettings) -> tuple[str, str]:
    """Return the names of the actions for docking and undocking a rover."""
    return f"{rover.namespace}/dock", f"{rover.namespace}/undock"


def actions_of(robots: Sequence[RobotSettings]) -> dict[str, str]:
    """Return all actions that goals of a team may be for, and their types."""
    found = {drive_action(robot): DRIVE_TYPES[robot.drive] for robot in robots}
    rovers = [robot for robot in robots if robot.kind.role is Role.ROVER]
    for rover in rovers if len(rovers) < len(robots) else ():
        found |= zip(handover_actions(rover), (DOCK_TYPE, UNDOCK_TYPE), strict=True)
    return found


def drive_goal(settings: Settings, robot: RobotSettings, route_m: Sequence[Point], yaw: float) -> ActionGoal:
    """Return the goal of driving along a route of two points or more."""
    frame = settings.map.frame
    if robot.drive is DriveAction.NAVIGATE_TO_POSE:
        pose = pose_stamped(route_m[-1], final_yaw(route_m, yaw), frame)
        return ActionGoal(drive_action(robot), DRIVE_TYPES[robot.drive], {"pose": pose, "behavior_tree": ""})
    values = {"path": path_of(thinned(route_m), yaw, frame), **asdict(settings.controller)}
    return ActionGoal(drive_action(robot), DRIVE_TYPES[robot.drive], values)


def thinned(route_m: Sequence[Point]) -> list[Point]:
    """Return a route of two points or more with fewer points on its straight stretches."""
    kept = [route_m[0]]
    for (a, b), (_, c) in pairwise(pairwise(route_m)):
        turn = math.remainder(math.atan2(c[1] - b[1], c[0] - b[0]) - math.atan2(b[1] - a[1], b[0] - a[0]), math.tau)
        if abs(turn) > STRAIGHT_RAD or math.dist(kept[-1], c) > SPACING_M:
            kept.append(b)
    return [*kept, route_m[-1]]


def handover_goal(
    settings: Settings, mission: str, command: Command, rover: RobotSettings, point: Point, carrier: Point | None
) -> ActionGoal:
    """Return the goal of a rover's docking or undocking; its carrier stands at `carrier`.

    `point` is where the rover stands to dock, facing the carrier, or is set down, facing away from it.
    """
    docks = command["name"] == "dock"
    a, b = (point, carrier or point) if docks else (carrier or point, point)
    yaw = math.atan2(b[1] - a[1], b[0] - a[0])
    values = {
        "mission": mission,
        "command": command["id"],
        "rover": command["robot"],
        "carrier": command["carrier"],
        "pose": pose_stamped(point, yaw, settings.map.frame),
    }
    dock, undock = handover_actions(rover)
    return ActionGoal(dock, DOCK_TYPE, values) if docks else ActionGoal(undock, UNDOCK_TYPE, values)


def failure_of(goal: ActionGoal, end: ActionResult) -> str:
    """Return why a goal was not reached: the action's message, if it has one."""
    word = GoalStatus(end.status).name.lower() if end.status in list(GoalStatus) else f"status {end.status}"
    values = end.values if isinstance(end.values, dict) else {}
    text = values.get("error_msg") or values.get("message") or (end.values if isinstance(end.values, str) else "")
    code = values.get("error_code")
    details = [str(text)] if text else []
    details += [f"error {code}"] if code else []
    return f"{goal.action}: {word}" + (f" ({', '.join(details)})" if details else "")


def replaced(end: ActionResult) -> bool | None:
    """Return whether another goal has replaced one; None if its action gives no reason at all."""
    if end.status != GoalStatus.ABORTED or not isinstance(end.values, dict):
        return False
    if end.values.get("error_code") or end.values.get("error_msg") or end.values.get("message"):
        return False
    return True if "error_code" in end.values else None


def succeeded(end: ActionResult) -> bool:
    """Return whether a goal was reached; actions of `marsupial_interfaces` can succeed with `success` false."""
    return end.status == GoalStatus.SUCCEEDED and not (
        isinstance(end.values, dict) and end.values.get("success") is False
    )

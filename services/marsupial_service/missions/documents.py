"""What the events of a mission hold, as JSON in one line."""

from __future__ import annotations

import json
from dataclasses import asdict

from marsupial.model.grid import Grid
from marsupial.model.mission import FrameGrown, Status
from marsupial.model.strategy import Decision
from marsupial_service.entries.documents import action_document, line, plan_of, rounded
from marsupial_service.missions.reported import RobotCommand
from marsupial_service.missions.values import Control, planning_of
from marsupial_service.moments import timestamp


def command(order: RobotCommand, revision: int, place: str | None, grid: Grid, *, stop: bool) -> dict[str, object]:
    """Return a command; positions are given as cells and in metres of the map frame."""
    head: dict[str, object] = {"id": order.id, "robot": order.robot, "name": "stop" if stop else order.name}
    head["revision"] = revision
    if stop:
        return head
    if order.carrier is not None:
        head["carrier"] = order.carrier
    head["place"] = place
    if order.route:
        head["route"] = [list(cell) for cell in order.route]
        head["route_m"] = [rounded(grid.centre_m(cell)) for cell in order.route]
    if order.name == "undock" and order.cell is not None:
        head |= {"cell": list(order.cell), "point_m": rounded(grid.centre_m(order.cell))}
    return head


def frame(grown: FrameGrown, resolution_m: float) -> str:
    """Return the frame that all cells are of from now on; what was cell (x, y) is that plus `shift`."""
    size = {"width": grown.width, "height": grown.height, "resolution_m": resolution_m}
    return line({**size, "origin_m": list(grown.origin_m), "shift": list(grown.shift), "t_ms": grown.t_ms})


def decision(decision: Decision) -> str:
    """Return a plan as it was decided on (times from then on), and how it was found."""
    actions = [action_document(action) for action in decision.plan.actions]
    return line({**asdict(decision.report), "actions": actions})


def decision_of(text: str) -> Decision:
    """Return the decision whose document this is."""
    fields = json.loads(text)
    return Decision(plan=plan_of(line(fields["actions"])), report=planning_of(fields))


def state(control: Control, t_ms: int) -> str:
    """Return that a mission is paused or goes on."""
    return line({"state": "paused" if control is Control.PAUSE else "running", "t_ms": t_ms})


def waiting(reason: str, t_ms: int) -> str:
    """Return that a mission waits for a map on which its robots can stand, and why, or that it goes on."""
    return line({"state": "waiting", "reason": reason, "t_ms": t_ms} if reason else {"state": "running", "t_ms": t_ms})


def quota(reason: str, room_at_ms: int, t_ms: int) -> str:
    """Return that a mission waits until its owner may plan again, and when that may be, or that it goes on."""
    if not reason:
        return line({"state": "running", "t_ms": t_ms})
    return line({"state": "waiting", "reason": reason, "room_at": timestamp(room_at_ms), "t_ms": t_ms})


def is_waiting(text: str) -> bool:
    """Say whether that is what such a document tells."""
    return bool(json.loads(text)["state"] == "waiting")


def end(status: Status, reason: str, t_ms: int) -> str:
    """Return how a mission ended."""
    return line({"status": status, "reason": reason, "t_ms": t_ms})

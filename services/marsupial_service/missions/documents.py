"""What events of a mission hold, where that takes more than naming the fields of their models (`schemas.events`)."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from marsupial.model.grid import Grid
from marsupial.model.plan import ActionName
from marsupial.model.planning import Outcome
from marsupial.model.robots import Role
from marsupial.model.strategy import Decision, PlanningReport
from marsupial_service.entries.documents import plan_of, rounded
from marsupial_service.missions.reported import RobotCommand
from marsupial_service.missions.values import MissionBrief, RobotSimulation
from marsupial_service.moments import timestamp
from marsupial_service.schemas.answers import ActionAnswer, SimulationAnswer
from marsupial_service.schemas.events import (
    Command,
    DecisionData,
    DockCommand,
    DriveCommand,
    QuotaData,
    StopCommand,
    UndockCommand,
)


def simulation(brief: MissionBrief, simulation: RobotSimulation) -> SimulationAnswer:
    """Return how the robots of a mission are simulated."""
    roles = {kind.name: kind.role for kind in brief.kinds}
    count = Counter(roles[robot.type] for robot in brief.robots)
    return SimulationAnswer(
        speed=simulation.speed,
        seed=brief.seed,
        carriers=count[Role.CARRIER],
        rovers=count[Role.ROVER],
        warnings=list(simulation.warnings),
    )


def command(order: RobotCommand, revision: int, place: str | None, grid: Grid, *, stop: bool) -> Command:
    """Return a command; positions are given as cells and in metres of the map frame."""
    said: dict[str, Any] = {"id": order.id, "robot": order.robot, "revision": revision, "place": place}
    if stop:
        del said["place"]
        return StopCommand(name="stop", **said)
    if order.carrier is None:
        centres = [rounded(grid.centre_m(cell)) for cell in order.route]
        return DriveCommand(name="drive", route=list(map(list, order.route)), route_m=centres, **said)
    said["carrier"] = order.carrier
    if order.name == ActionName.DOCK:
        return DockCommand(name="dock", **said)
    assert order.cell is not None
    return UndockCommand(name="undock", cell=list(order.cell), point_m=rounded(grid.centre_m(order.cell)), **said)


def decision(decision: Decision) -> DecisionData:
    """Return a plan as it was decided on (times from then on), and how it was found."""
    actions = [ActionAnswer.of(action) for action in decision.plan.actions]
    return DecisionData(**asdict(decision.report), actions=actions)


def decision_of(text: str) -> Decision:
    """Return the decision whose document this is."""
    fields = json.loads(text)
    return Decision(plan=plan_of(fields["actions"]), report=planning_of(fields))


def planning_of(document: Mapping[str, Any]) -> PlanningReport:
    """Return how a decision was found, from its document."""
    report = {key: value for key, value in document.items() if key != "actions"}
    return PlanningReport(**{**report, "outcome": Outcome(document["outcome"])})


def quota(reason: str, room_at_ms: int, t_ms: int) -> QuotaData:
    """Return that a mission waits until its owner may plan again, and when that may be, or that it goes on."""
    if not reason:
        return QuotaData(state="running", t_ms=t_ms)
    return QuotaData(state="waiting", reason=reason, room_at=timestamp(room_at_ms), t_ms=t_ms)

"""The process of a mission: the closed loop in a world made of reports.

A map that may grow has a margin of one unknown cell in the loop, so that ground at its edge is a frontier. What leaves
this process or comes back to it has the cells of the map without margin.

After each input the process sends back all results of it in one batch. A process that replaces a dead one gets the
inputs with its predecessor's decisions, and so produces the same batches without planning.
"""

import hashlib
import json
from collections import deque
from dataclasses import asdict, replace
from typing import Any, Literal

from pydantic import TypeAdapter

from marsupial.formats.loglines import LogEncoder
from marsupial.library.first_use import try_mission
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.observer import Observer
from marsupial.model.frames import FrameShift, moved_event
from marsupial.model.grid import Grid
from marsupial.model.mission import ActionStarted, FrameGrown, MissionEnded, MissionEvent, MissionStarted, Planned
from marsupial.model.missionframe import MissionFrame
from marsupial.model.plan import ActionName
from marsupial.model.strategy import Briefing, Decision, Reasons, as_strategy
from marsupial.processes.channel import Channel
from marsupial.strategies.registry import strategy
from marsupial_service.entries.documents import line, plan_of, rounded, text_of
from marsupial_service.missions.encoding import decode_input, encode_input
from marsupial_service.missions.reported import RobotCommand
from marsupial_service.missions.simulated import planning_of, simulated_team
from marsupial_service.missions.values import (
    Control,
    Input,
    MissionBatch,
    MissionReport,
    MissionTask,
    PendingInput,
    PlanningSignal,
    StoredEvent,
    StoredReport,
)
from marsupial_service.missions.world import RemoteWorld
from marsupial_service.schemas.answers import ActionAnswer
from marsupial_service.schemas.base import Answer
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.events import (
    Command,
    CommandsData,
    DecisionData,
    DockCommand,
    DriveCommand,
    FrameData,
    MissionEndData,
    MissionStateData,
    StopCommand,
    UndockCommand,
)

_REASONS = TypeAdapter(Reasons)


def load_missions() -> None:
    """Load the compiled code that missions run; the very first time, compile it."""
    try_mission("temporal", "auto", rovers=True)


def run_mission(task: MissionTask, channel: Channel) -> None:
    """Run a mission; the function of a supervised process."""
    brief, process = task.brief, MissionProcess(task, channel)
    kinds = {kind.name: kind for kind in brief.kinds}
    world = RemoteWorld(brief, process)
    order = MissionOrder(
        goal=brief.goal,
        limits=brief.limits,
        planning_time=brief.planning_time,
        reachable=None if brief.reachable is None else process.inner.laid_out(brief.reachable, fill=False),
        homes=world.homes,
        zones=brief.zones,
        called_back=lambda: world.called_back,
        waits=True,
        plans_on_board=False,
    )
    process.event(brief.started)
    MissionLoop(world, kinds, process, order, process).run(lambda: world.cancelled)
    world.stop_all()
    process.end(world.now_ms)


class MissionProcess(Observer):
    """A mission's end of the channel: sends batches, receives inputs, acts as the strategy and records decisions."""

    def __init__(self, task: MissionTask, channel: Channel) -> None:
        self._task, self._brief = task, task.brief
        brief = task.brief
        self._strategy = strategy(brief.strategy, planner=task.engine, budget=brief.budget)
        self.name = self._strategy.name
        self.replanning = as_strategy(self._strategy).replanning
        self._channel = channel
        self._simulated_team = simulated_team(brief)
        self._next: StoredReport | None = None
        self._encoder = LogEncoder()
        self._events: list[StoredEvent] = []
        self._commands: list[Command] = []
        self._grid = brief.grid
        self._frame = MissionFrame.of(brief.grid)  # of the map without its margin
        self._n = self._t_ms = self._sent = self._revision = 0
        self._counts: dict[str, int] = {}
        self._action: ActionStarted | None = None
        self._ended: MissionEnded | None = None
        self._active: Literal["running", "winding_down"] = "running"  # the state when it neither waits nor is paused
        self._batches: list[MissionBatch] = []
        self._pending: deque[PendingInput] = deque()
        self._decisions = deque(self._next_input().decisions)

    @property
    def inner(self) -> FrameShift:
        """The shift of cells into the map with its margin."""
        return self._frame.shift_to(self._frame.widened(self._brief.margin))

    @property
    def _outer(self) -> FrameShift:
        """The shift of cells back into the map without its margin."""
        return self._frame.widened(self._brief.margin).shift_to(self._frame)

    def event(self, event: MissionEvent) -> None:
        """Log an event. A grown frame is also sent as a separate event, for clients that don't read the log."""
        if self._brief.margin:
            event = self._without_margin(event)
        if isinstance(event, Planned):
            self._revision = event.revision
        elif isinstance(event, ActionStarted):
            self._action = event
        elif isinstance(event, MissionEnded):
            self._ended = event
        elif isinstance(event, FrameGrown):
            self._frame = self._frame.grown_by(event.shift, event.width, event.height)
            self._grid = replace(self._grid, origin_m=event.origin_m)
            self._add_event(EventType.FRAME, FrameData.of(event, resolution_m=self._grid.resolution_m))
        self._add_event(EventType.LOG, self._encoder.line(event))

    def waiting(self, reason: str) -> None:
        """Send an event that the mission waits for a map on which its robots can stand, or that it continues."""
        self._add_state_event("waiting" if reason else self._active, reason or None)

    def decide(self, briefing: Briefing) -> Decision:
        """Return the predecessor's decision if there is one, else make one."""
        if self._decisions:
            # a predecessor's: planning again could give a plan that clients have not seen
            text = self._decisions.popleft()
            fields = json.loads(text)
            reasons = _REASONS.validate_python(fields.get("reasons", {}))
            decision = Decision(plan=plan_of(fields["actions"]), report=planning_of(fields), reasons=reasons)
        else:
            self._send_batches()
            self._channel.send(PlanningSignal.REQUESTED)
            assert self._channel.receive() is PlanningSignal.ALLOWED
            decision = self._strategy.decide(briefing)
            decision = self._redacted(decision)
            self._channel.send(PlanningSignal.DONE)
            actions = [ActionAnswer.of(action) for action in decision.plan.actions]
            reasons = _REASONS.dump_python(decision.reasons, mode="json", exclude_defaults=True)
            text = text_of(DecisionData(**asdict(decision.report), actions=actions, reasons=reasons or None))
        self._add_event(EventType.DECISION, text)
        return decision

    def _redacted(self, decision: Decision) -> Decision:
        """Return a decision that names planners without their command lines."""
        redact, report, reasons = self._task.without_command, decision.report, decision.reasons
        report = replace(report, planner=redact(report.planner), detail=redact(report.detail))
        compared = tuple((redact(maker), price, left_out) for maker, price, left_out in reasons.compared)
        return replace(decision, report=report, reasons=replace(reasons, compared=compared))

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        """Add a command to those sent next."""
        revision, place = self._revision, None
        if self._action is not None and not stop:
            revision, place = self._action.revision, self._action.action.place
        cell = None if order.cell is None else self._outer.cell(order.cell)
        order = replace(order, route=tuple(map(self._outer.cell, order.route)), cell=cell)
        self._commands.append(_command(order, revision, place, self._grid, stop=stop))

    def exchange(self, until_ms: int) -> Input:
        """Send everything pending, with an answer due by `until_ms`, and return the next input when it arrives."""
        self._send_commands(until_ms)
        self._end_batch(over=False)
        answer = self._next_input()
        assert answer.input is not None
        taken: Input = decode_input(answer.input) if isinstance(answer.input, bytes) else answer.input
        self._decisions = deque(answer.decisions)
        if isinstance(taken, MissionReport):
            self._t_ms = max(self._t_ms, taken.t_ms)
            if taken.robot is None:
                self._n = taken.n
            else:
                self._counts[taken.robot] = taken.n
        elif isinstance(taken, Control) and taken not in (Control.CANCEL, Control.NOTHING):
            if self._simulated_team is not None:
                self._simulated_team.paused = taken is Control.PAUSE
            if taken is Control.WIND_DOWN:
                self._active = "winding_down"
            self._add_state_event("paused" if taken is Control.PAUSE else self._active)
        return taken

    def _without_margin(self, event: MissionEvent) -> MissionEvent:
        """Return an event of the loop with the cells of the map without its margin."""
        if isinstance(event, MissionStarted):  # it is the brief's
            return event
        if isinstance(event, FrameGrown):
            width, height = event.width - 2 * self._brief.margin, event.height - 2 * self._brief.margin
            frame = self._frame.grown_by(event.shift, width, height)
            return replace(event, width=width, height=height, origin_m=frame.origin_m(self._brief.grid))
        return moved_event(event, self._outer)

    def end(self, t_ms: int) -> None:
        """Send the last batch."""
        if self._commands:
            self._send_commands(None)
        assert self._ended is not None
        self._add_event(EventType.END, MissionEndData(status=self._ended.status, reason=self._ended.reason, t_ms=t_ms))
        self._end_batch(over=True)
        self._send_batches()

    def _add_event(self, kind: EventType, data: str | Answer) -> None:
        self._events.append(StoredEvent(kind, data if isinstance(data, str) else text_of(data)))

    def _add_state_event(
        self, state: Literal["paused", "running", "waiting", "winding_down"], reason: str | None = None
    ) -> None:
        self._add_event(EventType.STATE, MissionStateData(state=state, reason=reason, t_ms=self._t_ms))

    def _send_commands(self, until_ms: int | None) -> None:
        self._sent += 1
        batch = CommandsData(
            batch=self._sent,
            revision=self._revision,
            n=self._n,
            t_ms=self._t_ms,
            until_ms=until_ms,
            robots=self._counts or None,
            commands=self._commands,
        )
        self._commands = []
        data = batch.model_dump()
        self._add_event(EventType.COMMANDS, line(data))
        if self._simulated_team is not None and (report := self._simulated_team.report(data)) is not None:
            # the same in every process of the mission, so that a report stored before is recognized
            self._next = report, hashlib.sha256(encode_input(report)).digest()

    def _end_batch(self, *, over: bool) -> None:
        events = tuple(self._events)
        self._batches.append(MissionBatch(events=events, over=over, revision=self._revision, next=self._next))
        self._events, self._next = [], None

    def _send_batches(self) -> None:
        if self._batches:
            self._channel.send(tuple(self._batches))
            self._batches = []

    def _next_input(self) -> PendingInput:
        """Return the next input to answer; before waiting for it, send all batches."""
        if not self._pending:
            self._send_batches()
            inputs = self._channel.receive()
            assert isinstance(inputs, tuple)
            self._pending.extend(inputs)
        return self._pending.popleft()


def _command(order: RobotCommand, revision: int, place: str | None, grid: Grid, *, stop: bool) -> Command:
    """Return a command in the form sent to clients; positions are cells and metres of the map frame."""
    fields: dict[str, Any] = {"id": order.id, "robot": order.robot, "revision": revision}
    if stop:
        return StopCommand(name="stop", **fields)
    fields["place"] = place
    if order.carrier is None:
        centres = [rounded(grid.centre_m(cell)) for cell in order.route]
        return DriveCommand(name="drive", route=list(map(list, order.route)), route_m=centres, **fields)
    fields["carrier"] = order.carrier
    if order.name == ActionName.DOCK:
        return DockCommand(name="dock", **fields)
    assert order.cell is not None
    return UndockCommand(name="undock", cell=list(order.cell), point_m=rounded(grid.centre_m(order.cell)), **fields)

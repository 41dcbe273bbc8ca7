"""The process of a mission: the closed loop in a world of reports.

After each input everything it led to goes back in one turn. A process that takes the place of a dead one is given the
decisions of its predecessor with the inputs, and so comes to the same turns again without planning.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from marsupial.formats.loglines import LogEncoder
from marsupial.library.first_use import try_mission
from marsupial.mission.loop import MissionLoop, MissionOrder
from marsupial.mission.observer import Observer
from marsupial.model.mission import (
    ActionStarted,
    FrameGrown,
    MissionEnded,
    MissionEvent,
    MissionStarted,
    Planned,
)
from marsupial.model.strategy import Briefing, Decision
from marsupial.processes.channel import Channel
from marsupial.strategies.registry import strategy
from marsupial_service.missions import documents
from marsupial_service.missions.robots import SimulatedRobots
from marsupial_service.missions.values import (
    Brief,
    Due,
    Dues,
    Event,
    EventType,
    HasPlanned,
    Input,
    MayPlan,
    Report,
    SimulatedBrief,
    Told,
    Turn,
    Turns,
    WantsToPlan,
    Wish,
)
from marsupial_service.missions.world import RemoteWorld, RobotCommand
from marsupial_service.store import kept


def load_missions() -> None:
    """Load what missions run with compiled code; the first time ever it is compiled."""
    try_mission("temporal", "auto", rovers=True)


def fly(brief: Brief, channel: Channel) -> None:
    """Carry out a mission; the function of a job."""
    desk = Desk(brief, channel)
    kinds = {kind.name: kind for kind in brief.kinds}
    world = RemoteWorld(brief, desk)
    order = MissionOrder(
        goal=brief.goal,
        limits=brief.limits,
        planning_time=brief.planning_time,
        reachable=brief.reachable,
        homes=world.homes,
        waits=True,
    )
    desk.event(_started(brief, world))
    MissionLoop(world, kinds, desk, order, desk).run(lambda: world.cancelled)
    world.stop_all()
    desk.end(world.now_ms)


def _started(brief: Brief, world: RemoteWorld) -> MissionStarted:
    return MissionStarted(
        t_ms=world.now_ms,
        scenario=brief.name,
        strategy=brief.strategy,
        planner=brief.planner,
        seed=brief.seed,
        width=brief.grid.width,
        height=brief.grid.height,
        resolution_m=brief.grid.resolution_m,
        origin_m=brief.grid.origin_m,
        terrains=brief.grid.terrains,
        types=brief.kinds,
        robots=world.placed(),
        goal=brief.goal,
    )


class Desk(Observer):
    """Gathers what the mission does into turns, fetches the inputs, and is the strategy whose decisions are kept."""

    def __init__(self, brief: Brief, channel: Channel) -> None:
        self._brief = brief
        self._inner = strategy(brief.strategy, planner=brief.engine, budget=brief.budget)
        self.name = self._inner.name
        own = getattr(self._inner, "replanning", None)
        if own is not None:
            self.replanning = own
        self._channel = channel
        self._robots = SimulatedRobots(brief) if isinstance(brief, SimulatedBrief) else None
        self._next: Told | None = None
        self._encoder = LogEncoder()
        self._events: list[Event] = []
        self._commands: list[dict[str, object]] = []
        self._grid = brief.grid
        self._n = self._t_ms = self._batch = self._revision = 0
        self._counts: dict[str, int] = {}
        self._action: ActionStarted | None = None
        self._ended: MissionEnded | None = None
        self._turns: list[Turn] = []
        self._dues: deque[Due] = deque()
        self._decisions = deque(self._due().decisions)

    def event(self, event: MissionEvent) -> None:
        """Log an event; clients that follow no log are told of a frame that has grown as well."""
        if isinstance(event, Planned):
            self._revision = event.revision
        elif isinstance(event, ActionStarted):
            self._action = event
        elif isinstance(event, MissionEnded):
            self._ended = event
        elif isinstance(event, FrameGrown):
            self._grid = replace(self._grid, origin_m=event.origin_m)
            self._tell(EventType.FRAME, documents.frame(event, self._grid.resolution_m))
        self._tell(EventType.LOG, self._encoder.line(event))

    def waiting(self, reason: str) -> None:
        """Tell that the mission waits for a map on which its robots can stand, or that it goes on."""
        self._tell(EventType.STATE, documents.waiting(reason, self._t_ms))

    def decide(self, briefing: Briefing) -> Decision:
        """Return the decision that was made before, if there is one, or make one."""
        if self._decisions:
            text = self._decisions.popleft()
            decision = documents.decision_of(text)
        else:
            self._send_turns()
            self._channel.send(WantsToPlan())
            assert isinstance(self._channel.receive(), MayPlan)
            decision = self._told(self._inner.decide(briefing))
            self._channel.send(HasPlanned())
            text = documents.decision(decision)
        self._tell(EventType.DECISION, text)
        return decision

    def _told(self, decision: Decision) -> Decision:
        """Return a decision that names the planner as the client does."""
        say, report = self._brief.without_command, decision.report
        return replace(decision, report=replace(report, planner=say(report.planner), detail=say(report.detail)))

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        """Put a command among those to be sent next."""
        revision, place = self._revision, None
        if self._action is not None and not stop:
            revision, place = self._action.revision, self._action.action.place
        self._commands.append(documents.command(order, revision, place, self._grid, stop=stop))

    def exchange(self, until_ms: int) -> Input:
        """Send everything there is, to be answered by `until_ms`, and return the next input once it has come."""
        self._send_commands(until_ms)
        self._end_turn(over=False)
        answer = self._due()
        assert answer.input is not None
        taken: Input = kept.loads(answer.input) if isinstance(answer.input, bytes) else answer.input
        self._decisions = deque(answer.decisions)
        if not isinstance(taken, Wish):
            self._count(taken)
        elif taken is not Wish.CANCEL:
            self._tell(EventType.STATE, documents.state(taken, self._t_ms))
        return taken

    def _count(self, report: Report) -> None:
        self._t_ms = max(self._t_ms, report.t_ms)
        if report.robot is None:
            self._n = report.n
        else:
            self._counts[report.robot] = report.n

    def end(self, t_ms: int) -> None:
        """Send the last turn."""
        if self._commands:
            self._send_commands(None)
        assert self._ended is not None
        self._tell(EventType.END, documents.end(self._ended.status, self._ended.reason, t_ms))
        self._end_turn(over=True)
        self._send_turns()

    def _tell(self, kind: EventType, data: str) -> None:
        self._events.append(Event(kind, data))
        if self._robots is not None:
            self._next = self._robots.hear(self._events[-1]) or self._next

    def _send_commands(self, until_ms: int | None) -> None:
        self._batch += 1
        head = {"batch": self._batch, "revision": self._revision, "n": self._n, "t_ms": self._t_ms}
        data = documents.commands({**head, "until_ms": until_ms}, self._counts, self._commands)
        self._tell(EventType.COMMANDS, data)
        self._commands = []

    def _end_turn(self, *, over: bool) -> None:
        self._turns.append(Turn(events=tuple(self._events), over=over, revision=self._revision, next=self._next))
        self._events, self._next = [], None

    def _send_turns(self) -> None:
        if self._turns:
            self._channel.send(Turns(tuple(self._turns)))
            self._turns = []

    def _due(self) -> Due:
        """Return what is to be answered next; all turns are sent before it is waited for."""
        if not self._dues:
            self._send_turns()
            told = self._channel.receive()
            assert isinstance(told, Dues)
            self._dues.extend(told.dues)
        return self._dues.popleft()

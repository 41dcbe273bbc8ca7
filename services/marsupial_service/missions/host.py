"""The process of a mission: the closed loop in a world of reports.

After each input everything it led to goes back in one turn. A process that takes the place of a dead one is given the
decisions of its predecessor with the inputs, and so comes to the same turns again without planning.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from marsupial.formats.loglines import LogEncoder
from marsupial.library.first_use import try_mission
from marsupial.mission.loop import Mission, MissionOrder
from marsupial.mission.observer import Observer
from marsupial.model.mission import ActionEnded, ActionStarted, MissionEnded, MissionEvent, MissionStarted, Planned
from marsupial.model.strategy import Briefing, Decision
from marsupial.processes.channel import Channel
from marsupial.strategies.registry import strategy
from marsupial_service.missions import documents
from marsupial_service.missions.values import Brief, Event, EventType, Input, Next, Turn, Wish
from marsupial_service.missions.world import MapChanged, RemoteWorld, RobotCommand


def load_missions() -> None:
    """Load what missions run with compiled code; the first time ever it is compiled."""
    try_mission("temporal", "auto", rovers=True)


def fly(brief: Brief, channel: Channel) -> None:
    """Carry out a mission, again from the start each time the map turns out to have changed; the function of a job."""
    desk = Desk(brief, channel)
    kinds = {kind.name: kind for kind in brief.kinds}
    world = RemoteWorld(brief, desk)
    order = MissionOrder(
        goal=brief.goal,
        limits=brief.limits,
        planning_time=brief.planning_time,
        reachable=brief.reachable,
        homes=world.homes,
    )
    while True:
        desk.event(_started(brief, world))
        try:
            Mission(world, kinds, desk, order, desk).run(lambda: world.cancelled)
        except MapChanged:
            desk.restart()
            world.settle(brief.limits.time_ms)
        else:
            break
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
        self._encoder = LogEncoder()
        self._events: list[Event] = []
        self._commands: list[dict[str, object]] = []
        self._n = self._t_ms = self._batch = self._stops = 0
        self._revision = self._before = 0
        self._action: ActionStarted | None = None
        self._ended: MissionEnded | None = None
        self._decisions = deque(self._receive().decisions)

    def event(self, event: MissionEvent) -> None:
        """Log an event; revisions continue counting when the mission restarts."""
        if isinstance(event, Planned | ActionStarted | ActionEnded):
            event = replace(event, revision=self._before + event.revision)
        if isinstance(event, Planned):
            self._revision = event.revision
        elif isinstance(event, ActionStarted):
            self._action = event
        elif isinstance(event, MissionEnded):
            self._ended = event
        self._tell(EventType.LOG, self._encoder.line(event))

    def decide(self, briefing: Briefing) -> Decision:
        """Return the decision that was made before, if there is one, or make one."""
        if self._decisions:
            text = self._decisions.popleft()
            decision = documents.decision_of(text)
        else:
            decision = self._told(self._inner.decide(briefing))
            text = documents.decision(decision)
        self._tell(EventType.DECISION, text)
        return decision

    def _told(self, decision: Decision) -> Decision:
        """Return a decision that names the planner as the client does."""
        say, report = self._brief.without_command, decision.report
        return replace(decision, report=replace(report, planner=say(report.planner), detail=say(report.detail)))

    def restart(self) -> None:
        """Count revisions on from here."""
        self._before = self._revision

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        """Put a command among those to be sent next."""
        revision, place = self._revision, None
        if self._action is not None and not stop:
            revision, place = self._action.revision, self._action.action.place
        self._commands.append(documents.command(order, revision, place, self._brief.grid, stop=stop))

    def exchange(self, until_ms: int) -> Input:
        """Send everything there is, to be answered by `until_ms`, and wait for the next input."""
        self._send_commands(until_ms)
        self._send_turn(over=False)
        answer = self._receive()
        assert answer.input is not None
        self._decisions = deque(answer.decisions)
        if not isinstance(answer.input, Wish):
            self._n, self._t_ms = answer.input.n, answer.input.t_ms
        elif answer.input is not Wish.CANCEL:
            self._tell(EventType.STATE, documents.state(answer.input, self._t_ms))
        return answer.input

    def end(self, t_ms: int) -> None:
        """Send the last turn."""
        if self._commands:
            self._send_commands(None)
        assert self._ended is not None
        self._tell(EventType.END, documents.end(self._ended.status, self._ended.reason, t_ms))
        self._send_turn(over=True)

    def _tell(self, kind: EventType, data: str) -> None:
        self._events.append(Event(kind, data))

    def _send_commands(self, until_ms: int | None) -> None:
        self._batch += 1
        data = documents.commands(self._batch, self._revision, self._n, self._t_ms, until_ms, self._commands)
        self._tell(EventType.COMMANDS, data)
        self._commands = []

    def _send_turn(self, *, over: bool) -> None:
        self._channel.send(Turn(events=tuple(self._events), over=over))
        self._events = []

    def _receive(self) -> Next:
        answer = self._channel.receive()
        assert isinstance(answer, Next)
        return answer

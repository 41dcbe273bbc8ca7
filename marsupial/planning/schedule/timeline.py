"""A plan under construction: actions are appended, each as early as its robots allow.

It knows where every robot is after its last action and when it is ready. The drive to where an action begins is added
automatically; an action that the checker would refuse can't be added. `transport` and `follow` add the actions that
carry a rover, and `retime` puts a plan of another engine on the clock.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from marsupial.errors import InternalError
from marsupial.model import EPSILON_MS, Action, ActionName, Plan, RobotState, Situation
from marsupial.model.team import after


@dataclass(slots=True)
class Timeline:
    """The actions so far and, after them, per robot: `at` a place or `on` a carrier, `ready_ms` for its next action."""

    situation: Situation
    at: dict[str, str | None]
    on: dict[str, str | None]
    ready_ms: dict[str, int]
    cargo: dict[str, tuple[str, ...]]  # the rovers aboard each carrier, those longest aboard first
    actions: list[Action]

    @classmethod
    def of(cls, situation: Situation) -> Timeline:
        """Return the timeline of `situation` with no action in it."""
        robots = situation.robots
        return cls(
            situation=situation,
            at={robot.name: robot.place for robot in robots},
            on={robot.name: robot.carrier for robot in robots},
            ready_ms={robot.name: free_at_ms(situation, robot) for robot in robots},
            cargo={robot.name: tuple(r.name for r in robots if r.carrier == robot.name) for robot in robots},
            actions=[],
        )

    def copy(self) -> Timeline:
        """Return a copy that can be continued differently."""
        return replace(
            self,
            at=dict(self.at),
            on=dict(self.on),
            ready_ms=dict(self.ready_ms),
            cargo=dict(self.cargo),
            actions=list(self.actions),
        )

    @property
    def plan(self) -> Plan:
        return Plan.of(self.actions)

    @property
    def explored(self) -> frozenset[str]:
        """Names of the targets explored so far."""
        return frozenset(action.place for action in self.actions if action.name is ActionName.EXPLORE)

    def has_place(self, carrier: str, rover: str) -> bool:
        """Return whether `rover` can dock on `carrier` now."""
        cargo, kind = self.cargo[carrier], self.situation.type_of(carrier)
        return len(cargo) < kind.capacity and (not kind.seats or self.situation.has_place(carrier, rover, cargo))

    def in_the_way(self, carrier: str, rover: str) -> str | None:
        """Return the first rover aboard that makes a place for `rover` when it is set down, None if none does."""
        cargo = self.cargo[carrier]
        leave = (one for one in cargo if self.situation.has_place(carrier, rover, [r for r in cargo if r != one]))
        return next(leave, None)

    def can_drive(self, robot: str, place: str) -> bool:
        """Return whether `robot` is on the ground and at `place`, or can drive there."""
        at = self.at[robot]
        kind = self.situation.robot_by_name[robot].type
        return at is not None and (at == place or self.situation.travel(kind, at, place) is not None)

    def ready_at(self, robot: str, place: str) -> int | None:
        """Return when `robot` could be ready at `place`; None if it is carried or there is no path."""
        at = self.at[robot]
        if at == place or at is None:
            return None if at is None else self.ready_ms[robot]
        travel = self.situation.travel(self.situation.robot_by_name[robot].type, at, place)
        return None if travel is None else self.ready_ms[robot] + max(1, travel) + EPSILON_MS

    def fits(self, rover: str, meeting: str) -> bool:
        """Return whether `rover` can be set down at `meeting`."""
        return duration_ms(self.situation, ActionName.UNDOCK, rover, meeting, None) is not None

    def move(self, robot: str, place: str) -> None:
        """Drive to a meeting point or home, unless it is there."""
        if self.at[robot] != place:
            self._add(ActionName.MOVE, robot, place)

    def explore(self, robot: str, target: str) -> None:
        """Drive to a target and explore it."""
        self._add(ActionName.EXPLORE, robot, target)

    def dock(self, rover: str, carrier: str, meeting: str) -> None:
        """Bring rover and carrier to `meeting` and dock there."""
        if not self.has_place(carrier, rover):
            raise InternalError(f"{carrier} has no place for {rover}")
        self.move(rover, meeting)
        self.move(carrier, meeting)
        self._add(ActionName.DOCK, rover, meeting, carrier=carrier)

    def undock(self, rover: str, meeting: str) -> None:
        """Bring the carrier that `rover` is aboard to `meeting` and set the rover down there."""
        carrier = self.on[rover]
        if carrier is None:
            raise InternalError(f"{rover} is not aboard a carrier")
        self.move(carrier, meeting)
        self._add(ActionName.UNDOCK, rover, meeting, carrier=carrier)

    def can(self, action: Action) -> bool:
        """Return whether an action can be added as it is; explore and move leave from where their robot is."""
        robot, carrier = action.robot, action.carrier
        if carrier is None:
            done = action.place == self.at[robot] or action.place in self.explored
            return not done and self.can_drive(robot, action.place)
        if self.at[carrier] != action.place:
            return False
        if action.name is ActionName.UNDOCK:
            return self.on[robot] == carrier and self.fits(robot, action.place)
        return self.at[robot] == action.place and self.has_place(carrier, robot)

    def add(self, action: Action) -> None:
        """Add an action and the drives to where it begins; its times and its origin are ignored."""
        if action.name is ActionName.MOVE:
            self.move(action.robot, action.place)
        elif action.name is ActionName.EXPLORE:
            self.explore(action.robot, action.place)
        elif action.name is ActionName.UNDOCK:
            self.undock(action.robot, action.place)
        elif action.carrier is not None:
            self.dock(action.robot, action.carrier, action.place)

    def _add(self, name: ActionName, robot: str, place: str, *, carrier: str | None = None) -> None:
        origin = self.at[robot] if carrier is None else None
        took = duration_ms(self.situation, name, robot, place, origin)
        if took is None:
            what = f"be set down at {place}" if name is ActionName.UNDOCK else f"drive from {origin} to {place}"
            raise InternalError(f"{robot} can't {what}")
        start = self.ready_ms[robot] if carrier is None else max(self.ready_ms[robot], self.ready_ms[carrier])
        action = Action(
            name=name, start_ms=start, duration_ms=took, robot=robot, place=place, carrier=carrier, origin=origin
        )
        self.actions.append(action)
        # A dock or undock keeps both robots busy, including the one that waited.
        for one in action.robots:
            self.ready_ms[one] = action.end_ms + EPSILON_MS
        before, now = self.on[robot], after(action)
        self.at[robot], self.on[robot] = now.at, now.carrier
        if before is not None:
            self.cargo[before] = tuple(other for other in self.cargo[before] if other != robot)
        if now.carrier is not None:
            self.cargo[now.carrier] += (robot,)


def replay(situation: Situation, plan: Plan) -> Timeline:
    """Return the timeline with the actions of a plan feasible in `situation`; it may leave out moves to docks."""
    timeline = Timeline.of(situation)
    for action in plan.actions:
        timeline.add(action)
    return timeline


def free_at_ms(situation: Situation, robot: RobotState) -> int:
    """Return when a robot can act first; one aboard when its carrier can."""
    return (robot if robot.carrier is None else situation.robot_by_name[robot.carrier]).free_at_ms


def duration_ms(situation: Situation, name: ActionName, robot: str, place: str, origin: str | None) -> int | None:
    """Return how long an action takes in `situation`; None without a path, or where a rover can't be set down."""
    kind = situation.type_of(robot)
    if name is ActionName.DOCK:
        return max(1, kind.dock_ms)
    if name is ActionName.UNDOCK:
        return max(1, kind.undock_ms) if situation.can_stand(kind.name, place) else None
    travel = None if origin is None else situation.travel(kind.name, origin, place)
    return None if travel is None else max(1, travel)


@dataclass(frozen=True, slots=True)
class Transport:
    """One stage of a rover's journey: aboard `carrier` from a meeting to another, then by itself to a third."""

    carrier: str
    pickup: str | None  # None where it is aboard from the start
    set_down: str
    then_to: str


def transport(timeline: Timeline, rover: str, stage: Transport) -> bool:
    """Add a transport; return False if a robot has no path (the timeline then ends in the middle of it)."""
    if stage.pickup is not None:
        if not (timeline.can_drive(stage.carrier, stage.pickup) and timeline.can_drive(rover, stage.pickup)):
            return False
        if not board(timeline, rover, stage.carrier, stage.pickup):
            return False
    if not (timeline.can_drive(stage.carrier, stage.set_down) and timeline.fits(rover, stage.set_down)):
        return False
    timeline.undock(rover, stage.set_down)
    return _moved(timeline, rover, stage.then_to)


def _moved(timeline: Timeline, robot: str, place: str) -> bool:
    """Drive to a meeting point, unless it is there; return whether there is a path."""
    if possible := timeline.can_drive(robot, place):
        timeline.move(robot, place)
    return possible


def board(timeline: Timeline, rover: str, carrier: str, meeting: str) -> bool:
    """Dock `rover`; a full carrier first sets down the first rover that makes a place. Return False if none can."""
    if not timeline.has_place(carrier, rover):
        first = timeline.in_the_way(carrier, rover)
        place = None if first is None else _where_to_unload(timeline, first, carrier, meeting)
        if first is None or place is None:
            return False
        timeline.undock(first, place)
    timeline.dock(rover, carrier, meeting)
    return True


def _where_to_unload(timeline: Timeline, rover: str, carrier: str, meeting: str) -> str | None:
    """Return `meeting`, or if `rover` does not fit there the meeting that is least out of the carrier's way, if any."""
    if timeline.fits(rover, meeting):
        return meeting
    situation, at = timeline.situation, timeline.at[carrier]
    kind = situation.robot_by_name[carrier].type
    options = [
        (there + back, name)
        for name in situation.meetings
        if at is not None
        and timeline.fits(rover, name)
        and (there := 0 if at == name else situation.travel(kind, at, name)) is not None
        and (back := situation.travel(kind, name, meeting)) is not None
    ]
    return min(options)[1] if options else None


def follow(timeline: Timeline, rover: str, meeting: int, transports: Mapping[int, Transport]) -> bool:
    """Add the transports that bring `rover` to a meeting; return False if one of them is not possible."""
    names = timeline.situation.meetings
    # From the last transport back to the one that begins where the rover is.
    chain: list[Transport] = []
    at = meeting
    while at in transports:
        chain.append(transports[at])
        pickup = chain[-1].pickup
        if pickup is None:
            break
        at = names.index(pickup)
    transported = all(transport(timeline, rover, stage) for stage in reversed(chain))
    return transported and _moved(timeline, rover, names[meeting])


def retime(situation: Situation, actions: Iterable[Action]) -> Plan:
    """Return the plan of `actions`, each as early as possible; without a path one keeps its duration, to be refused."""
    # engines leave gaps (Aries) or let actions touch (Tamer): what counts is the order of each robot's actions
    ready = {robot.name: free_at_ms(situation, robot) for robot in situation.robots}
    timed: list[Action] = []
    for action in actions:
        start = max(ready[robot] for robot in action.robots)
        took = duration_ms(situation, action.name, action.robot, action.place, action.origin)
        action = replace(action, start_ms=start, duration_ms=action.duration_ms if took is None else took)
        timed.append(action)
        ready.update(dict.fromkeys(action.robots, action.end_ms + EPSILON_MS))
    return Plan.of(timed)

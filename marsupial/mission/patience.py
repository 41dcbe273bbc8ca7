"""When a mission had better wait than be over, when it goes round in circles, and why it gets no farther.

Where others make the map it may come late, or have a robot stand in an obstacle for a while: then nothing can be
reached, which is no reason to call the mission complete. And a team that reports robot by robot may ask for many plans
at one moment, with something new each time.
"""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.formats.scenario.team import standing_fault
from marsupial.maps.footprint import fits
from marsupial.maps.survey import Survey
from marsupial.mission.observer import Observer
from marsupial.model.mission import Cause, Status, Trigger, Triggers
from marsupial.model.robots import RobotType
from marsupial.model.world import News, RobotReport, World
from marsupial.planning.reachability import obstacles

WAIT_MS = 60_000
"""How long, in mission time, a mission that has begun waits for robots that can't stand where they are."""

Ending = tuple[Status, str]


class Patience:
    """Waits, rather than have a mission end, while robots can't stand where they are on the known map.

    Until one of them can for the first time, a mission waits for its first map as long as its time limit allows.

    Attributes
    ----------
    waits
        Whether it does now.
    """

    def __init__(self, world: World, kinds: Mapping[str, RobotType], observer: Observer) -> None:
        self._world = world
        self._kinds = kinds
        self._observer = observer
        self._begun = False
        self._since_ms = -1
        self._stranded: tuple[RobotReport, ...] = ()
        self._told = ""
        self.waits = False

    @property
    def wake_ms(self) -> int | None:
        """When it has waited long enough, or None."""
        return self._since_ms + WAIT_MS if self.waits and self._begun else None

    def ready(self) -> bool:
        """Say whether to plan: not while no robot on the ground can stand where it is."""
        there = [robot for robot in self._world.robots() if not robot.lost and robot.cell is not None]
        stranded = self._look()
        if there and len(stranded) == len(there) and not self._too_long():
            self._wait()
            return False
        self._begun = True
        return True

    def over(self, ended: Ending | None) -> Ending | None:
        """Return how the mission ends, if it would and is not to wait."""
        stranded = self._look()
        if ended is None or not stranded or ended[0] not in (Status.COMPLETE, Status.STALLED):
            self._go_on()
            return ended
        if self._too_long():
            return Status.STALLED, self._reason()
        self._wait()
        return None

    def after(self, triggers: Triggers, news: News) -> Triggers:
        """Return what asks for a new plan after these news: while it waits, what may end that."""
        if not self.waits:
            return triggers
        before = self._stranded
        fresh = news.revealed or news.changed or news.moved is not None or self._look() != before
        if all(trigger.cause is Cause.CARRIED_OUT for trigger in triggers) and not fresh and not self._too_long():
            return ()
        return (triggers or (Trigger(Cause.CARRIED_OUT),)) if self._begun else (Trigger(Cause.START),)

    def _look(self) -> tuple[RobotReport, ...]:
        """Find who can't stand where it is."""
        grid = self._world.grid
        self._stranded = tuple(
            robot
            for robot in self._world.robots()
            if not robot.lost and robot.cell is not None and not fits(grid, self._kinds[robot.type], robot.cell)
        )
        return self._stranded

    def _too_long(self) -> bool:
        return self._begun and self._since_ms >= 0 and self._world.now_ms >= self._since_ms + WAIT_MS

    def _wait(self) -> None:
        if not self.waits:
            self.waits = True
            self._since_ms = self._world.now_ms
        self._tell(self._reason())

    def _go_on(self) -> None:
        self.waits = False
        self._since_ms = -1
        self._tell("")

    def _tell(self, reason: str) -> None:
        if reason != self._told:
            self._told = reason
            self._observer.waiting(reason)

    def _reason(self) -> str:
        grid = self._world.grid
        faults = (
            f"{robot.name} can't stand at [{robot.cell.x}, {robot.cell.y}]: "
            f"{standing_fault(grid, self._kinds[robot.type], robot.cell)}"
            for robot in self._stranded
            if robot.cell is not None
        )
        return "; ".join(faults)


def why_stalled(survey: Survey, world: World, told: str) -> str:
    """Return what keeps the team from its goal, or else what is `told`; and who is lost."""
    lost = [robot.name for robot in world.robots() if robot.lost]
    causes = [*obstacles(survey.situation)] or [told]
    return "; ".join(causes + ([f"lost: {', '.join(lost)}"] if lost else []))


class Rounds:
    """Counts the replannings at one moment, not those after the first news that a robot had of it by itself."""

    def __init__(self) -> None:
        self._heard: set[str] = set()
        self._heard_ms = self._planned_ms = -1
        self._new = False
        self._fruitless = 0

    def hear(self, news: News) -> None:
        """Take in what happened."""
        if not news.partial:
            return
        if news.t_ms != self._heard_ms:
            self._heard_ms, self._heard = news.t_ms, set()
        names = {*news.finished, *(name for name, _ in news.failed)}
        self._new = self._new or not names <= self._heard
        self._heard |= names

    def begin(self, now_ms: int) -> int:
        """Return how many rounds have led nowhere, now that another one begins."""
        if now_ms != self._planned_ms:
            self._fruitless = 0
        elif not self._new:
            self._fruitless += 1
        self._new = False
        return self._fruitless

    def planned(self, now_ms: int) -> None:
        """Take in that a plan is followed since that moment."""
        self._planned_ms = now_ms

"""Waiting and stalling: when a mission waits instead of ending, and when replanning makes no progress.

A map built by other software may be late, or show a robot inside an obstacle for a while. Nothing is reachable then,
but the mission is not complete: `Patience` makes it wait. So it does while a lost robot is expected to return, unless
the mission is complete without it. `Rounds` counts replannings without effect.
"""

from marsupial.formats.scenario.team import standing_fault
from marsupial.maps.discs import fits
from marsupial.maps.survey import Survey
from marsupial.mission.belief.belief import Belief
from marsupial.mission.ending import MissionEnding, absent
from marsupial.mission.executor import Executor
from marsupial.mission.goals import MissionOrder
from marsupial.mission.observer import Observer
from marsupial.mission.policies import Policies
from marsupial.model import Cause, News, RobotReport, Status, Trigger, Triggers
from marsupial.model.zones import unzoned
from marsupial.planning.reachability import obstacles

MAX_FRUITLESS = 5  # replannings without effect at one moment; the next one ends the mission as stalled

WAIT_MS = 60_000  # longest wait, in mission time, for robots that can't stand where they are, once it has begun


class Patience:
    """Makes a mission wait instead of ending: for lost robots that return, or (`MissionOrder.waits`) for its map.

    While robots can't stand where they are on the map, the wait for the first usable map is limited by the mission's
    time limit only, later waits by `WAIT_MS`. The wait for robots that return is limited by the time limit only.
    """

    def __init__(
        self, belief: Belief, order: MissionOrder, policies: Policies, executor: Executor, observer: Observer
    ) -> None:
        self._belief, self._order, self._policies, self._executor = belief, order, policies, executor
        self._observer = observer
        self._begun = False
        self._since_ms = -1  # start of the wait for the map, -1 without one
        self._stranded: tuple[RobotReport, ...] = ()
        self._returning: tuple[str, ...] = ()  # lost robots that are expected to return
        self._reported = ""
        self.waits = False
        self.rounds = Rounds()

    @property
    def wake_ms(self) -> int | None:
        """When the wait for the map ends at the latest, or None."""
        waits = self.waits and self._begun and self._since_ms >= 0
        return self._since_ms + WAIT_MS if waits and not self._is_overdue() else None

    @property
    def expects_news(self) -> bool:
        """Whether rovers out of contact, or a map that may be late, may still bring something."""
        return self._belief.awaits or self._rests or self._belief.looks.rest_comes_ms is not None

    @property
    def waits_for_map(self) -> bool:
        """Whether nothing is left to explore but cells that rest."""
        return self._rests and self._policies.now.exploration_ms is not None

    @property
    def runs(self) -> bool:
        """Whether an action runs, or may still run if its end is known late."""
        may_run = self._order.plans_on_board or self._belief.awaits
        return self._executor.acts or (self._executor.running and may_run)

    @property
    def _rests(self) -> bool:
        """Whether cells rest that robots have stood beside, as the map may be late; a returning team does not wait."""
        return self._policies.why is None and self._belief.looks.wake_ms is not None

    def until(self) -> int:
        """Return until when time may pass at most."""
        looks, wake_ms = self._belief.looks, self.wake_ms if self.waits else self._policies.now.wake_ms
        moments = (
            self._policies.until(self._order.limits.time_ms, self._executor.busy_ms),
            None if wake_ms is None or self.waits_for_map else max(self._belief.now_ms, wake_ms),
            looks.wake_ms,
            looks.rest_comes_ms if self._executor.idle else None,
            self._executor.ready_ms,
        )
        return min(t_ms for t_ms in moments if t_ms is not None)

    def stalled(self, survey: Survey, reason: str) -> MissionEnding:
        """Return how the mission ends when no plan makes progress: `reason` explains it if nothing visible does."""
        planned = {state.name: state.type for state in survey.situation.robots}
        robot_types = {planned[robot.name]: robot.type for robot in self._belief.robots() if robot.name in planned}
        found = [*obstacles(survey.situation, robot_types)] or [reason]
        why = "; ".join(filter(None, [*found, self._belief.no_go]))
        back = self._policies.why is not None
        return self._policies.ending(self._executor.under_way, why) if back else (Status.STALLED, why)

    def ready(self) -> bool:
        """Return whether planning makes sense: not while all robots on the ground stand on impassable cells."""
        there = [robot for robot in self._belief.robots() if not robot.lost and robot.cell is not None]
        if there and len(self._find_stranded()) == len(there) and not self._is_overdue():
            self._wait()
            return False
        self._begun = True
        return True

    def over(self, ended: MissionEnding | None) -> MissionEnding | None:
        """Return how the mission ends, or None if it doesn't or if it waits instead."""
        stranded, returning = self._find_stranded(), self._find_returning()
        if stranded and ended is not None and ended[0] in (Status.COMPLETE, Status.STALLED):
            if not self._is_overdue():
                self._wait()
                return None
            ended = Status.STALLED, self._reason()
        else:
            self._since_ms = -1
        may_go_on = ended is not None and (ended[0] is Status.STALLED or all(r.lost for r in self._belief.robots()))
        self.waits = bool(returning and may_go_on)
        self._report("; ".join(absent(self._belief.robots(), self._belief.grid)) if self.waits else "")
        return None if self.waits else ended

    def after(self, triggers: Triggers, news: News) -> Triggers:
        """Return the triggers of a new plan after `news`: during a wait only the triggers that may end it."""
        if not self.waits:
            return triggers
        before = self._stranded, self._returning
        # idle robots trigger a new plan at every look, which is pointless unless the map or a robot has changed
        now = self._find_stranded(), self._find_returning()
        fresh = news.revealed or news.changed or news.moved is not None or now != before
        if all(trigger.cause is Cause.CARRIED_OUT for trigger in triggers) and not fresh and not self._is_overdue():
            return ()
        return (triggers or (Trigger(Cause.CARRIED_OUT),)) if self._begun else (Trigger(Cause.START),)

    def _find_stranded(self) -> tuple[RobotReport, ...]:
        grid = unzoned(self._belief.grid)
        self._stranded = tuple(
            robot
            for robot in (self._belief.robots() if self._order.waits else ())
            if not robot.lost and robot.cell is not None and not fits(grid, self._belief.kinds[robot.type], robot.cell)
        )
        return self._stranded

    def _find_returning(self) -> tuple[str, ...]:
        self._returning = tuple(robot.name for robot in self._belief.robots() if robot.lost and robot.returns)
        return self._returning

    def _is_overdue(self) -> bool:
        return self._begun and self._since_ms >= 0 and self._belief.now_ms >= self._since_ms + WAIT_MS

    def _wait(self) -> None:
        self.waits = True
        if self._since_ms < 0:
            self._since_ms = self._belief.now_ms
        self._report(self._reason())

    def _report(self, reason: str) -> None:
        if reason != self._reported:
            self._reported = reason
            self._observer.waiting(reason)

    def _reason(self) -> str:
        grid = unzoned(self._belief.grid)
        faults = (
            f"{robot.name} can't stand at [{', '.join(f'{metres:.4g}' for metres in grid.centre_m(robot.cell))}] m: "
            f"{standing_fault(grid, self._belief.kinds[robot.type], robot.cell)}"
            for robot in self._stranded
            if robot.cell is not None
        )
        return "; ".join(faults)


class Rounds:
    """Counts replannings without effect at one moment.

    Robots of a real team report one by one (`News.partial`), each perhaps with a trigger for a new plan. The first
    report of a robot about a moment is progress, so a replanning after it does not count.
    """

    def __init__(self) -> None:
        self._reporters: set[str] = set()
        self._progress_ms = self._planned_ms = -1
        self._progress = False
        self._fruitless = 0

    def update(self, news: News) -> None:
        """Note which robots have news, and that an operator asked for something."""
        self._progress = self._progress or bool(news.zones)
        if not news.partial:
            return
        if news.t_ms != self._progress_ms:
            self._progress_ms, self._reporters = news.t_ms, set()
        names = {*news.finished, *news.in_contact, *news.out_of_contact}
        names.update(name for name, _ in (*news.failed, *news.declined))
        self._progress = self._progress or not names <= self._reporters
        self._reporters |= names

    def begin(self, now_ms: int) -> int:
        """Count a replanning that begins; return how many at this moment had no effect."""
        if now_ms != self._planned_ms:
            self._fruitless = 0
        elif not self._progress:
            self._fruitless += 1
        self._progress = False
        return self._fruitless

    def planned(self, now_ms: int) -> None:
        """Note that a plan was adopted."""
        self._planned_ms = now_ms

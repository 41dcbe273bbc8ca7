"""The replanning policies of a mission: which one is in force, and how a mission ends whose team was called back.

A mission begins with the strategy's own policy or `OnNews`. Once the time left is only just enough for the way back
(`marsupial.mission.recall`), enough is explored, or an operator calls the team back, `ReturnPolicy` replaces it, which
ignores what is left to explore. If time remains once all rovers are aboard of a team that was called back in time,
carriers explore on alone (`CarriersAlone`), unless the team has to be home or the strategy has a policy of its own.
"""

from collections.abc import Iterable, Mapping, Sequence, Set
from enum import StrEnum

from marsupial.maps.lookout import Lookout, setbacks_in
from marsupial.maps.survey import Survey
from marsupial.maps.targets import Target
from marsupial.mission.belief.belief import Belief
from marsupial.mission.ending import MissionEnding, achieved, unmet
from marsupial.mission.goals import MissionOrder, homes_of
from marsupial.mission.measures import ExploredArea
from marsupial.mission.observer import Observer
from marsupial.mission.recall import Recall, returning
from marsupial.mission.replanning import OnNews, Replanning
from marsupial.model import Action, Cell, FrameShift, Goal, News, PlanProgress, RobotReport, RobotType, Role
from marsupial.model.mission import Cause, MapMeeting, Status, Trigger, Triggers
from marsupial.model.scenario import ReturnGoal
from marsupial.model.strategy import Strategy


class CallBack(StrEnum):
    """Why a team is called back."""

    IN_TIME = "in time for the time limit"
    COVERED = "enough is explored"
    BY_OPERATOR = "by the operator"


class Policies:
    """The replanning policy in force (`now`), and `why` the team was called back, or None.

    Without `own` the mission begins with the policy of the strategy.
    """

    def __init__(
        self,
        belief: Belief,
        order: MissionOrder,
        area: ExploredArea,
        strategy: Strategy,
        own: Replanning | None,
        observer: Observer,
    ) -> None:
        self._belief, self._order, self._area, self._observer = belief, order, area, observer
        self._homes = homes_of(belief.robots(), belief.kinds) if order.homes is None else order.homes
        with observer.analysis():
            own = own or strategy.replanning(*self._circumstances)
            self.now: Replanning = own or OnNews(*self._circumstances)
        self._usual = type(self.now) is OnNews
        self._recall = Recall(belief, belief.kinds, order.goal, order.limits.time_ms)
        self._covered = 0.0  # the coverage when it last was asked for, to see whether it is enough
        self.why: CallBack | None = None

    @property
    def _circumstances(self) -> tuple[Belief, Mapping[str, RobotType], Mapping[str, Cell], Goal]:
        return self._belief, self._belief.kinds, self._homes, self._order.goal

    def move(self, shift: FrameShift) -> None:
        """Re-index homes after the frame grew."""
        self._homes = shift.cells(self._homes)

    def update(self, news: News) -> None:
        """Show all news to the policy and the recall."""
        with self._observer.analysis():
            self.now.update(news)
        self._recall.update(news)

    def until(self, until_ms: int, busy_ms: int) -> int:
        """Return until when time may pass at most; the team's plan keeps it busy until `busy_ms`."""
        if self.why is not None or self.now.exploration_ms is not None:
            return until_ms
        return min(until_ms, max(self._belief.now_ms, self._recall.wake_ms(busy_ms)))

    def call_back(self, work: PlanProgress, planning_ms: int) -> bool:
        """Switch to the return policy if the team has to turn back now; return whether it has to."""
        # those called back for other reasons have no time to explore on
        if self.why not in (None, CallBack.IN_TIME):
            return False
        with self._observer.analysis():
            why = self._reason(work, planning_ms)
            if why is not None:
                self.why, self.now = why, ReturnPolicy(*self._circumstances)
        return why is not None

    def explore_alone(self) -> bool:
        """Let carriers use the time left, unless the team must be home; return whether they begin to."""
        # a strategy with a policy of its own is not overruled
        in_time = self.why is CallBack.IN_TIME and not self._order.goal.return_home
        if not in_time or not self._usual or isinstance(self.now, CarriersAlone):
            return False
        self.now = CarriersAlone(*self._circumstances)
        return True

    def unmet(self, goal: ReturnGoal, robots: Iterable[RobotReport], under_way: Set[str] = frozenset()) -> list[str]:
        """Return in words which parts of a goal these robots don't meet; see `ending.unmet`."""
        return unmet(goal, robots, self._belief.kinds, self._homes, under_way)

    def ending(self, under_way: Set[str], why: str = "") -> MissionEnding:
        """Return how the mission of a team that was called back ends; `why` explains a goal that is not met."""
        limits, left = self._order.limits, self.unmet(self._order.goal, self._belief.robots(), under_way)
        limit = f"time limit of {limits.time_ms / 1000:g} s"
        if self._belief.now_ms >= limits.time_ms:
            missing = "; ".join(filter(None, [", ".join(left), self._belief.no_go])) if left else ""
            return Status.TIME_LIMIT, ": ".join(filter(None, [f"{limit} reached", missing]))
        but = ": ".join(filter(None, [f", but {', '.join(left)}", why]))
        done = but if left else achieved(self._order.goal)
        if self.why is CallBack.BY_OPERATOR:
            return Status.CANCELLED, f"called back by the operator{done}"
        if self.why is CallBack.COVERED:
            status = Status.STALLED if left else Status.COMPLETE
            wanted, explored = f"{100 * limits.coverage:g} % are enough{done}", "are explored"
            coverage = self._area.coverage()
            if coverage < limits.coverage:  # zones have changed what counts
                coverage, explored = self._covered, "were explored when the team was called back"
            return status, f"{100 * coverage:.1f} % of the reachable area {explored}, {wanted}"
        return Status.TIME_LIMIT, f"called back before the {limit}{done}"

    def _reason(self, work: PlanProgress, planning_ms: int) -> CallBack | None:
        if self._order.called_back():
            return CallBack.BY_OPERATOR
        if self._order.limits.coverage < 1.0:
            self._covered = self._area.coverage()
            if self._covered >= self._order.limits.coverage:
                return CallBack.COVERED
        if self.why is None and self._recall.due(self._homes, work, planning_ms):
            return CallBack.IN_TIME
        return None


class ReturnPolicy(Lookout):
    """Replans for a returning team: after setbacks and when a plan is finished. It ignores newly seen cells."""

    @property
    def wake_ms(self) -> int | None:
        return None  # newly seen cells need no look

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        return setbacks_in(news) or ((Trigger(Cause.CARRIED_OUT),) if work.idle else ())

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        return returning(self._surveyor, self._world, keep)

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        pass  # this policy compares no targets


class CarriersAlone(OnNews):
    """Lets carriers explore on without docking, once all rovers of a team that was called back are aboard."""

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        return self._surveyor.survey(self._world.robots(), self._world.now_ms, targets=self._targets(), docking=False)

    def _targets(self) -> tuple[Target, ...]:
        carriers = {name for name, kind in self._kinds.items() if kind.role is Role.CARRIER}
        return tuple(target for target in super()._targets() if not carriers.isdisjoint(target.viewpoints))

    def _note_explored(self, *, left: bool) -> None:
        pass  # targets that only rovers can explore may be left

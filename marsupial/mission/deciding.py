"""How a plan is made: survey -> briefing -> decision -> batteries -> verdict.

The loop takes a `survey` of what is believed and briefs the strategy (`briefing`), whose decision is then changed in
two cases (`decision`), which docs/own-strategy.md describes for authors of strategies:

- If no robot in contact would do anything while targets are left, a carrier drives to where a rover out of contact
  waits (`approach`), since nothing else will bring news of it.
- If robots have batteries, a valid plan is changed so that these suffice. The strategy plans without them, and need not
  know of them.

The `verdict` on the result is the checker's, which knows batteries. Targets move as the map grows, so each new survey
is matched with the one that gives the names in the current plan their meaning (`followed`).
"""

from collections.abc import Iterable
from dataclasses import replace

from marsupial.maps.survey import Survey
from marsupial.maps.targets import Target
from marsupial.mission.belief.belief import Belief
from marsupial.mission.carryover import carried_over, renamed, shifted
from marsupial.mission.executor import Executor
from marsupial.mission.observer import Observer
from marsupial.mission.policies import Policies
from marsupial.model import Action, FrameShift, MapMeeting, Plan, RobotReport, Role, Situation, SituationGoal, Triggers
from marsupial.model.strategy import Briefing, Decision, Reasons, Strategy, checked_decision
from marsupial.planning.batteries.repair import with_batteries
from marsupial.planning.checker import Verdict, check
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.charges import ChargedFirst, charged_first
from marsupial.planning.schedule.timeline import Timeline


class Deciding:
    """Makes the plans of one mission with a `strategy`."""

    def __init__(
        self, strategy: Strategy, belief: Belief, policies: Policies, executor: Executor, observer: Observer
    ) -> None:
        self.strategy = strategy
        self._belief, self._policies, self._executor, self._observer = belief, policies, executor, observer
        self._ranges = {k.name: k.sensor_range_m / belief.grid.resolution_m for k in belief.kinds.values()}
        self.followed: Survey | None = None  # the survey that the current plan was made from
        self.pending: tuple[Action, ...] = ()  # actions of a plan that is not adopted yet, as planning takes time
        self.meanwhile: Triggers = ()  # triggers of another plan that occurred while planning took time
        self.planning_ms = 0  # how long the last planning took, where that takes mission time
        self.curtailed = False  # whether batteries changed the last plan
        self.reasons = Reasons()  # of the last plan
        self._refuges: frozenset[str] = frozenset()  # meeting points at which rovers can be picked up in time

    def move(self, shift: FrameShift) -> None:
        """Re-index cells after the frame grew."""
        if self.followed is not None:
            self.followed = self.followed.moved(shift)
        self.reasons = Reasons()  # a guess has cells of the frame before

    @property
    def targets(self) -> tuple[Target, ...]:
        """The targets that the current plan knows."""
        return () if self.followed is None else self.followed.targets

    @property
    def meetings(self) -> tuple[MapMeeting, ...]:
        """The meeting points that the current plan knows."""
        return () if self.followed is None else self.followed.meetings

    def survey(self, *, late: bool = False) -> Survey:
        """Return the current survey, with the meeting points that the current plan and the pending one use."""
        used = {action.place for action in (*self._executor.remainder(), *self.pending)}
        used |= {*self._executor.deployed_at.values(), *self._refuges}
        keep = [point for point in self.meetings if point.name in used]
        with self._observer.analysis():
            return self._policies.now.survey(self._executor, keep, late=late)

    def briefing(self, survey: Survey) -> Briefing:
        """Return what the strategy is told."""
        situation = survey.situation.without_batteries()
        return Briefing(
            situation=situation,
            previous=self._carried_over(self._executor.remainder(), situation, survey),
            direct_ms=survey.direct_ms,
            unseen=survey.unseen,
            connects=survey.connects,
            charged=survey.situation if survey.situation.batteries else None,
            deployed_at={
                rover: name
                for rover, name in self._executor.deployed_at.items()
                if name in situation.meetings and rover in situation.robot_by_name
            },
        )

    def decision(self, survey: Survey, decided: object) -> Decision:
        """Return a strategy's decision, changed as described above; UsageError if it is of a wrong type."""
        situation = survey.situation.without_batteries()
        decision = checked_decision(self.strategy.name, decided)
        if self._policies.now.exploration_ms is None and not self.acts(decision.plan):
            decision = replace(decision, plan=approach(situation, self._belief.unheard()))
        if survey.situation.batteries and self.verdict(situation, decision.plan).valid:
            plan, self._refuges = with_batteries(survey.situation, decision.plan)
            self.curtailed = plan != decision.plan
            decision = replace(decision, plan=plan)
            if not plan.actions and (left := sorted(serve(situation)[0].explored)):
                report = replace(decision.report, detail=f"no battery suffices for {', '.join(left)}")
                decision = replace(decision, report=report)
        self._observer.planned(decision.report)
        self.reasons = decision.reasons
        return decision

    def fitted(self, survey: Survey) -> Plan:
        """Return the part of the pending plan that is still possible after planning has taken time."""
        physical = replace(survey.situation.without_batteries(), goal=SituationGoal())
        plan, self.pending = self._carried_over(self.pending, physical, survey) or Plan(actions=()), ()
        plan, self._refuges = with_batteries(survey.situation, plan)
        return plan

    def from_now(self, survey: Survey, plan: Plan) -> tuple[Plan, ChargedFirst]:
        """Return a plan with absolute times, and before which of its actions robots have to charge."""
        first, dated = charged_first(survey.situation, plan), shifted(plan, self._belief.now_ms)
        return dated, {new: first[old] for old, new in zip(plan.actions, dated.actions, strict=True) if old in first}

    def acts(self, plan: Plan) -> bool:
        """Return whether robots in contact do something, in this plan or still."""
        away = {robot.name for robot in self._belief.robots() if robot.away is not None}
        return self._executor.acts or any(not away.issuperset(action.robots) for action in plan.actions)

    @staticmethod
    def verdict(situation: Situation, plan: Plan) -> Verdict:
        """Return whether a plan can be carried out; it need not reach the goal, as a later replanning can."""
        return check(replace(situation, goal=SituationGoal()), plan, targets=plan.explored)

    def _carried_over(self, actions: tuple[Action, ...], situation: Situation, survey: Survey) -> Plan | None:
        return carried_over(actions, situation, renamed(self.targets, survey.targets, self._ranges))


def approach(situation: Situation, rovers: Iterable[RobotReport]) -> Plan:
    """Return the drive that brings a carrier to where one of these rovers waits; empty if none can.

    Rovers that were sent to targets come first, then the one that can be met soonest.
    """
    timeline, options = Timeline.of(situation), []
    for report in (report for report in rovers if not report.lost):
        rover = situation.robot_by_name[report.name]
        for carrier in situation.of_role(Role.CARRIER):
            for place in situation.meetings if rover.place and carrier.place else ():
                its = situation.travel(rover.type, str(rover.place), place)
                ours = situation.travel(carrier.type, str(carrier.place), place)
                if its is not None and ours:
                    meet_ms = max(rover.free_at_ms + its, carrier.free_at_ms + ours)
                    options.append((not report.away, meet_ms, carrier.name, place))
    if options:
        timeline.move(*min(options)[2:])
    return timeline.plan

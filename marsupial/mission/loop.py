"""The closed loop of a mission: sense, survey, decide, check, act, until the mission ends.

`MissionLoop` connects a world and a strategy, which it knows by their protocols, with what is its own: what is believed
(`Belief`), when to replan (`Policies`), how plans are made (`Deciding`) and carried out (`Executor`), and when to wait
(`Patience`). It replans when news could change the plan. Time alone triggers a new plan only when the team must be
called back, or when a wait has lasted too long.

::

                      +---------------- run() ------------------------------------------+
                      |                                                                 |
      triggers? --yes--> _replan: survey -> strategy.decide -> verdict -> _adopt        |
                      |      (goal met -> COMPLETE, no action possible -> STALLED)      |
                      v                                                                 |
              executor.start_due: command every robot whose next action is ready        |
                      |      (no route -> trigger WAY_BLOCKED)                          |
                      v                                                                 |
              belief.advance: let time pass until the next event                        |
                      v                                                                 |
              _apply(news): log it, update map, policy and executor                     |
                      |                                                                 |
              policy.look(news): does the news ask for a new plan? -- triggers ---------+

With *charged* planning time the clock runs while the strategy computes: robots continue the old plan's drives, then the
new plan is fitted to a second survey. The loop can't run for ever: time is limited, and replannings that follow each
other at one moment are counted (`Rounds`).
"""

from collections.abc import Callable, Generator, Mapping

from marsupial.maps.lookout import setbacks_in
from marsupial.maps.survey import Survey
from marsupial.mission.belief.belief import Belief
from marsupial.mission.blocked import gone_astray, stop_blocked
from marsupial.mission.deciding import Deciding
from marsupial.mission.ending import MissionEnding, explored, needed_lost
from marsupial.mission.executor import Executor
from marsupial.mission.goals import MissionOrder
from marsupial.mission.journal import MissionJournal
from marsupial.mission.measures import Measures
from marsupial.mission.observer import Observer
from marsupial.mission.patience import MAX_FRUITLESS, Patience
from marsupial.mission.policies import CallBack, Policies
from marsupial.mission.replanning import Replanning
from marsupial.model import Action, News, Plan, RobotType, World
from marsupial.model.mission import Cause, MissionEnded, Status, Trigger, Triggers
from marsupial.model.scenario import PlanningTime
from marsupial.model.strategy import Briefing, Decider, Decision, as_strategy


class MissionLoop:
    """One mission of a team in a world.

    `kinds` has the robot types by name; `strategy` is a `Strategy` or any object with `name` and `decide`. Without
    `replanning` the strategy's own policy decides when to replan, or else `OnNews`.
    """

    def __init__(
        self,
        world: World,
        kinds: Mapping[str, RobotType],
        strategy: Decider,
        order: MissionOrder,
        observer: Observer,
        replanning: Replanning | None = None,
    ) -> None:
        self._order, self._observer = order, observer
        self._belief = Belief(world, kinds, order.zones, lambda kind, a, b: self._policies.now.route(kind, a, b, None))
        self._measures = Measures(self._belief, order.reachable)
        leader = as_strategy(strategy)
        self._policies = Policies(self._belief, order, self._measures.area, leader, replanning, observer)
        self._executor = Executor(self._belief, world.robots, lambda *way: self._policies.now.route(*way), observer)
        self._deciding = Deciding(leader, self._belief, self._policies, self._executor, observer)
        self._journal = MissionJournal(self._belief, observer)
        self._patience = Patience(self._belief, order, self._policies, self._executor, observer)
        self._is_cancelled: Callable[[], bool] = lambda: False

    def run(self, cancelled: Callable[[], bool] | None = None) -> MissionEnded:
        """Run until the mission ends; `cancelled` is called between events."""
        turns, decision = self.turns(cancelled), None
        while True:
            try:
                briefing = turns.send(decision)
            except StopIteration as end:
                ended: MissionEnded = end.value
                return ended
            decision = self._deciding.strategy.decide(briefing)

    def turns(self, cancelled: Callable[[], bool] | None = None) -> Generator[Briefing, object, MissionEnded]:
        """Run until the mission ends, as `run`, but yield each briefing and take the decision that is sent for it."""
        triggers: Triggers = (Trigger(Cause.START),)
        self._is_cancelled = cancelled or self._is_cancelled
        self._apply(self._belief.advance(0))  # what robots see from their starts
        while True:
            if self._is_cancelled():
                return self._end(Status.CANCELLED, "cancelled")
            if triggers and (self._policies.why is CallBack.BY_OPERATOR or self._patience.ready()):
                ended = self._patience.over((yield from self._replan_or_release(triggers)))
                if ended is not None:
                    return self._end(*ended)
                if self._is_cancelled():  # while planning time passed
                    continue
            explores = self._policies.now.exploration_ms is None or self._patience.waits
            if explores and self._policies.call_back(self._executor, self._deciding.planning_ms):
                triggers = (Trigger(Cause.CALLED_BACK),)
                continue
            if blocked := self._executor.start_due():
                triggers = (Trigger(Cause.WAY_BLOCKED, blocked),)
                continue
            if self._belief.now_ms >= self._order.limits.time_ms:
                return self._end(*self._policies.ending(self._executor.under_way))
            triggers = self._planning_triggers() or self._advance()

    def _replan_or_release(self, triggers: Triggers) -> Generator[Briefing, object, MissionEnding | None]:
        """Replan; before the mission ends, try again with flickering cells as they are reported."""
        while (ended := (yield from self._replan(triggers))) is not None and ended[0] is not Status.FAILED:
            if (news := self._belief.release()) is None:
                break
            with self._observer.analysis():
                self._policies.now.update(news)
        return ended

    def _replan(self, triggers: Triggers) -> Generator[Briefing, object, MissionEnding | None]:
        """Make a new plan and follow it; return how the mission ends if it does."""
        belief, policies = self._belief, self._policies
        able = [robot for robot in belief.robots() if not robot.lost]
        if not able:
            return Status.FAILED, "every robot is lost"
        survey = self._deciding.survey()
        if self._patience.waits_for_map:
            return None
        if not (policies.unmet(survey.situation.goal, able) or self._patience.runs):
            if policies.why is not None:
                survey = self._deciding.survey() if policies.explore_alone() else survey
                if not survey.targets:
                    return policies.ending(self._executor.under_way)
            elif policies.now.exploration_ms is not None:
                left = policies.unmet(self._order.goal, belief.robots(), self._executor.under_way)
                return explored(self._order.goal, policies.now.explored, left, needed_lost(belief, self._order.goal))
        fruitless = self._patience.rounds.begin(belief.now_ms)
        if fruitless > MAX_FRUITLESS:
            why = ", as batteries allow no more" if self._deciding.curtailed else ""
            return self._patience.stalled(survey, f"no progress after {fruitless} replannings{why}")
        decided = yield self._deciding.briefing(survey)
        return self._follow(triggers, survey, self._deciding.decision(survey, decided))

    def _follow(self, triggers: Triggers, survey: Survey, decision: Decision) -> MissionEnding | None:
        verdict = self._deciding.verdict(survey.situation, decision.plan)
        if not verdict.valid:
            self._measures.refused += 1
            return Status.FAILED, f"strategy {self._deciding.strategy.name} made an invalid plan: {verdict.violation}"
        stalled = not (self._deciding.acts(decision.plan) or self._patience.expects_news)
        if self._order.planning_time is PlanningTime.CHARGED:
            self._deciding.planning_ms = round(decision.report.wall_s * 1000)
            self._adopt_after_planning(triggers, survey, decision.plan)
        else:
            self._adopt(triggers, survey, decision.plan)
        if stalled:
            return self._patience.stalled(survey, decision.report.detail or "the strategy found no action")
        return None

    def _adopt_after_planning(self, triggers: Triggers, survey: Survey, plan: Plan) -> None:
        """Let the planning time pass while robots drive as planned before; then follow what is possible of a plan."""
        deciding, belief = self._deciding, self._belief
        deciding.followed, deciding.pending = survey, plan.actions
        until = min(belief.now_ms + deciding.planning_ms, self._order.limits.time_ms)
        while belief.now_ms < until and not self._is_cancelled():
            self._executor.start_due(drives_only=True)
            news = belief.advance(until)
            _, changes = self._apply(news)
            deciding.meanwhile += stop_blocked(news, belief, self._executor) + changes + setbacks_in(news)
        if self._is_cancelled():
            return
        since = deciding.followed  # re-indexed if the map has grown
        later = deciding.survey(late=True)
        self._adopt(triggers, later, deciding.fitted(later))
        self._policies.now.follow(later, since=since)

    def _planning_triggers(self) -> Triggers:
        """Return the triggers that occurred during planning."""
        setbacks, self._deciding.meanwhile = self._deciding.meanwhile, ()
        if setbacks or self._patience.waits or self._patience.expects_news:
            return setbacks
        # the ends of drives that are known late, if at all, are not waited for
        unheard = not (self._order.plans_on_board or self._patience.runs or self._executor.remainder())
        return (Trigger(Cause.OVERTAKEN),) if self._executor.idle or unheard else ()

    def _adopt(self, triggers: Triggers, survey: Survey, plan: Plan) -> None:
        """Command the robots to follow a plan."""
        revision = self._executor.revision + 1
        self._patience.rounds.planned(self._belief.now_ms)
        self._deciding.followed = survey
        self._policies.now.follow(survey)
        plan, charged = self._deciding.from_now(survey, plan)
        self._journal.planned(revision, triggers, survey, plan, self._deciding.reasons)
        self._executor.adopt(plan, survey.poses, revision, charged)

    def _advance(self) -> Triggers:
        """Let time pass until something happens; return the triggers of a new plan."""
        news = self._belief.advance(self._patience.until())
        done, changes = self._apply(news)
        triggers = stop_blocked(news, self._belief, self._executor)
        with self._observer.analysis():
            if (given_up := self._belief.give_up(news)) is not None:
                self._policies.now.update(given_up)
            triggers += gone_astray(news, self._belief) + changes
            triggers += self._policies.now.look(news, done, self._executor)
        return self._patience.after(triggers, news)

    def _apply(self, news: News) -> tuple[tuple[Action, ...], Triggers]:
        """Apply news; return finished actions, and triggers for what the plan does not know."""
        reported = self._belief.reported
        self._journal.heard(news)
        for name in news.in_contact:
            self._executor.meet(name)
        if news.moved is not None:
            for part in (self._measures.area, self._policies, self._deciding, self._executor):
                part.move(news.moved)
        self._measures.update(news)
        self._policies.update(news)
        self._patience.rounds.update(news)
        failed = self._executor.failed(name for name, _ in (*reported.failed, *reported.declined))
        self._journal.lost(news)
        self._executor.lost(name for name, _ in reported.lost)
        self._journal.returned(news)
        done = self._executor.finished(reported.finished)
        if self._order.waits:  # a simulated look shows all that it ever will
            self._belief.looks.add_looks(self._deciding.targets, failed, done)
            self._belief.looks.add_stops(news)
        zones = tuple(dict.fromkeys(change.name for change in news.zones))
        changes = {Cause.ZONES: zones, Cause.PARTED: self._part(news) if news.out_of_contact else ()}
        return done, tuple(Trigger(cause, names) for cause, names in changes.items() if names)

    def _part(self, news: News) -> tuple[str, ...]:
        """Note where rovers that are out of contact now will wait; return those that drop the rest of the plan."""
        holds_plan, targets = self._order.plans_on_board, self._deciding.targets
        left = () if holds_plan else self._executor.remainder()
        places = [point.name for point in self._deciding.meetings] if holds_plan else []
        for name in news.out_of_contact:
            returns = holds_plan or name in news.returning
            with self._observer.analysis():
                routes, explores = self._executor.part(name, places, holds_plan=holds_plan, returns=returns)
            self._journal.parted(self._belief.expect(name, routes, explores, targets))
        return tuple(name for name in news.out_of_contact if any(name in action.robots for action in left))

    def _end(self, status: Status, reason: str) -> MissionEnded:
        ended = self._measures.ended(status, reason, self._policies.now, self._executor, self._order)
        self._observer.event(ended)
        return ended

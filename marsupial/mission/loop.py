"""The closed loop of a mission: sense, survey, decide, check, act, until the mission ends.

`MissionLoop` connects a world, a strategy and a replanning policy, which it knows by their protocols. It changes plans
itself so that batteries suffice, and where rovers that nothing is heard from have to be looked for. Every plan is
checked before robots follow it. The loop replans when news could change the plan. Time alone triggers a new plan only
when the team must be called back, or when a wait has lasted too long (`Patience`).

How it works
------------
::

                      +---------------- run() ------------------------------------------+
                      |                                                                 |
      triggers? --yes--> _replan: survey -> strategy.decide -> checker -> _adopt        |
                      |      (goal met -> COMPLETE, no action possible -> STALLED)      |
                      v                                                                 |
              executor.start_due: command every robot whose next action is ready        |
                      |      (no route -> trigger WAY_BLOCKED)                          |
                      v                                                                 |
              world.advance: let time pass until the next event                         |
                      |                                                                 |
                      v                                                                 |
              _apply(news): log it, update map, policy and executor                     |
                      |                                                                 |
              policy.look(news): does the news ask for a new plan? -- triggers ---------+

One turn of the loop handles one moment of mission time. Three parts of the state decide what follows:

- The *replanning policy* (`marsupial.mission.replanning`) decides which news triggers a new plan, and which survey the
  plan is made from. It starts as the strategy's own policy or `OnNews`. Once the time left is only just enough for the
  way back, the team is called back: `ReturnPolicy`, which ignores what is left to explore, replaces the policy. So it
  is when enough is explored, or when an operator calls the team back. If time remains once all rovers are aboard of a
  team that was called back in time, carriers explore on alone (`CarriersAlone`), unless the team has to be home or the
  strategy has a policy of its own.
- The *followed survey* gives the names in the current plan their meaning. Targets move as the map grows, so each new
  survey is matched with it (`_renamed`), and the rest of the plan is carried over under the new names.
- With *charged* planning time (`PlanningTime.CHARGED`) the clock runs while the strategy computes: robots continue the
  old plan's drives, then the new plan is fitted to a second survey (`_adopt_after_planning`). Anything that went wrong
  in between triggers another replanning at once.

Plans are made from what is believed (`marsupial.mission.belief`): a filtered map with the zones of operators, and rovers
out of contact where they are expected. The log holds the map as it is reported, and a mission that is about to end first
replans without the filter of flickering cells. The executor is on board: it learns what happens to rovers out of contact
at once, the rest of the loop when they are in contact again. Robots that get one command at a time
(`MissionOrder.plans_on_board`) carry out their last one; its end may be reported late.

The loop can't run for ever: time is limited, and replannings that follow each other at one moment are counted
(`Rounds`). It prints and writes nothing: it reports everything to the observer as events (`marsupial.model.mission`).
"""

from collections import Counter
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import replace
from functools import partial

from marsupial.maps.lookout import setbacks_in
from marsupial.maps.survey import Survey
from marsupial.mission.belief.belief import Belief
from marsupial.mission.belief.radio import approach
from marsupial.mission.belief.zones import BARRED
from marsupial.mission.blocked import gone_astray, stop_blocked
from marsupial.mission.carryover import carried_over, renamed, shifted
from marsupial.mission.ending import Ending, absent, explored, needed_lost, unmet
from marsupial.mission.executor import Executor
from marsupial.mission.goals import ExploredArea, MissionOrder, homes_of
from marsupial.mission.journal import events_of
from marsupial.mission.observer import Observer
from marsupial.mission.patience import Patience, Rounds, why_stalled
from marsupial.mission.recall import CallBack, CarriersAlone, ReturnPolicy, TeamReturn
from marsupial.mission.replanning import OnNews, Replanning
from marsupial.model import Action, FrameShift, Plan, RobotType, Situation, SituationGoal
from marsupial.model import mission as log
from marsupial.model.mission import Cause, Status, Trigger, Triggers
from marsupial.model.scenario import PlanningTime
from marsupial.model.strategy import Briefing, Decider, Decision, as_strategy, checked_decision
from marsupial.model.world import News, World, energy_j
from marsupial.planning.batteries.repair import with_batteries
from marsupial.planning.checker import Verdict, check
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.charges import charged_first

MAX_FRUITLESS = 5  # replannings without effect at one moment; the next one ends the mission as stalled


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
        on_board = world.robots
        self._world = world = Belief(
            world, kinds, order.zones, lambda kind, start, goal: self._replanning.route(kind, start, goal, None)
        )
        self._kinds = kinds
        self._strategy = as_strategy(strategy)
        self._order = order
        self._observer = observer
        self._homes = homes_of(world.robots(), kinds) if order.homes is None else order.homes
        self._area = ExploredArea(world.world, world, order.reachable)
        circumstances = world, kinds, self._homes, order.goal
        with self._observer.analysis():
            own = replanning or self._strategy.replanning(*circumstances)
            self._replanning: Replanning = own or OnNews(*circumstances)
        self._on_news = type(self._replanning) is OnNews
        self._executor = Executor(world, on_board, lambda *ends: self._replanning.route(*ends), observer)
        self._ranges = {k.name: k.sensor_range_m / world.grid.resolution_m for k in kinds.values()}
        self._followed: Survey | None = None  # the survey that the current plan was made from
        self._lost_ms: dict[str, int] = {}  # when the robots that are lost were, also those out of contact
        self._off_ms = Counter[str]()  # how long robots were lost before
        self._revision = 0
        self._rounds = Rounds()
        self._vain = world.looks
        self._return = TeamReturn(world, kinds, order, self._area)
        self._needed_lost = partial(needed_lost, world, kinds, order.goal)
        self._planning_ms = self._busy_ms = 0
        self._patience = Patience(world, kinds, observer, may_wait=order.waits)
        self._pending: tuple[Action, ...] = ()  # actions of a plan that is not adopted yet
        self._refused = 0
        self._refuges: frozenset[str] = frozenset()  # meeting points at which rovers can be picked up in time
        self._curtailed = False  # whether batteries changed the last plan
        self._triggers_while_planning: Triggers = ()
        self._dropped: tuple[str, ...] = ()  # rovers that have just parted, and do not carry out the rest of the plan
        self._is_cancelled: Callable[[], bool] = lambda: False

    def run(self, cancelled: Callable[[], bool] | None = None) -> log.MissionEnded:
        """Run until the mission ends; `cancelled` is called between events."""
        turns, decision = self.turns(cancelled), None
        while True:
            try:
                briefing = turns.send(decision)
            except StopIteration as end:
                ended: log.MissionEnded = end.value
                return ended
            decision = self._strategy.decide(briefing)

    def turns(self, cancelled: Callable[[], bool] | None = None) -> Generator[Briefing, object, log.MissionEnded]:
        """Run until the mission ends, as `run`, but yield each briefing and take the decision that is sent for it."""
        triggers: Triggers = (Trigger(Cause.START),)
        self._is_cancelled = cancelled or self._is_cancelled
        self._apply(self._world.advance(0))  # what robots see from their starts
        while True:
            if self._is_cancelled():
                return self._end(Status.CANCELLED, "cancelled")
            if triggers and (self._return.why is CallBack.BY_OPERATOR or self._patience.ready()):
                ended = self._patience.over((yield from self._replan_or_release(triggers)))
                if ended is not None:
                    return self._end(*ended)
                if self._is_cancelled():  # while planning time passed
                    continue
            if self._call_back():
                triggers = (Trigger(Cause.CALLED_BACK),)
                continue
            blocked = self._executor.start_due()
            if blocked:
                triggers = (Trigger(Cause.WAY_BLOCKED, blocked),)
                continue
            if self._world.now_ms >= self._order.limits.time_ms:
                return self._end(*self._returned())
            triggers = self._planning_triggers() or self._advance()

    def _call_back(self) -> bool:
        """Switch to the return policy when the team has to return; return whether it switched."""
        if self._replanning.exploration_ms is not None and not self._patience.waits:
            return False
        with self._observer.analysis():
            begins = self._return.begins(self._homes, self._executor, self._planning_ms)
            if begins:
                self._replanning = ReturnPolicy(self._world, self._kinds, self._homes, self._order.goal)
        return begins

    def _explore_with_carriers(self, survey: Survey) -> Survey:
        """Let carriers use the time left, unless the team must be home; return their survey."""
        # a strategy with a policy of its own is not overruled
        in_time = self._return.why is CallBack.IN_TIME and not self._order.goal.return_home
        if not in_time or not self._on_news or isinstance(self._replanning, CarriersAlone):
            return survey
        self._replanning = CarriersAlone(self._world, self._kinds, self._homes, self._order.goal)
        return self._survey()

    def _returned(self, why: str = "") -> Ending:
        """Return how the mission of a team that was called back ends; `why` explains a goal that is not met."""
        return self._return.ending(self._unmet(), self._world.no_go, why)

    def _unmet(self) -> list[str]:
        """Return which parts of the goal are not met, those of lost robots included."""
        return unmet(self._order.goal, self._world.robots(), self._kinds, self._homes, self._executor.under_way)

    def _advance(self) -> Triggers:
        """Let time pass until something happens; return the triggers of a new plan."""
        until, wake_ms = self._order.limits.time_ms, self._replanning.wake_ms
        if self._return.why is None and self._replanning.exploration_ms is None:
            until = min(until, max(self._world.now_ms, self._return.wake_ms(self._busy_ms)))
        if self._patience.waits:
            wake_ms = self._patience.wake_ms
        wake_ms = None if self._waits_for_map else wake_ms
        late_ms = self._late_ms if self._executor.idle else None
        moments = (self._vain.wake_ms, late_ms, self._executor.ready_ms)
        until = min([until, *(t_ms for t_ms in moments if t_ms is not None)])
        if wake_ms is not None:
            until = min(until, max(self._world.now_ms, wake_ms))
        news = self._world.advance(until)
        done = self._apply(news)
        blocked = stop_blocked(news, self._world, self._kinds, self._executor)
        with self._observer.analysis():
            self._give_up(news)
            triggers = blocked + gone_astray(news, self._world, self._kinds)
            triggers += self._changes_in(news) + self._replanning.look(news, done, self._executor)
        return self._patience.after(triggers, news)

    def _give_up(self, news: News) -> None:
        """Give up what looks do not reveal, and take it up again when it changes."""
        changes = self._world.give_up(news)
        if changes is not None:
            self._replanning.update(changes)

    def _changes_in(self, news: News) -> Triggers:
        """Return the triggers for zones that changed, and for rovers that do not carry out the plan any more."""
        changes = {
            Cause.ZONES: tuple(dict.fromkeys(change.name for change in news.zones)),
            Cause.PARTED: self._dropped,
        }
        return tuple(Trigger(cause, names) for cause, names in changes.items() if names)

    def _apply(self, news: News) -> tuple[Action, ...]:
        """Apply news; return finished actions."""
        on_board = self._world.reported
        for name, _ in on_board.lost:
            self._lost_ms.setdefault(name, news.t_ms)
        for name in on_board.returned:
            self._off_ms[name] += news.t_ms - self._lost_ms.pop(name, news.t_ms)
        for name in news.in_contact:
            self._observer.event(log.ContactRegained(t_ms=news.t_ms, robot=name))
            self._executor.meet(name)
        if news.moved is not None:
            self._grow_frame(news.moved)
        self._area.update(news)
        with self._observer.analysis():
            self._replanning.update(news)
        for event in events_of(news, on_board, self._world.world.grid):
            self._observer.event(event)
        self._rounds.update(news)
        self._return.update(news)
        failed = self._executor.failed(name for name, _ in (*on_board.failed, *on_board.declined))
        for name, reason in news.lost:
            self._observer.event(log.RobotLost(t_ms=news.t_ms, robot=name, reason=reason))
        self._executor.lost(name for name, _ in on_board.lost)
        for name in news.returned:
            self._observer.event(log.RobotReturned(t_ms=news.t_ms, robot=name))
        done = self._executor.finished(on_board.finished)
        if self._followed is not None and self._order.waits:  # a simulated look shows all that it ever will
            self._vain.add_looks(self._followed.targets, failed, done)
            self._vain.add_stops(news)
        left = self._executor.remainder() if news.out_of_contact and not self._order.plans_on_board else ()
        self._dropped = tuple(name for name in news.out_of_contact if any(name in action.robots for action in left))
        for name in news.out_of_contact:
            self._part(name, returns=self._order.plans_on_board or name in news.returning)
        return done

    def _part(self, name: str, *, returns: bool) -> None:
        """Note where a rover that is out of contact now will wait."""
        holds_plan = self._order.plans_on_board
        meetings = self._followed.meetings if self._followed is not None and holds_plan else ()
        with self._observer.analysis():
            places = [point.name for point in meetings]
            routes, explores = self._executor.part(name, places, holds_plan=holds_plan, returns=returns)
        targets = () if self._followed is None else self._followed.targets
        robot = self._world.expect(name, routes, explores, targets)
        assert robot.cell is not None, "rovers aboard are in contact"
        self._observer.event(
            log.ContactLost(
                t_ms=self._world.now_ms, robot=name, cell=robot.cell, wait_ms=robot.free_at_ms, targets=explores
            )
        )

    def _grow_frame(self, shift: FrameShift) -> None:
        grid = self._world.grid
        self._observer.event(
            log.FrameGrown(
                t_ms=self._world.now_ms, width=grid.width, height=grid.height, origin_m=grid.origin_m, shift=shift.by
            )
        )
        self._homes = shift.cells(self._homes)
        self._area.move(shift)
        if self._followed is not None:
            self._followed = self._followed.moved(shift)
        self._pending = tuple(map(shift.action, self._pending))
        self._refuges = frozenset(map(shift.place, self._refuges))
        self._executor.move(shift)

    def _replan_or_release(self, triggers: Triggers) -> Generator[Briefing, object, Ending | None]:
        """Replan; before the mission ends, try again with flickering cells as they are reported."""
        while (ended := (yield from self._replan(triggers))) is not None and ended[0] is not Status.FAILED:
            news = self._world.release()
            if news is None:
                break
            with self._observer.analysis():
                self._replanning.update(news)
        return ended

    def _replan(self, triggers: Triggers) -> Generator[Briefing, object, Ending | None]:
        """Make a new plan and follow it; return how the mission ends if it does."""
        if all(robot.lost for robot in self._world.robots()):
            return Status.FAILED, "every robot is lost"
        survey = self._survey()
        if self._waits_for_map:
            return None
        able = [robot for robot in self._world.robots() if not robot.lost]
        left = unmet(survey.situation.goal, able, self._kinds, self._homes)
        if not (left or self._runs):
            if self._return.why is not None:
                survey = self._explore_with_carriers(survey)
                if not survey.targets:
                    return self._returned()
            elif self._replanning.exploration_ms is not None:
                return explored(self._order.goal, self._replanning.explored, self._unmet(), self._needed_lost())
        fruitless = self._rounds.begin(self._world.now_ms)
        if fruitless > MAX_FRUITLESS:
            why = ", as batteries allow no more" if self._curtailed else ""
            return self._stalled(survey, f"no progress after {fruitless} replannings{why}")
        decided = yield self._briefing(survey)
        return self._follow(triggers, survey, self._decision(survey, decided))

    def _briefing(self, survey: Survey) -> Briefing:
        situation = survey.situation.without_batteries()
        return Briefing(
            situation=situation,
            previous=carried_over(self._executor.remainder(), situation, self._renamed(survey)),
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

    def _decision(self, survey: Survey, decided: object) -> Decision:
        """Return a strategy's decision, checked, and changed so that batteries suffice."""
        situation = survey.situation.without_batteries()
        decision = checked_decision(self._strategy.name, decided)
        if self._replanning.exploration_ms is None and not self._acts(decision.plan):
            decision = replace(decision, plan=approach(situation, self._world.unheard()))
        if survey.situation.batteries and self._verdict(situation, decision.plan).valid:
            plan, self._refuges = with_batteries(survey.situation, decision.plan)
            self._curtailed = plan != decision.plan
            decision = replace(decision, plan=plan)
            if not plan.actions and (left := sorted(serve(situation)[0].explored)):
                report = replace(decision.report, detail=f"no battery suffices for {', '.join(left)}")
                decision = replace(decision, report=report)
        self._observer.planned(decision.report)
        return decision

    @property
    def _rests(self) -> bool:
        """Whether cells rest that robots have stood beside, as the map may be late; a returning team does not wait."""
        return self._return.why is None and self._vain.wake_ms is not None

    @property
    def _late_ms(self) -> int | None:
        """Until when a map that may be late may still show the rest of a target, or None."""
        return self._vain.rest_comes_ms if self._order.waits else None

    @property
    def _waits_for_map(self) -> bool:
        """Whether nothing else is left to explore."""
        return self._rests and self._replanning.exploration_ms is not None

    @property
    def _runs(self) -> bool:
        """Whether an action runs, or may still run if its end is known late."""
        may_run = self._order.plans_on_board or self._world.awaits
        return self._executor.acts or (self._executor.running and may_run)

    def _acts(self, plan: Plan) -> bool:
        """Return whether robots in contact do something, in this plan or still."""
        away = {robot.name for robot in self._world.robots() if robot.away is not None}
        return self._executor.acts or any(not away.issuperset(action.robots) for action in plan.actions)

    def _verdict(self, situation: Situation, plan: Plan) -> Verdict:
        """Return whether a plan can be carried out; it need not reach the goal, as a later replanning can."""
        return check(replace(situation, goal=SituationGoal()), plan, targets=plan.explored)

    def _follow(self, triggers: Triggers, survey: Survey, decision: Decision) -> Ending | None:
        verdict = self._verdict(survey.situation, decision.plan)
        if not verdict.valid:
            self._refused += 1
            return Status.FAILED, f"strategy {self._strategy.name} made an invalid plan: {verdict.violation}"
        stalled = not (self._acts(decision.plan) or self._world.awaits or self._rests or self._late_ms is not None)
        if self._order.planning_time is PlanningTime.CHARGED:
            self._planning_ms = round(decision.report.wall_s * 1000)
            self._adopt_after_planning(triggers, survey, decision.plan.actions)
        else:
            self._adopt(triggers, survey, decision.plan)
        if stalled:
            return self._stalled(survey, decision.report.detail or "the strategy found no action")
        return None

    def _stalled(self, survey: Survey, reason: str) -> Ending:
        """Return how the mission ends when no plan makes progress."""
        why = "; ".join(filter(None, [why_stalled(survey, self._world, reason), self._world.no_go]))
        return (Status.STALLED, why) if self._return.why is None else self._returned(why)

    def _adopt_after_planning(self, triggers: Triggers, survey: Survey, actions: tuple[Action, ...]) -> None:
        """Let the planning time pass, then follow the part of a plan that is still possible."""
        self._followed, self._pending = survey, actions
        self._continue_old_plan()
        if self._is_cancelled():
            return
        survey, pending = self._followed, self._pending  # re-indexed if the map has grown
        later = self._survey(pending, late=True)
        physical = replace(later.situation.without_batteries(), goal=SituationGoal())
        plan = carried_over(pending, physical, self._renamed(later))
        plan, self._refuges = with_batteries(later.situation, plan or Plan(actions=()))
        self._adopt(triggers, later, plan)
        self._replanning.follow(later, since=survey)

    def _planning_triggers(self) -> Triggers:
        """Return the triggers that occurred during planning."""
        setbacks, self._triggers_while_planning = self._triggers_while_planning, ()
        waits = self._patience.waits or self._world.awaits or self._rests or self._late_ms is not None
        # the ends of drives that are known late, if at all, are not waited for
        unheard = not (self._order.plans_on_board or self._runs or self._executor.remainder())
        overtaken = not setbacks and (self._executor.idle or unheard) and not waits
        return (Trigger(Cause.OVERTAKEN),) if overtaken else setbacks

    def _adopt(self, triggers: Triggers, survey: Survey, plan: Plan) -> None:
        now = self._world.now_ms
        self._rounds.planned(now)
        self._revision += 1
        self._followed = survey
        self._replanning.follow(survey)
        first = charged_first(survey.situation, plan)
        before, plan = plan, shifted(plan, now)
        charged = {new: first[old] for old, new in zip(before.actions, plan.actions, strict=True) if old in first}
        self._busy_ms = plan.makespan_ms
        self._observer.event(
            log.Planned(
                t_ms=now,
                revision=self._revision,
                trigger=triggers,
                targets=tuple(target.on_map() for target in survey.targets),
                meetings=survey.meetings,
                actions=plan.actions,
                charges=tuple((r.name, round(r.charge, 3)) for r in self._world.robots() if r.charge is not None),
            )
        )
        self._executor.adopt(plan, survey.poses, self._revision, charged)

    def _continue_old_plan(self) -> None:
        """Let the planning time pass while robots drive as planned before; start no docking or undocking."""
        until = min(self._world.now_ms + self._planning_ms, self._order.limits.time_ms)
        while self._world.now_ms < until and not self._is_cancelled():
            self._executor.start_due(drives_only=True)
            news = self._world.advance(until)
            self._apply(news)
            blocked = stop_blocked(news, self._world, self._kinds, self._executor)
            self._triggers_while_planning += blocked + self._changes_in(news) + setbacks_in(news)

    def _survey(self, planned: Iterable[Action] = (), *, late: bool = False) -> Survey:
        """Return the current survey with the meeting points that the current plan or `planned` uses."""
        used = {action.place for action in (*self._executor.remainder(), *planned)}
        used |= {*self._executor.deployed_at.values(), *self._refuges}
        meetings = () if self._followed is None else self._followed.meetings
        keep = [point for point in meetings if point.name in used]
        with self._observer.analysis():
            return self._replanning.survey(self._executor, keep, late=late)

    def _renamed(self, survey: Survey) -> dict[str, str]:
        """Return the new names of the followed survey's targets that `survey` still has."""
        return renamed(() if self._followed is None else self._followed.targets, survey.targets, self._ranges)

    def _end(self, status: Status, reason: str) -> log.MissionEnded:
        robots = self._world.robots()
        for name, lost_ms in self._lost_ms.items():
            self._off_ms[name] += self._world.now_ms - lost_ms
        remaining = self._replanning.remaining(status, f"still open when the mission ended: {reason}")
        remaining += self._world.remaining()
        if status is Status.COMPLETE and any(left.reason == BARRED for left in remaining):
            reason = f"{reason}; {self._world.no_go}"
        if status is not Status.FAILED:
            reason = "; ".join([reason, *absent(robots, self._world.grid)])
        ended = log.MissionEnded(
            t_ms=self._world.now_ms,
            status=status,
            reason=reason,
            exploration_ms=None if self._needed_lost() else self._replanning.exploration_ms,
            **self._area.measures(self._world.now_ms),
            distance_m=tuple((r.name, round(self._world.distance_m(r.name), 3)) for r in robots),
            energy_j=energy_j(self._world, self._kinds, self._off_ms),
            deployments=self._executor.deployments.deployed,
            retrievals=self._executor.deployments.retrieved,
            replans=self._revision,
            plans_valid=self._revision,
            plans_invalid=self._refused,
            aboard=tuple(r.name for r in robots if r.carrier is not None and r.name not in self._executor.under_way),
            remaining=remaining,
            lost=tuple(robot.name for robot in robots if robot.lost),
            interference=None if self._order.interference is None else self._order.interference(),
        )
        self._observer.event(ended)
        return ended

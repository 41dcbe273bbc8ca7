"""Tamer (up-tamer): heuristic search for temporal plans, without a metric and without a time limit of its own.

It supports flat types only and is slow with numbers, so its problem is written out action by action, with propositions
only: no parameters, no static tables. The load of a carrier that could be overfull is counted by propositions, one per
level. Since Tamer takes no metric, each plan found is followed by a search for a plan that ends a tenth sooner.

References: Valentini, Micheli, Cimatti: Temporal planning with intermediate conditions and effects. AAAI 2020.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from itertools import product
from typing import TYPE_CHECKING, Any

from marsupial.model import Action, ActionName, EngineInfo, Finished, Outcome, Plan, Situation
from marsupial.planning.external.encodings import SearchRequest, Vocabulary
from marsupial.planning.external.process_engine import Finder, ProcessEngine, Requirement
from marsupial.planning.schedule.timeline import retime

if TYPE_CHECKING:
    from unified_planning.model import DurativeAction, FNode, Problem

WEIGHT = 0.9  # weight of the heuristic in weighted A*; at 0.5 and below no plan comes in useful time
SHRINK = 0.9  # largest makespan of the next plan, as a share of the best one's

INFO = EngineInfo(
    name="tamer",
    summary="heuristic search (up-tamer); small parts fast, no metric: asked again for shorter plans",
    licence="free for educational use",
    anytime=True,
)


def tamer(finder: Finder = find_spec) -> ProcessEngine:
    """Return the engine; `finder` looks up installed modules."""
    needs = (
        Requirement(module="unified_planning", distribution="unified-planning"),
        Requirement(module="up_tamer", distribution="up-tamer"),
        Requirement(module="pytamer", distribution="pytamer", no_wheels_from=(3, 14)),
    )
    return ProcessEngine(INFO, search, needs, preload=(load_tamer,), finder=finder)


def load_tamer() -> None:
    import up_tamer.engine  # noqa: F401


def search(request: SearchRequest) -> Iterator[Plan | Finished]:
    """Run Tamer in this process; yield plans, each shorter than the last, and its final status."""
    best: Plan | None = None
    below_ms = None if request.start is None else request.start.makespan_ms
    while True:
        encoding = TamerEncoding(request.situation, None if below_ms is None else int(SHRINK * below_ms))
        names = _ask(encoding.problem)
        if names is None:
            break
        plan = retime(request.situation, [encoding.actions[name] for name in names])
        if best is not None and plan.makespan_ms >= best.makespan_ms:
            break
        best, below_ms = plan, plan.makespan_ms
        yield plan
    if best is None:
        yield Finished(outcome=Outcome.NO_PLAN, detail="its search ended without a plan, which it doesn't call a proof")
    else:
        yield Finished(outcome=Outcome.SATISFICING, detail=f"found none that is done in {SHRINK:.0%} of the time")


def _ask(problem: Problem) -> list[str] | None:
    from unified_planning.environment import get_environment
    from up_tamer.engine import EngineImpl

    get_environment().credits_stream = None
    result = EngineImpl(weight=WEIGHT).solve(problem)
    # A result may say solved and have no plan in it: only the plan counts.
    if result.plan is None:
        return None
    return [instance.action.name for _, instance, _ in sorted(result.plan.timed_actions, key=lambda timed: timed[0])]


class TamerEncoding:
    """Tamer's problem, to be solved within `within_ms`, and the meaning of each of its actions.

    Actions are written one by one; propositions are created when first named.
    """

    def __init__(self, situation: Situation, within_ms: int | None = None) -> None:
        from unified_planning.model import Problem
        from unified_planning.model.timing import EndTiming, StartTiming

        self._words = Vocabulary(situation)
        self._situation = situation
        self.problem = Problem("situation")
        self.actions: dict[str, Action] = {}
        self._fluents: dict[tuple[Any, ...], Any] = {}
        self._before = self._words.predecessors()
        self._start, self._end = StartTiming(), EndTiming()
        for robot in situation.robots:
            for action in self._words.drives(robot):
                self._drive(action)
        for action in self._words.meets():
            self._meet(action)
        self._start_and_goal(within_ms)

    def _drive(self, action: Action) -> None:
        durative = self._durative(action)
        self._change(durative, self._is("at", action.robot, action.origin), self._is("at", action.robot, action.place))
        if action.name is ActionName.EXPLORE:
            self._change(durative, self._is("unexplored", action.place), self._is("explored", action.place))
        self.problem.add_action(durative)

    def _meet(self, action: Action) -> None:
        """Write a dock or undock, once for all loads that the carrier may have where its places are scarce."""
        robots = self._situation.robot_by_name
        scarce = self._words.scarce(robots[action.carrier or ""], robots[action.robot])
        for loads in product(*map(range, scarce.values())):
            self._meet_at(action, dict(zip(scarce, loads, strict=True)))

    def _meet_at(self, action: Action, loads: Mapping[str, int]) -> None:
        """Write a dock on a carrier with these loads, or an undock that leaves them."""
        durative = self._durative(action)
        ashore, aboard = self._is("at", action.robot, action.place), self._is("on", action.robot, action.carrier)
        here = self._is("at", action.carrier, action.place)
        self._change(durative, here, here)
        if action.name is ActionName.DOCK:
            self._change(durative, ashore, aboard)
        else:
            self._change(durative, aboard, ashore)
            self._keep_order(durative, action.robot)
        if self._situation.goal.aboard:
            durative.add_effect(self._end, self._is("recovered", action.robot), action.name is ActionName.DOCK)
        for group, load in loads.items():
            low, high = (self._is("load", action.carrier, group, n) for n in (load, load + 1))
            self._change(durative, *((low, high) if action.name is ActionName.DOCK else (high, low)))
        self.problem.add_action(durative)

    def _keep_order(self, durative: DurativeAction, rover: str) -> None:
        if rover in self._before:
            durative.add_condition(self._start, self._is("released", self._before[rover]))
        if rover in self._before.values():
            durative.add_effect(self._start, self._is("released", rover), True)

    def _start_and_goal(self, within_ms: int | None) -> None:
        for robot in self._situation.robots:
            where = ("at", robot.name, robot.place) if robot.carrier is None else ("on", robot.name, robot.carrier)
            self.problem.set_initial_value(self._is(*where), True)
        for carrier in self._words.carriers:
            for group in self._words.all_scarce(carrier):
                load = self._words.load(carrier, group)
                self.problem.set_initial_value(self._is("load", carrier.name, group, load), True)
        for rover in self._words.rovers if self._situation.goal.aboard else ():
            self.problem.set_initial_value(self._is("recovered", rover.name), rover.carrier is not None)
            self._wish(self._is("recovered", rover.name), within_ms)
        for target in self._situation.targets:
            self.problem.set_initial_value(self._is("unexplored", target.name), True)
            self._wish(self._is("explored", target.name), within_ms)
        for carrier in self._words.carriers:
            home = self._words.home(carrier)
            if home is not None:
                self._wish(self._is("at", carrier.name, home), within_ms)

    def _wish(self, goal: FNode, within_ms: int | None) -> None:
        from unified_planning.model.timing import GlobalStartTiming

        self.problem.add_goal(goal)
        if within_ms is not None:
            self.problem.add_timed_goal(GlobalStartTiming(within_ms), goal)

    def _durative(self, action: Action) -> DurativeAction:
        from unified_planning.model import DurativeAction

        name = f"a{len(self.actions)}"
        self.actions[name] = action
        durative = DurativeAction(name)
        durative.set_fixed_duration(action.duration_ms)
        return durative

    def _change(self, durative: DurativeAction, old: FNode, new: FNode) -> None:
        """Require and delete `old` at the start, add `new` at the end: in between no other action has either."""
        durative.add_condition(self._start, old)
        durative.add_effect(self._start, old, False)
        durative.add_effect(self._end, new, True)

    def _is(self, *fact: object) -> FNode:
        from unified_planning.model import Fluent

        if fact not in self._fluents:
            fluent = Fluent(f"f{len(self._fluents)}", environment=self.problem.environment)
            self.problem.add_fluent(fluent, default_initial_value=False)
            self._fluents[fact] = fluent()
        return self._fluents[fact]

"""marsupial's planners as an engine of the unified-planning library, for problems of marsupial's domain only.

Its `PDDLReader` makes such problems of ``pddl/domain.pddl`` and a problem of that domain. marsupial's planners know
what carriers and rovers do; they don't read actions, so they can't solve other domains.

A problem becomes PDDL text, which our own reader turns into a situation with all its checks; a plan becomes actions of
the problem again.
"""

from collections.abc import Iterator
from contextlib import closing
from fractions import Fraction
from typing import IO, Any

from unified_planning.engines import Engine, OptimalityGuarantee
from unified_planning.engines.mixins import AnytimePlannerMixin, OneshotPlannerMixin
from unified_planning.engines.mixins.anytime_planner import AnytimeGuarantee
from unified_planning.engines.results import PlanGenerationResult
from unified_planning.engines.results import PlanGenerationResultStatus as Status
from unified_planning.exceptions import UPUsageError
from unified_planning.io import PDDLReader
from unified_planning.model import ProblemKind
from unified_planning.plans import ActionInstance, TimeTriggeredPlan

from marsupial.errors import InvalidPlanError, SituationError
from marsupial.formats.pddl.domain import PLAIN, WITH_SEATS
from marsupial.formats.pddl.plansteps import steps_of
from marsupial.formats.pddl.text import domain_text, read_problem
from marsupial.library.plans import Plans
from marsupial.library.plans import plan as plans_for
from marsupial.library.up_registration import NAME
from marsupial.model import Outcome, Plan, Situation

DEFAULT_S = 10.0  # seconds to plan without a timeout

FEATURES = frozenset(
    {
        "ACTION_BASED", "CONTINUOUS_TIME", "DECREASE_EFFECTS", "FLAT_TYPING", "HIERARCHICAL_TYPING",
        "INCREASE_EFFECTS", "INT_FLUENTS", "INT_TYPE_DURATIONS", "MAKESPAN", "REAL_FLUENTS", "REAL_TYPE_DURATIONS",
        "SIMPLE_NUMERIC_PLANNING", "STATIC_FLUENTS_IN_DURATIONS", "UNDEFINED_INITIAL_NUMERIC",
    }
)  # fmt: skip
"""The features of the domain's problems by unified-planning's names."""

WITHOUT_PLAN = {
    Outcome.UNSOLVABLE: Status.UNSOLVABLE_PROVEN,
    Outcome.TIMEOUT: Status.TIMEOUT,
    Outcome.MEMORY: Status.MEMOUT,
    Outcome.UNSUPPORTED: Status.UNSUPPORTED_PROBLEM,
    Outcome.CRASHED: Status.INTERNAL_ERROR,
    Outcome.KILLED: Status.INTERNAL_ERROR,
}


class MarsupialEngine(Engine, OneshotPlannerMixin, AnytimePlannerMixin):
    """An engine for problems of marsupial's domain; it plans for a number of `steps`, or until the timeout if None."""

    def __init__(self, planner: str = "auto", steps: int | None = None) -> None:
        Engine.__init__(self)
        OneshotPlannerMixin.__init__(self)
        AnytimePlannerMixin.__init__(self)
        self._planner = planner
        self._steps = steps

    @property
    def name(self) -> str:
        return NAME

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Return the kind of the domain's problems; other problems of that kind are refused when they are solved."""
        return ProblemKind(FEATURES, version=3)

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        return bool(problem_kind <= MarsupialEngine.supported_kind())

    @staticmethod
    def satisfies(optimality_guarantee: OptimalityGuarantee) -> bool:
        return bool(optimality_guarantee == OptimalityGuarantee.SATISFICING)

    @staticmethod
    def ensures(anytime_guarantee: AnytimeGuarantee) -> bool:
        """Return whether plans have this guarantee; each is better than those before it."""
        return bool(anytime_guarantee == AnytimeGuarantee.INCREASING_QUALITY)

    def _solve(
        self, problem: Any, heuristic: Any = None, timeout: float | None = None, output_stream: IO[str] | None = None
    ) -> PlanGenerationResult:
        return list(self._get_solutions(problem, timeout, output_stream))[-1]

    def _get_solutions(
        self, problem: Any, timeout: float | None = None, output_stream: IO[str] | None = None
    ) -> Iterator[PlanGenerationResult]:
        """Yield each better plan, then the best again with what is proven about it, or the reason why there is none."""
        situation = situation_of_problem(problem)
        with closing(plans_for(situation, self._planner, timeout or DEFAULT_S, steps=self._steps)) as plans:
            for plan in plans:
                yield self._result(Status.INTERMEDIATE, to_up_plan(plan, problem, situation), plans)
        yield self._last(plans, problem)

    def _last(self, plans: Plans, problem: Any) -> PlanGenerationResult:
        outcome, best = plans.finished.outcome, plans.best
        if best is None:
            return self._result(WITHOUT_PLAN.get(outcome, Status.UNSOLVABLE_INCOMPLETELY), None, plans)
        optimal = outcome is Outcome.OPTIMAL and best.makespan_ms == plans.bound_ms
        status = Status.SOLVED_OPTIMALLY if optimal else Status.SOLVED_SATISFICING
        return self._result(status, to_up_plan(best, problem, plans.situation), plans)

    def _result(self, status: Status, plan: TimeTriggeredPlan | None, plans: Plans) -> PlanGenerationResult:
        metrics = {} if plans.best is None else {"makespan_s": f"{plans.best.makespan_ms / 1000:g}"}
        return PlanGenerationResult(status, plan, self.name, metrics)


def situation_of_problem(problem: Any) -> Situation:
    """Return the situation of a unified-planning problem; raise a `UPUsageError` if it is not of marsupial's domain."""
    # Compare whole actions, with conditions and effects: a domain may share only names with ours.
    domain = WITH_SEATS if any(fluent.name == "fits" for fluent in problem.fluents) else PLAIN
    ours = PDDLReader(problem.environment).parse_problem_string(domain_text(domain))
    if set(problem.actions) != set(ours.actions):
        raise UPUsageError("marsupial plans for problems of its own domain only: the actions of pddl/domain.pddl")
    facts = []
    for fact, value in problem.explicit_initial_values.items():
        if not value.is_bool_constant():
            facts.append(f"(= {_atom(fact)} {Fraction(value.constant_value())})")
        elif value.is_true():
            facts.append(_atom(fact))
    goals = [_atom(part) for goal in problem.goals for part in (goal.args if goal.is_and() else (goal,))]
    text = "\n".join(
        [
            f"(define (problem given) (:domain {domain}) (:objects",
            *(f"{each.name} - {each.type.name}" for each in problem.all_objects),
            ") (:init",
            *facts,
            f") (:goal (and {' '.join(goals)})))",
        ]
    )
    try:
        return read_problem(text)
    except SituationError as error:
        raise UPUsageError(f"not a problem of marsupial's domain: {error}") from error


def _atom(fact: Any) -> str:
    if not fact.is_fluent_exp():
        raise UPUsageError(f"not a problem of marsupial's domain, whose goals are facts: {fact}")
    return f"({' '.join([fact.fluent().name, *(str(arg) for arg in fact.args)])})"


def to_up_plan(plan: Plan, problem: Any, situation: Situation) -> TimeTriggeredPlan:
    """Return a plan as a time-triggered plan of `problem`; raise an `InvalidPlanError` if PDDL can't express it."""
    timed = []
    for step in steps_of(plan, situation):
        action, objects, text = problem.action(step.name), [], f"({' '.join((step.name, *step.args))})"
        for parameter, word in zip(action.parameters, step.args, strict=True):
            if not problem.has_object(word):
                raise InvalidPlanError(f"{text}: there is no {word}")
            objects.append(problem.object(word))
            if not parameter.type.is_compatible(objects[-1].type):
                raise InvalidPlanError(f"{text}: {word} is no {parameter.type.name}")
        args = tuple(problem.environment.expression_manager.ObjectExp(thing) for thing in objects)
        timed.append((step.start, ActionInstance(action, args), step.duration))
    return TimeTriggeredPlan(timed, problem.environment)

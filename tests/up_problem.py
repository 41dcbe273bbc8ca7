"""The canonical problem built for the unified-planning library, plans read back, and that library's verdict on a plan.

The problem is built directly from a situation and equals what the library reads from our PDDL text; times are exact
fractions of seconds. The library takes two seconds to import and prints credits: both are dealt with here, on first
use, so that nothing is paid by who doesn't ask.

The library's validator simulates a plan exactly: an action may start at any time after what it depends on, however
little, while ours asks for `EPSILON_MS` (in whole ms that is the same). It ignores the problem's epsilon. It refuses
two robots that finish exploring one target at the very same moment, which PDDL allows. It would raise an error for a
drive that has no `path_cost`, so `up_validate` gives it 0 for what is unknown; such a drive has no `path` either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from marsupial.errors import InvalidPlanError
from marsupial.formats.pddl.domain import FUNCTIONS, PREDICATES, SUPERTYPES
from marsupial.formats.pddl.facts import Fact, problem_facts
from marsupial.formats.pddl.names import encode_name
from marsupial.formats.pddl.plansteps import Step, reading_of
from marsupial.model.plan import Plan
from marsupial.model.situation import Situation


@dataclass(frozen=True, slots=True, kw_only=True)
class UpVerdict:
    """What unified-planning says of a plan; `detail` is why it is invalid, as far as it tells."""

    valid: bool
    detail: str = ""


def up_problem(situation: Situation, *, name: str = "exploration", records: bool = True) -> Any:
    """Return `situation` as a problem of unified-planning.

    It equals what its `PDDLReader` makes of our domain and `problem_text(situation, name=name, records=records)`.

    Parameters
    ----------
    name
        Name of the problem.
    records
        Whether to include the facts that no action reads.

    Raises
    ------
    SituationError
        If the situation can't be said in PDDL.
    """
    return _problem(situation, name, records, _library())


def from_up_plan(plan: Any, situation: Situation) -> Plan:
    """Return the plan that a time-triggered plan of the canonical problem means, in whole ms.

    Raises
    ------
    PlanTextError
        With every action that means nothing for `situation`.
    """
    steps = [
        Step(
            start=Fraction(start),
            name=instance.action.name,
            args=tuple(arg.object().name for arg in instance.actual_parameters),
            duration=None if duration is None else Fraction(duration),
            where=f"actions[{i}]",
        )
        for i, (start, instance, duration) in enumerate(plan.timed_actions)
    ]
    return reading_of(steps, situation).plan


def up_validate(situation: Situation, plan: Plan) -> UpVerdict:
    """Return what unified-planning's own validator says of `plan`, without our checker having a word in it.

    A plan that can't be said in PDDL (see `to_up_plan`) is invalid.
    """
    from marsupial.library.up_engine import to_up_plan

    library = _library()
    problem = _problem(situation, "validation", False, library, unknown_numbers=0)
    try:
        up_plan = to_up_plan(plan, problem, situation)
    except InvalidPlanError as error:
        return UpVerdict(valid=False, detail=str(error))
    with library.up.PlanValidator(name="up_time_triggered_validator") as validator:
        result = validator.validate(problem, up_plan)
    if result.status is library.results.ValidationResultStatus.VALID:
        return UpVerdict(valid=True)
    reason = "" if result.reason is None else result.reason.name.lower().replace("_", " ")
    action = "" if result.inapplicable_action is None else f": {result.inapplicable_action}"
    return UpVerdict(valid=False, detail=reason + action)


@dataclass(frozen=True, slots=True)
class _Library:
    """The modules of unified-planning that are used here."""

    up: Any
    plans: Any
    results: Any


@cache
def _library() -> _Library:
    """Import unified-planning and keep it quiet."""
    import unified_planning.engines.results as results
    import unified_planning.plans as plans
    import unified_planning.shortcuts as shortcuts

    shortcuts.get_environment().credits_stream = None
    return _Library(shortcuts, plans, results)


def _problem(
    situation: Situation, name: str, records: bool, library: _Library, *, unknown_numbers: int | None = None
) -> Any:
    """Build the problem; functions without a value have `unknown_numbers`, or none."""
    up = library.up
    facts = problem_facts(situation, records=records)
    problem = up.Problem(encode_name(name), initial_defaults={up.BoolType(): up.FALSE()})
    types = _types(up)
    fluents = {
        word: up.Fluent(word, kind, **_parameters(signature, types))
        for kind, table in ((up.BoolType(), PREDICATES), (up.RealType(), FUNCTIONS))
        for word, signature in table.items()
    }
    for kind in types.values():  # there is no public way to declare a type that no object has
        problem._add_user_type(kind)
    for word, fluent in fluents.items():
        default = unknown_numbers if word in FUNCTIONS else None
        problem.add_fluent(fluent, default_initial_value=default)
    problem.add_actions([_move(up, types, fluents), _explore(up, types, fluents)])
    problem.add_actions([_dock(up, types, fluents), _undock(up, types, fluents)])
    objects = {word: problem.add_object(word, types[kind]) for word, kind in facts.objects}
    for _, section in facts.sections:
        for fact in section:
            value = True if fact.value is None else Fraction(fact.value)
            problem.set_initial_value(_ground(fact, fluents, objects), value)
    problem.add_goal(up.And([_ground(fact, fluents, objects) for fact in facts.goals]))
    problem.add_quality_metric(up.MinimizeMakespan())
    return problem


def _types(up: Any) -> dict[str, Any]:
    types: dict[str, Any] = {}
    for word, parent in SUPERTYPES.items():
        types[word] = up.UserType(word, None if parent is None else types[parent])
    return types


def _ground(fact: Fact, fluents: Mapping[str, Any], objects: Mapping[str, Any]) -> Any:
    return fluents[fact.name](*(objects[arg] for arg in fact.args))


_LETTERS = {
    "robot": "r",
    "rover": "e",
    "carrier": "c",
    "robot_type": "k",
    "location": "x",
    "target": "t",
    "meeting": "m",
    "home": "h",
}
"""How the domain calls a parameter of a type; a second location is y."""


def _parameters(signature: tuple[str, ...], types: Mapping[str, Any]) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for kind in signature:
        letter = _LETTERS[kind]
        parameters["y" if letter in parameters else letter] = types[kind]
    return parameters


def _drive(up: Any, name: str, end: tuple[str, str], types: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
    """Return what move and explore have in common; `end` is the parameter of where to, and its type."""
    word, kind = end
    action = up.DurativeAction(
        name, r=types["robot"], k=types["robot_type"], x=types["location"], **{word: types[kind]}
    )
    robot, model, origin, place = action.parameters
    action.set_fixed_duration(fluents["path_cost"](model, origin, place))
    action.add_condition(up.StartTiming(), fluents["at"](robot, origin))
    action.add_condition(up.StartTiming(), fluents["is_a"](robot, model))
    action.add_condition(up.StartTiming(), fluents["path"](model, origin, place))
    action.add_effect(up.StartTiming(), fluents["at"](robot, origin), False)
    action.add_effect(up.EndTiming(), fluents["at"](robot, place), True)
    return action


def _move(up: Any, types: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
    return _drive(up, "move", ("y", "waypoint"), types, fluents)


def _explore(up: Any, types: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
    action = _drive(up, "explore", ("t", "target"), types, fluents)
    robot, _, _, target = action.parameters
    action.add_condition(up.StartTiming(), fluents["can_explore"](robot, target))
    action.add_effect(up.EndTiming(), fluents["explored"](target), True)
    return action


def _meet(up: Any, name: str, types: Mapping[str, Any]) -> Any:
    return up.DurativeAction(name, e=types["rover"], c=types["carrier"], m=types["meeting"])


def _dock(up: Any, types: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
    action = _meet(up, "dock", types)
    rover, carrier, meeting = action.parameters
    start, end, at, load = up.StartTiming(), up.EndTiming(), fluents["at"], fluents["num_docked"](carrier)
    action.set_fixed_duration(fluents["dock_time"](rover))
    action.add_condition(start, at(rover, meeting))
    action.add_condition(start, at(carrier, meeting))
    action.add_condition(start, up.LE(up.Plus(load, 1), fluents["capacity"](carrier)))
    action.add_effect(start, at(rover, meeting), False)
    action.add_effect(start, at(carrier, meeting), False)
    action.add_increase_effect(start, load, 1)
    action.add_effect(end, at(carrier, meeting), True)
    action.add_effect(end, fluents["on"](rover, carrier), True)
    action.add_effect(end, fluents["aboard"](rover), True)
    return action


def _undock(up: Any, types: Mapping[str, Any], fluents: Mapping[str, Any]) -> Any:
    action = _meet(up, "undock", types)
    rover, carrier, meeting = action.parameters
    start, end, at = up.StartTiming(), up.EndTiming(), fluents["at"]
    action.set_fixed_duration(fluents["undock_time"](rover))
    action.add_condition(start, fluents["on"](rover, carrier))
    action.add_condition(start, at(carrier, meeting))
    action.add_effect(start, fluents["on"](rover, carrier), False)
    action.add_effect(start, fluents["aboard"](rover), False)
    action.add_effect(start, at(carrier, meeting), False)
    action.add_effect(end, at(carrier, meeting), True)
    action.add_effect(end, at(rover, meeting), True)
    action.add_decrease_effect(end, fluents["num_docked"](carrier), 1)
    return action

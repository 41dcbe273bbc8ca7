"""Convert plans between PDDL's steps, with exact times in seconds, and actions in whole milliseconds.

PDDL differs from a `Plan` in two ways.

*Busy robots.* In PDDL a robot whose running action is not over leaves its start at time 0, and its drive takes longer
by the rest of that action. In a `Plan` the drive starts later:

::

    PDDL    |== rest of the action ==|==== drive ====|      start 0, duration rest + drive
    Plan                             |==== drive ====|      start rest, duration drive

*Any decimals.* Planners' times are rounded to the nearest millisecond. Rounding may leave less than `EPSILON_MS`
between two actions of a robot that had some time between them; then the later one is delayed by what is missing. (In
this domain two actions depend on each other only through a robot in both.) Actions that touched or overlapped before
rounding are left alone: such a plan is invalid, and the checker must see it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from marsupial.errors import InvalidPlanError, PlanTextError, Problem
from marsupial.formats.pddl.domain import names_seats
from marsupial.formats.pddl.facts import duration_ms, seconds
from marsupial.formats.pddl.names import decode_name, decode_type, encode_name, encode_type
from marsupial.model import EPSILON_MS, Action, ActionName, Plan, Role, Situation
from marsupial.model.bounds import BOUNDS

CHARGING = ("recharge", "recharge_aboard")
"""Actions of PDDL that a `Plan` has none for: batteries charge by themselves, other actions wait for it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One line of a PDDL plan, with PDDL names and the printed seconds."""

    start: Fraction
    name: str
    args: tuple[str, ...]
    duration: Fraction | None
    where: str = ""  # the line's name in messages
    # start_off, duration_off: the most seconds by which the true time may differ from the printed one, which is rounded
    start_off: Fraction = Fraction(0)
    duration_off: Fraction = Fraction(0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """The plan of some steps; `mended` describes the actions whose times were corrected, in order of start."""

    plan: Plan
    mended: tuple[str, ...] = ()


def steps_of(plan: Plan, situation: Situation) -> tuple[Step, ...]:
    """Return the steps of a plan, in its order; raise an `InvalidPlanError` for an action that PDDL can't express."""
    return tuple(_step(action, situation) for action in plan.actions)


def reading_of(steps: Iterable[Step], situation: Situation) -> Reading:
    """Return the plan of the steps, and the corrected actions; raise a `PlanTextError` with every unusable step."""
    problems: list[Problem] = []
    timed: list[_Timed] = []
    names = _names(situation)
    for step in steps:
        if situation.batteries and step.name in CHARGING:
            continue
        try:
            timed.append(_timed(step, situation, names))
        except _Unreadable as fault:
            problems.append(Problem(step.where, f"({' '.join((step.name, *step.args))}): {fault}"))
    if problems:
        raise PlanTextError(problems)
    return _spaced(timed)


class _Unreadable(Exception):
    """The reason why a step is not an action; `reading_of` turns it into a problem."""


def _step(action: Action, situation: Situation) -> Step:
    free = _free_ms(action.robot, action.origin, situation)
    if action.start_ms < free:
        raise InvalidPlanError(f"{action} starts before {action.robot} is free: no PDDL plan can say that")
    if action.robot not in situation.robot_by_name:
        raise InvalidPlanError(f"{action}: there is no robot {action.robot!r}")
    if action.carrier is not None:
        seat = [encode_type(situation.type_of(action.robot).seat)] if names_seats(situation) else []
        middle = [*seat, encode_name(action.carrier)]
    else:
        middle = [encode_type(situation.type_of(action.robot).name), encode_name(action.origin or "")]
    return Step(
        start=Fraction(action.start_ms - free, 1000),
        name=action.name.value,
        args=(encode_name(action.robot), *middle, encode_name(action.place)),
        duration=Fraction(action.duration_ms + free, 1000),
    )


def _free_ms(robot: str, origin: str | None, situation: Situation) -> int:
    """Return the rest of `robot`'s running action if `origin` is its start, as part of the drive's PDDL duration."""
    owner = situation.robot_by_name.get(robot)
    return int(owner.free_at_ms) if owner is not None and origin is not None and owner.place == origin else 0


_Names = Mapping[str, frozenset[str]]  # the names in a situation by the noun for their kind in messages


def _names(situation: Situation) -> _Names:
    robots = {role: frozenset(robot.name for robot in situation.of_role(role)) for role in Role}
    return {
        "robot": frozenset(situation.robot_by_name),
        "carrier": robots[Role.CARRIER],
        "rover": robots[Role.ROVER],
        "place": frozenset(situation.places),
        "meeting or home": frozenset(situation.meetings + situation.homes + situation.chargers),
        "target": frozenset(situation.target_by_name),
        "meeting": frozenset(situation.meetings),
    }


@dataclass(frozen=True, slots=True)
class _Timed:
    """An action in rounded ms, with its step's exact start and end, and the most ms by which these may be off."""

    action: Action
    start: Fraction
    end: Fraction
    start_off: Fraction
    end_off: Fraction
    where: str
    mended: bool


def _timed(step: Step, situation: Situation, names: _Names) -> _Timed:
    action = _action(step, situation, names)
    if step.start < 0:
        raise _Unreadable(f"starts before the plan, at {float(step.start):g}")
    free = _free_ms(action.robot, action.origin, situation)
    known = _duration_ms(action, situation)
    if step.duration is None and known is None:
        raise _Unreadable(f"no duration given, and no path from {action.origin} to {action.place} that tells it")
    # If the printed duration was rounded and the situation's is within its reach, the situation's is the true one.
    printed = Fraction(known or 0) if step.duration is None else step.duration * 1000 - free
    off = step.duration_off * 1000
    exact = Fraction(known) if known is not None and abs(known - printed) <= off else printed
    if exact <= 0:
        raise _Unreadable(f"{action.robot} is busy for {free} ms at first, the action must take longer")
    start = step.start * 1000 + free
    for value, bound in ((start, BOUNDS["start_ms"]), (exact, BOUNDS["duration_ms"])):
        if value > bound.most:
            raise _Unreadable(f"times must be at most {bound.most / 1000:g} s, got {float(value) / 1000:g}")
    return _Timed(
        action=replace(action, start_ms=_nearest(start), duration_ms=_nearest(exact)),
        start=start,
        end=start + printed,
        start_off=step.start_off * 1000,
        end_off=step.start_off * 1000 + off,
        where=step.where,
        mended=exact != printed,
    )


def _nearest(value: Fraction) -> int:
    """Round to the nearest integer, halves up: unlike halves to even, this keeps whole distances between times."""
    return (2 * value + 1) // 2


def _action(step: Step, situation: Situation, names: _Names) -> Action:
    try:
        name = ActionName(step.name)
    except ValueError:
        raise _Unreadable(f"unknown action {step.name}") from None
    drives = name in (ActionName.MOVE, ActionName.EXPLORE)
    wanted = 4 if drives or names_seats(situation) else 3
    if len(step.args) != wanted:
        raise _Unreadable(f"{name} takes {wanted} arguments, got {len(step.args)}")
    robot, middle, place = words = [decode_name(step.args[i]) for i in (0, -2, -1)]
    end = "meeting or home" if name is ActionName.MOVE else "target"
    for word, noun in zip(words, ("robot", "place", end) if drives else ("rover", "carrier", "meeting"), strict=True):
        if word not in names[noun]:
            raise _Unreadable(f"there is no {noun} {word}")
    action = Action(name=name, start_ms=0, duration_ms=0, robot=robot, place=place)
    if not drives:
        seat = situation.type_of(robot).seat
        if names_seats(situation) and decode_type(step.args[1]) != seat:
            raise _Unreadable(f"{robot} takes seats of type {encode_type(seat)}, not {step.args[1]}")
        return replace(action, carrier=middle)
    kind = situation.robot_by_name[robot].type
    if decode_type(step.args[1]) != kind:
        raise _Unreadable(f"{robot} is of type {encode_type(kind)}, not {step.args[1]}")
    return replace(action, origin=middle)


def _duration_ms(action: Action, situation: Situation) -> int | None:
    kind = situation.type_of(action.robot)
    if action.origin is None:
        return duration_ms(kind.dock_ms if action.name is ActionName.DOCK else kind.undock_ms)
    travel = situation.travel(kind.name, action.origin, action.place)
    return None if travel is None else duration_ms(travel)


def _spaced(timed: Sequence[_Timed]) -> Reading:
    """Return the actions, delayed where rounding has closed a gap before them."""
    last: dict[str, tuple[_Timed, int]] = {}
    actions: list[Action] = []
    mended: list[str] = []
    for item in sorted(timed, key=lambda item: (item.start, item.end)):
        start, wrong = item.action.start_ms, item.mended
        for before, end_ms in (last[robot] for robot in item.action.robots if robot in last):
            off = before.end_off + item.start_off
            # Open a gap only if there was one, or if there may have been one before the planner rounded its output.
            if before.end < item.start or (off and before.end <= item.start + off):
                start = max(start, end_ms + EPSILON_MS)
                wrong = wrong or before.end >= item.start
        action = replace(item.action, start_ms=start)
        actions.append(action)
        if wrong:
            mended.append(f"{item.where}: {action} from {seconds(start)} for {seconds(action.duration_ms)} s")
        last.update(dict.fromkeys(action.robots, (item, action.end_ms)))
    return Reading(plan=Plan.of(actions), mended=tuple(mended))

"""The best known plans for the instances of the suite, stored in ``best.json``; they only improve.

::

    {"suite": VERSION, "best": {instance: {"digest", "makespan_ms", "found_by", "lower_bound_ms", "bound_by",
                                           "plan": [lines in IPC format]}}}

A plan is verified by the checker. A bound is not: it rests on the engine that proved it, so that engine is named.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from typing import Any

from marsupial.bench.suite.catalogue import VERSION
from marsupial.errors import InputError, InvalidPlanError
from marsupial.formats.jsonvalues import parse_json
from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.situation import situation_to_json
from marsupial.model import Plan, Situation
from marsupial.planning.checker import check


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """The best known plan for an instance."""

    digest: str  # of its situation, see `digest_of`
    makespan_ms: int
    found_by: str
    plan: tuple[str, ...]  # lines in IPC format
    lower_bound_ms: int = 0  # of the makespan, by the engine `bound_by`; 0 for none
    bound_by: str = ""

    @property
    def optimal(self) -> bool:
        return self.lower_bound_ms == self.makespan_ms

    def read_plan(self, situation: Situation) -> Plan:
        """Return the plan, unchecked."""
        return read_plan_text("\n".join(self.plan), situation)


def digest_of(situation: Situation) -> str:
    """Return an identifier of a situation: the start of a hash of its JSON."""
    return hashlib.sha256(situation_to_json(situation).encode()).hexdigest()[:16]


def known_best() -> dict[str, Best]:
    """Return the best plans shipped with marsupial, by instance."""
    return read_best((files("marsupial.bench.suite") / "best.json").read_text(encoding="utf-8"))


def read_best(text: str) -> dict[str, Best]:
    """Return best plans by instance from a file's text; raise an `InputError` if it is invalid or of another suite."""
    try:
        data = parse_json(text)
        version, rows = data["suite"], data["best"]
        best = {name: _read(row) for name, row in rows.items()}
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"no file of best plans: {type(error).__name__}: {error}") from None
    if version != VERSION:
        raise InputError(f"best plans of suite version {version}, this is version {VERSION}")
    return best


def _read(row: Mapping[str, Any]) -> Best:
    best = Best(**{**row, "plan": tuple(row["plan"])})
    numbers, texts = (best.makespan_ms, best.lower_bound_ms), (best.digest, best.found_by, best.bound_by, *best.plan)
    if not (all(type(n) is int and n >= 0 for n in numbers) and all(isinstance(text, str) for text in texts)):
        raise TypeError("makespans and bounds are whole ms, all else is text")
    return best


def write_best(best: Mapping[str, Best]) -> str:
    """Return the text of a file of best plans, with one line per line of a plan."""
    rows: dict[str, Any] = {name: asdict(best[name]) for name in sorted(best)}
    return json.dumps({"suite": VERSION, "best": rows}, indent=1) + "\n"


def verified(best: Best, situation: Situation) -> Best:
    """Return `best` if its digest, plan and makespan are right for this situation, else raise `InvalidPlanError`."""
    if best.digest != digest_of(situation):
        raise InvalidPlanError("the best plan known is for another situation")
    verdict = check(situation, best.read_plan(situation))
    if not verdict.valid:
        raise InvalidPlanError(f"the best plan known: {verdict.violation}")
    if verdict.makespan_ms != best.makespan_ms or best.lower_bound_ms > best.makespan_ms:
        raise InvalidPlanError(f"the best plan known takes {verdict.makespan_ms} ms, which is not what is said of it")
    return best


def better(known: Best | None, other: Best) -> Best:
    """Return the shorter of two plans for the same situation, with the higher bound that it does not refute."""
    if known is None:
        return other
    if known.digest != other.digest:
        raise InvalidPlanError("the best plan known is for another situation")
    short, long = (known, other) if known.makespan_ms <= other.makespan_ms else (other, known)
    return with_bound(short, long.lower_bound_ms, long.bound_by)


def with_plan(known: Best | None, situation: Situation, plan: Plan, found_by: str) -> Best:
    """Return `known`, improved by `plan` if that is shorter, without a bound that the plan refutes.

    Raise an `InvalidPlanError` if the checker refuses the plan, or `known` is for another situation.
    """
    verdict = check(situation, plan)
    if not verdict.valid:
        raise InvalidPlanError(f"{found_by}: {verdict.violation}")
    lines = tuple(line for line in write_plan_text(plan, situation).splitlines() if not line.startswith(";"))
    digest = digest_of(situation)
    return better(known, Best(digest=digest, makespan_ms=plan.makespan_ms, found_by=found_by, plan=lines))


def with_bound(known: Best, bound_ms: int, bound_by: str) -> Best:
    """Return `known` with the bound if that is higher, and not refuted by its plan."""
    if not known.lower_bound_ms < bound_ms <= known.makespan_ms:
        return known
    return replace(known, lower_bound_ms=bound_ms, bound_by=bound_by)

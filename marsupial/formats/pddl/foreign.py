"""Recognise PDDL of another domain, and report what it lacks in three lines instead of a thousand problems.

A problem is foreign if most of its types, facts and goals are unknown to the canonical domain; a domain, if it lacks
most of the canonical declarations. The domain's name does not matter.
"""

from collections.abc import Collection, Iterator, Sequence

from marsupial.errors import Problem
from marsupial.formats.pddl.domain import FUNCTIONS, LEAF_TYPES, PREDICATES
from marsupial.formats.pddl.sexpr import Form, at_line, typed_list

_TYPES = ("robot_type", "carrier", "rover", "start", "target", "meeting")
# facts that a problem needs to have a plan
_FACTS = ("at", "is_a", "can_explore", "path", "path_cost", "capacity", "dock_time")
_MOST_NAMES = 6  # most names in a line

Declared = tuple[str, str]  # kind and name of a declaration in a domain


def foreign_problem(form: Form) -> tuple[Problem, ...]:
    """Return three problems with what `form` lacks; none if it may be a problem of the canonical domain."""
    sections = [item for item in form.items if isinstance(item, Form)]
    objects = [item for section in sections if section.head == ":objects" for item in typed_list(section.items[1:])]
    kinds = [(f"type {kind}", item) for item, kind in objects]
    facts = [(item.head, item) for item in _facts(sections)]
    known = {f"type {kind}" for kind in LEAF_TYPES} | set(PREDICATES) | set(FUNCTIONS)
    # Names count once, however often they are used: one unknown fact in a thousand places is one slip.
    used = {name for name, _ in (*kinds, *facts)}
    if len(used - known) <= len(used & known):
        return ()
    strange = [(name, item) for name, item in (*kinds, *facts) if name not in known]
    missing = [kind for kind in _TYPES if f"type {kind}" not in used], [fact for fact in _FACTS if fact not in used]
    domain = next((item for item in sections if item.head == ":domain"), form)
    return (
        at_line(domain.line, f"not a problem of marsupial's own domain, as `marsupial export` writes it, but {domain}"),
        Problem("", f"missing: objects of the types {_listed(missing[0])}; facts {_listed(missing[1])}"),
        at_line(strange[0][1].line, f"{len(strange)} objects and facts mean nothing here, the first: {strange[0][1]}"),
    )


def foreign_domain(
    name: str, line: int, given: Collection[Declared], wanted: Sequence[Declared]
) -> tuple[Problem, ...]:
    """Return three problems that name what a domain lacks; none if it has at least half of the declarations."""
    missing = [each for each in wanted if each not in given]
    if 2 * len(missing) <= len(wanted):
        return ()
    strange = [each for each in given if each not in wanted]
    return (
        at_line(line, f"not the canonical domain, as `marsupial export` writes it, but {name or 'one without a name'}"),
        Problem("", f"missing: {_sorted_by_kind(missing)}"),
        Problem("", f"unknown here: {_sorted_by_kind(strange)}"),
    )


def _facts(sections: Sequence[Form]) -> Iterator[Form]:
    """Yield the facts and goals; for a numeric fact, its function."""
    for section in sections:
        parts = section.items[1:] if section.head in (":init", ":goal") else ()
        for part in parts:
            inner = part.items[1:] if isinstance(part, Form) and part.head in ("and", "=") else (part,)
            yield from (item for item in inner if isinstance(item, Form) and item.head)


def _sorted_by_kind(declared: Sequence[Declared]) -> str:
    kinds = dict.fromkeys(kind for kind, _ in declared)
    return "; ".join(f"{kind} {_listed([name for of, name in declared if of == kind])}" for kind in kinds) or "nothing"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return ", ".join(names[:_MOST_NAMES]) + more if names else "none"

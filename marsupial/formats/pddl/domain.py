"""The canonical domain, ``pddl/domain.pddl``, and those for seats and batteries: texts and their declarations."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from marsupial.errors import InternalError
from marsupial.formats.pddl.sexpr import Form, Word, parse_form, typed_list
from marsupial.model import Situation


def pddl_folder() -> Traversable:
    """Return the folder with ``domain.pddl``, its documentation and ``examples``."""
    # In a checkout it is at the top, where people find it; a wheel has it as ``marsupial/data/pddl``.
    checkout = Path(__file__).resolve().parents[3] / "pddl"
    for folder in (files("marsupial") / "data" / "pddl", checkout):
        if (folder / "domain.pddl").is_file():
            return folder
    raise InternalError("the folder pddl is neither in the installed package nor beside it")


PLAIN, WITH_SEATS, WITH_BATTERIES = "marsupial", "marsupial_seats", "marsupial_batteries"
DOMAINS = {PLAIN: "domain.pddl", WITH_SEATS: "domain_seats.pddl", WITH_BATTERIES: "domain_batteries.pddl"}
"""The file of each domain."""


def domain_of(situation: Situation) -> str:
    """Return the name of the domain that a situation is a problem of."""
    if situation.batteries:
        return WITH_BATTERIES
    return WITH_SEATS if situation.has_seats else PLAIN


def names_seats(situation: Situation) -> bool:
    """Return whether docks and undocks name the type of the seat: in all domains but the plain one."""
    return domain_of(situation) != PLAIN


@cache
def domain_text(name: str = PLAIN) -> str:
    """Return the text of a domain."""
    return (pddl_folder() / DOMAINS[name]).read_text(encoding="utf-8")


@cache
def _section(domain: str, head: str) -> tuple[Word | Form, ...]:
    form = parse_form(domain_text(domain))
    return next(part.items[1:] for part in form.items if isinstance(part, Form) and part.head == head)


@cache
def signatures(domain: str, head: str) -> Mapping[str, tuple[str, ...]]:
    """Return a domain's predicates or functions with the types of their parameters; `head` is that of the section."""
    forms = (item for item in _section(domain, head) if isinstance(item, Form))
    return {form.head: tuple(str(kind) for _, kind in typed_list(form.items[1:])) for form in forms}


# the types of all domains, each with its supertype
SUPERTYPES: Mapping[str, str | None] = {
    str(kind): None if str(parent) == "object" else str(parent)
    for kind, parent in typed_list(_section(WITH_BATTERIES, ":types"))
}
LEAF_TYPES = frozenset(SUPERTYPES) - frozenset(SUPERTYPES.values())  # the types that objects may have
PREDICATES, FUNCTIONS = signatures(PLAIN, ":predicates"), signatures(PLAIN, ":functions")

"""The canonical domain, ``pddl/domain.pddl``: its text, and its types, predicates and functions as tables."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from marsupial.errors import InternalError
from marsupial.formats.pddl.sexpr import Form, Word, parse_form, typed_list


def pddl_folder() -> Traversable:
    """Return the folder with ``domain.pddl``, its documentation and ``examples``."""
    # In a checkout it is at the top, where people find it; a wheel has it as ``marsupial/data/pddl``.
    checkout = Path(__file__).resolve().parents[3] / "pddl"
    for folder in (files("marsupial") / "data" / "pddl", checkout):
        if (folder / "domain.pddl").is_file():
            return folder
    raise InternalError("the folder pddl is neither in the installed package nor beside it")


@cache
def domain_text() -> str:
    """Return the canonical domain: the text of ``pddl/domain.pddl``."""
    return (pddl_folder() / "domain.pddl").read_text(encoding="utf-8")


_DOMAIN = parse_form(domain_text())


def _section(head: str) -> tuple[Word | Form, ...]:
    return next(part.items[1:] for part in _DOMAIN.items if isinstance(part, Form) and part.head == head)


def _signatures(head: str) -> Mapping[str, tuple[str, ...]]:
    forms = (item for item in _section(head) if isinstance(item, Form))
    return {form.head: tuple(str(kind) for _, kind in typed_list(form.items[1:])) for form in forms}


# the domain's types, each with its supertype
SUPERTYPES: Mapping[str, str | None] = {
    str(kind): None if str(parent) == "object" else str(parent) for kind, parent in typed_list(_section(":types"))
}
LEAF_TYPES = frozenset(SUPERTYPES) - frozenset(SUPERTYPES.values())  # the types that objects may have
PREDICATES = _signatures(":predicates")  # the domain's predicates with the types of their parameters
FUNCTIONS = _signatures(":functions")  # the domain's functions with the types of their parameters

"""Situations as PDDL text: the canonical domain, ``pddl/domain.pddl``, and problems of it.

Any PDDL 2.1 planner can read a problem, and `read_problem` returns exactly the situation that it was written from.
"""

from collections.abc import Iterator, Sequence
from functools import cache

from marsupial.errors import Problem, SituationError
from marsupial.formats.pddl.domain import DOMAINS, PLAIN, domain_of, domain_text, pddl_folder
from marsupial.formats.pddl.facts import problem_text
from marsupial.formats.pddl.read import listed, read_problem
from marsupial.formats.pddl.sexpr import Form, Word, at_line, parse_form, typed_list

__all__ = ["check_domain", "domain_of", "domain_text", "pddl_folder", "problem_text", "read_problem"]


def check_domain(text: str) -> None:
    """Check that `text` is a canonical domain; comments, layout, order and requirements may differ.

    Raise `SituationError` with each predicate, function, type or action that is missing, unknown or different, and its
    line; if most are missing, with their names by kind.
    """
    form = parse_form(text)
    given = _declarations(form)
    name = next((name for kind, name in given if kind == "name"), PLAIN)
    wanted = _canonical(name if name in DOMAINS else PLAIN)
    missing = [each for each in wanted if each not in given]
    if 2 * len(missing) > len(wanted):  # another domain
        name = ", ".join(name for kind, name in given if kind == "name") or "one without a name"
        strange = [each for each in given if each not in wanted]
        raise SituationError(
            [
                at_line(form.line, f"not the canonical domain, as `marsupial export` writes it, but {name}"),
                Problem("", f"missing: {_sorted_by_kind(missing)}"),
                Problem("", f"unknown here: {_sorted_by_kind(strange)}"),
            ]
        )
    problems = [Problem("", f"not the canonical domain: {kind} {name} is missing") for kind, name in missing]
    for (kind, name), (form, line) in given.items():
        if (kind, name) not in wanted:
            problems.append(at_line(line, f"not the canonical domain, which has no {kind} {name}"))
        elif form != wanted[kind, name][0]:
            problems.append(at_line(line, f"{kind} {name} differs from the canonical domain's"))
    if problems:
        raise SituationError(problems)


_Declarations = dict[tuple[str, str], tuple[Form, int]]


@cache
def _canonical(name: str) -> _Declarations:
    return _declarations(parse_form(domain_text(name)))


def _declarations(domain: Form) -> _Declarations:
    """Return a domain's declarations by kind and name; the names of variables must be the canonical ones too."""
    found: _Declarations = {}
    for part in domain.items[1:]:
        for kind, name, form in _parts(part):
            if (kind, name) in found:
                raise SituationError([at_line(form.line, f"{kind} {name} is declared twice")])
            found[kind, name] = form, form.line
    return found


def _parts(part: Word | Form) -> Iterator[tuple[str, str, Form]]:
    if isinstance(part, Word):
        yield "word", part.text, Form((part,), part.line)
    elif part.head == "domain":
        yield "name", " ".join(str(item) for item in part.items[1:]), part
    elif part.head == ":types":
        for child, parent in typed_list(part.items[1:]):
            yield "type", str(child), Form((child, parent), child.line)
    elif part.head in (":predicates", ":functions"):
        kind = part.head[1:-1]
        for item in part.items[1:]:
            form = item if isinstance(item, Form) else Form((item,), item.line)
            yield kind, form.head, form
    elif part.head == ":durative-action" and len(part.items) > 1:
        yield "action", str(part.items[1]), part
    elif part.head != ":requirements":
        yield "section", part.head, part


def _sorted_by_kind(declared: Sequence[tuple[str, str]]) -> str:
    kinds = dict.fromkeys(kind for kind, _ in declared)
    return "; ".join(f"{kind} {listed([name for of, name in declared if of == kind])}" for kind in kinds) or "nothing"

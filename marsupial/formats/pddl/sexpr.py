"""Parse S-expressions, the syntax of PDDL, with line numbers.

A text becomes nested tuples of `Word` and `Form`. Each has its line, so that every problem of a PDDL file can be
reported with it. Words become lower case, as PDDL ignores case; ``;`` starts a comment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from marsupial.errors import Problem, SituationError

_TOKENS = re.compile(r";[^\n]*|[()]|[^\s();]+|\n")

_DEEPEST = 100  # most levels of nesting; PDDL has far fewer, and the limit makes recursion over forms safe


@dataclass(frozen=True, slots=True)
class Word:
    """One word; comparisons ignore its line."""

    text: str
    line: int = field(default=0, compare=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Form:
    """The content of a pair of brackets; `line` is that of the opening one, and comparisons ignore it."""

    items: tuple[Word | Form, ...]
    line: int = field(default=0, compare=False)

    @property
    def head(self) -> str:
        """The first item if it is a word, else an empty text."""
        return self.items[0].text if self.items and isinstance(self.items[0], Word) else ""

    def __str__(self) -> str:
        return f"({' '.join(str(item) for item in self.items)})"


def conjuncts(item: Word | Form) -> Iterator[Word | Form]:
    """Yield the parts of a condition that all have to hold: those of ``(and ...)`` at any depth, else itself."""
    if isinstance(item, Form) and item.head == "and":
        for part in item.items[1:]:
            yield from conjuncts(part)
    elif str(item) != "()":  # PDDL's empty condition
        yield item


def at_line(line: int, message: str) -> Problem:
    return Problem(f"line {line}", message)


def parse_form(text: str) -> Form:
    """Return the single form of a text; a `SituationError` names the line of a wrong bracket or of a word outside."""
    # The stack of open forms: their items so far, and the lines of their opening brackets.
    root: list[Word | Form] = []
    open_items, open_lines = [root], [1]
    line = 1
    for token in _TOKENS.findall(text):
        if token == "\n":
            line += 1
        elif token == "(":
            if len(open_items) > _DEEPEST:
                raise SituationError([at_line(line, f"more than {_DEEPEST} brackets inside one another")])
            open_items.append([])
            open_lines.append(line)
        elif token == ")":
            if len(open_items) == 1:
                raise SituationError([at_line(line, "')' without a '(' before it")])
            form = Form(tuple(open_items.pop()), open_lines.pop())
            open_items[-1].append(form)
        elif not token.startswith(";"):
            open_items[-1].append(Word(token.lower(), line))
    if len(open_items) > 1:
        raise SituationError([at_line(open_lines[-1], "this '(' is never closed")])
    return _only(root)


def typed_list(items: Sequence[Word | Form]) -> Iterator[tuple[Word | Form, Word | Form]]:
    """Yield each item of a list such as ``a b - kind c`` with its type, by default ``object``."""
    waiting: list[Word | Form] = []
    rest = iter(items)
    for item in rest:
        if str(item) != "-":
            waiting.append(item)
            continue
        kind = next(rest, Word("nothing", item.line))
        yield from [(each, kind) for each in waiting]
        waiting = []
    for each in waiting:
        yield each, Word("object", each.line)


def _only(root: list[Word | Form]) -> Form:
    if not root:
        raise SituationError([at_line(1, "empty: a '(define ...)' is expected")])
    stray = root[0] if isinstance(root[0], Word) else root[1] if len(root) > 1 else None
    if stray is not None:
        raise SituationError([at_line(stray.line, f"{stray} stands outside of '(define ...)'")])
    assert isinstance(root[0], Form)
    return root[0]

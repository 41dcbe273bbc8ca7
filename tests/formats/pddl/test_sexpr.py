"""S-expressions with line numbers."""

import pytest

from marsupial.errors import SituationError
from marsupial.formats.pddl.sexpr import Form, Word, parse_form


def test_words_and_forms_know_their_lines() -> None:
    form = parse_form("; a comment\n(define (a B)\n  ; (not this)\n  (c))")
    assert form == Form((Word("define"), Form((Word("a"), Word("b"))), Form((Word("c"),))))
    assert (form.line, form.items[1].line, form.items[2].line) == (2, 2, 4)
    assert str(form) == "(define (a b) (c))"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(a\n(b)", "line 1: this '(' is never closed"),
        ("(a))\n", "line 1: ')' without a '(' before it"),
        ("; nothing\n", "line 1: empty: a '(define ...)' is expected"),
        ("(a)\nb", "line 2: b stands outside of '(define ...)'"),
        ("a (b)", "line 1: a stands outside of '(define ...)'"),
        ("(a)\n\n(b)", "line 3: (b) stands outside of '(define ...)'"),
    ],
)
def test_brackets_that_do_not_match_are_found(text: str, message: str) -> None:
    with pytest.raises(SituationError) as caught:
        parse_form(text)
    assert str(caught.value) == message


def test_endless_nesting_is_refused() -> None:
    with pytest.raises(SituationError, match="line 2: more than 100 brackets"):
        parse_form("(a\n" + "(" * 50_000 + ")" * 50_001)

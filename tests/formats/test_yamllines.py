import pytest

from marsupial.errors import Problem
from marsupial.formats.yamlvalues import with_lines

TEXT = """a: 1
b:
  - x: 1
    y: 2
  -
    x: 3
"d.e": 5
d:
  e: 6
"""


@pytest.mark.parametrize(
    ("path", "line"), [("a", 1), ("b", 2), ("b[0]", 3), ("b[0].y", 4), ("b[1].x", 6), ("d", 8), ("d.e", 7)]
)
def test_a_field_has_the_line_of_its_name(path: str, line: int) -> None:
    assert with_lines([Problem(path, "wrong")], TEXT) == [Problem(path, "wrong", line)]


@pytest.mark.parametrize(
    ("path", "line"), [("b[1].y", 6), ("b[7]", 2), ("a.c", 1), ("d[0]", 8), ("c", None), ("", None)]
)
def test_what_is_missing_has_the_line_of_what_it_is_missing_from(path: str, line: int | None) -> None:
    assert with_lines([Problem(path, "missing")], TEXT) == [Problem(path, "missing", line)]


def test_what_stands_on_one_line_has_no_lines() -> None:
    problems = [Problem("a", "wrong")]
    assert with_lines(problems, '{"a": 1, "b": 2}') == problems


def test_the_line_stands_before_the_field() -> None:
    assert str(Problem("a", "wrong", 3)) == "line 3: a: wrong"

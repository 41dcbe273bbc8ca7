from time import process_time

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


NAMED = [("a", 1), ("b", 2), ("b[0]", 3), ("b[0].y", 4), ("b[1].x", 6), ("d", 8), ("d.e", 7)]
MISSING = [("b[1].y", 6), ("b[7]", 2), ("a.c", 1), ("d[0]", 8), ("c", None), ("", None)]


@pytest.mark.parametrize(("path", "line"), [*NAMED, *MISSING])
def test_a_field_has_the_line_of_its_name_or_of_what_it_is_missing_from(path: str, line: int | None) -> None:
    assert with_lines([Problem(path, "wrong")], TEXT) == [Problem(path, "wrong", line)]


def test_the_lines_of_many_fields_are_found_in_time() -> None:
    names, began = [f"k{i}" for i in range(20_000)], process_time()
    assert with_lines([Problem(name, "wrong") for name in names], ": 1\n".join([*names, ""]))[-1].line == 20_000
    assert process_time() - began < 5


def test_a_document_on_one_line_has_no_line_numbers() -> None:
    problems = [Problem("a", "wrong")]
    assert with_lines(problems, '{"a": 1, "b": 2}') == problems


def test_the_line_stands_before_the_field() -> None:
    assert str(Problem("a", "wrong", 3)) == "line 3: a: wrong"

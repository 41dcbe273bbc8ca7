import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from marsupial.formats.strips import runs_in, text_of

# A text is numbers in digits of base 64: A is 0, B is 1, C is 2.


@pytest.mark.parametrize(
    ("runs", "text"),
    [
        ((), ""),
        ((0, 1, 1), "BBBA"),  # code 1, one strip, of a single cell in the lowest row, column 0
        ((23, 1, 0), "ABFG"),  # code 0, one strip, of a single cell two rows up, column 3
        ((23, 2, 0), "ABEGBA"),  # not single: 2 cells, end
        ((23, 1, 0, 33, 1, 0, 43, 1, 0), "ABEGABBA"),  # 1 cell, alike in two more rows, end
        ((23, 1, 0, 34, 2, 0), "ABEGAJA"),  # 1 cell, then one column on and one longer: 2 * 2 + 2 + 2, plus 1
        ((0, 1, 1, 5, 1, 1), "BCBABK"),  # two strips, the second 5 columns on
        ((0, 1, 1, 5, 1, 0), "ABBKBBBA"),  # a code after the other
    ],
)
def test_a_text_has_the_documented_form(runs: tuple[int, ...], text: str) -> None:
    assert text_of(runs, 10) == text
    assert runs_in(text, 10, 10) == runs


maps = st.integers(1, 40).flatmap(
    lambda width: st.tuples(
        st.just(width), st.lists(st.lists(st.integers(0, 3), min_size=width, max_size=width), min_size=1, max_size=30)
    )
)


def all_runs(cells: list[list[int]], shown: int) -> tuple[int, ...]:
    """Return the runs of the cells of codes below `shown`, code 2 standing for terrain 254."""
    runs: list[int] = []
    for index, code in enumerate(np.ravel(cells).tolist()):
        code = 254 if code == 2 else code
        if code == 3 or (code == 1 and not shown):
            continue
        if runs and runs[-3] + runs[-2] == index and runs[-1] == code:
            runs[-2] += 1
        else:
            runs += [index, 1, code]
    return tuple(runs)


@settings(max_examples=300)
@given(maps, st.integers(0, 1))
def test_all_cells_come_back(size: tuple[int, list[list[int]]], shown: int) -> None:
    width, cells = size
    runs = all_runs(cells, shown)
    assert runs_in(text_of(runs, width), width, len(cells)) == runs


def test_runs_in_any_order_are_the_same_text() -> None:
    assert text_of((32, 3, 1, 8, 4, 1), 10) == text_of((8, 4, 1, 32, 3, 1), 10)


def test_a_slanted_edge_takes_one_digit_a_row() -> None:
    edge = tuple(number for row in range(1000) for number in (row * 2000 + 500 + row, 1, 1))
    assert len(text_of(edge, 2000)) < 1000 + 15


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("B", "it ends too early"),
        ("BB", "it ends too early"),
        ("BBA", "it ends too early"),
        ("BBAUA", "it leaves the map"),  # column 10
        ("BBABA", "it leaves the map"),  # column -1
        ("BBBU", "it leaves the map"),
        ("BBABKA", "it leaves the map"),
        ("BBUAAA", "it leaves the map"),  # row 10
        ("BBAAAB///////D", "it leaves the map"),  # alike in very many rows
        ("BBAAACA", "it leaves the map"),  # shorter than a cell
        ("BCBABA", "it has a cell twice"),
        ("BB?", "'?' is out of place"),
        ("BB" + "/" * 40, "'/' is out of place"),
    ],
)
def test_a_text_that_stands_for_nothing_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message.replace("?", r"\?")):
        runs_in(text, 10, 10)

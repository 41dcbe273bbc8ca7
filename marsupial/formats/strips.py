"""Revealed cells as a short text.

A robot on its way reveals a rim, or a sector behind a corner: a cell or two in each of many rows. As runs these would
take three numbers a row. So they are cut into strips of equal cells: a run in one row, and in each of the next rows one
that begins and ends nearly where the one before did. Most rows of a strip take one small number, how its run moved
and grew:

::

    row 3   . . . # #         strip: row 0, column 1, length 3
    row 2   . . # # #            row 1: moved by 0, grew by 0
    row 1   . # # # .            row 2: moved by 1, grew by 0
    row 0   . # # # .            row 3: moved by 1, grew by -1

The text is a list of whole numbers in digits of base 64; ``docs/mission-log.md`` says which. A mission writes
thousands of texts, so compiled code writes them; plain Python reads them.
"""

from collections.abc import Iterator, Sequence
from math import isqrt

import numpy as np

from marsupial.arrays import Bytes, Ints
from marsupial.model.runs import run_table
from marsupial.native import inlined, native

DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
"""The digits of base 64: five bits of a number each, the lowest first; the sixth bit says that more follow."""

ALIKE = 1  # the step to a row whose run has the same column and length; the number of further such rows follows

# A strip continues with a run that begins at most this many columns off; else a new strip takes no more digits.
REACH = 15

_MOST_DIGITS = 32  # of a run: a code, the number of strips, and a strip of one row, on a map of less than 2**30 cells
_CODES = np.frombuffer(DIGITS.encode("ascii"), dtype=np.uint8)
_VALUES = {digit: value for value, digit in enumerate(DIGITS)}


def text_of(runs: Sequence[int], width: int) -> str:
    """Return flat runs (start, length, code) of cells on rows of `width` as a text."""
    flat = run_table(runs)
    flat = flat[np.argsort(flat[:, 0])]
    pieces = (flat[:, 0] + flat[:, 1] - 1) // width - flat[:, 0] // width + 1
    rows = np.empty((int(pieces.sum()), 4), dtype=np.int64)
    digits = np.empty(len(rows) * _MOST_DIGITS, dtype=np.uint8)
    count = _write(flat, width, rows, _CODES, digits)
    return digits[:count].tobytes().decode("ascii")


def runs_in(text: str, width: int, height: int) -> tuple[int, ...]:
    """Return the runs in a text, ascending and as long as possible; raise a `ValueError` if it is invalid."""
    numbers = _numbers(text)
    rows: list[tuple[int, int, int]] = []
    cells_left = width * height
    for code in numbers:
        row = column = 0
        for _ in range(_next(numbers)):
            above = _next(numbers)
            row, column = row + above // 2, column + _signed(_next(numbers))
            for y, x, cells in _strip(row, column, above % 2, numbers, width, height):
                # A short text can hold any number of rows: stop before they fill the memory.
                cells_left -= cells
                if cells_left < 0:
                    raise ValueError("it has a cell twice")
                rows.append((y * width + x, cells, code))
    return _joined(sorted(rows))


@native
def _write(runs: Ints, width: int, rows: Ints, codes: Bytes, digits: Bytes) -> int:
    """Write the digits of all strips; return their number. `rows` is scratch space for the runs cut at ends of rows."""
    _cut(runs, width, rows)
    below, above = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    mine = np.empty(len(rows), dtype=np.int64)
    at, code = 0, -1
    while True:  # strips hold one code each: take the codes in ascending order
        following = 256
        for i in range(len(runs)):
            if code < runs[i, 2] < following:
                following = runs[i, 2]
        if following == 256:
            return at
        code, count = following, 0
        for i in range(len(rows)):
            if rows[i, 3] == code:
                mine[count] = i
                count += 1
        strips = _link(rows, mine[:count], below, above)
        at = _put(code, codes, digits, at)
        at = _put(strips, codes, digits, at)
        row, column = 0, 0
        for k in range(count):
            i = mine[k]
            if below[i] < 0:
                single = int(above[i] < 0 and rows[i, 2] == 1)
                at = _put(2 * (rows[i, 0] - row) + single, codes, digits, at)
                at = _put(_unsigned(rows[i, 1] - column), codes, digits, at)
                row, column = rows[i, 0], rows[i, 1]
                if not single:
                    at = _write_strip(rows, i, above, codes, digits, at)


@inlined
def _cut(runs: Ints, width: int, rows: Ints) -> None:
    """Write row, column, length and code of the runs to `rows`; cut those that continue in the next row."""
    k = 0
    for i in range(len(runs)):
        start, left = runs[i, 0], runs[i, 1]
        while left > 0:
            row = start // width
            rows[k, 0], rows[k, 1], rows[k, 3] = row, start - row * width, runs[i, 2]
            rows[k, 2] = min(left, width - rows[k, 1])
            start += rows[k, 2]
            left -= rows[k, 2]
            k += 1


@inlined
def _link(rows: Ints, mine: Ints, below: Ints, above: Ints) -> int:
    """Link each run to the nearest run of the row below within `REACH`; return the number of runs without one."""
    # Those begin a strip. `below` and `above` hold the linked run's index in `rows`, or -1.
    strips, j = 0, 0
    for k in range(len(mine)):
        i = mine[k]
        below[i], above[i] = -1, -1
        row, column = rows[i, 0] - 1, rows[i, 1]
        while j < k and (rows[mine[j], 0] < row or (rows[mine[j], 0] == row and rows[mine[j], 1] < column - REACH)):
            j += 1
        if j < k and rows[mine[j], 0] == row and rows[mine[j], 1] <= column + REACH:
            off = abs(rows[mine[j], 1] - column)
            while rows[mine[j + 1], 0] == row and abs(rows[mine[j + 1], 1] - column) < off:
                j += 1
                off = abs(rows[mine[j], 1] - column)
            below[i], above[mine[j]] = mine[j], i
            j += 1
        else:
            strips += 1
    return strips


@inlined
def _write_strip(rows: Ints, i: int, above: Ints, codes: Bytes, digits: Bytes, at: int) -> int:
    """Write the digits of a strip from its first length on; return where they end."""
    at = _put(rows[i, 2] - 1, codes, digits, at)
    alike = 0
    while above[i] >= 0:
        shift, growth = rows[above[i], 1] - rows[i, 1], rows[above[i], 2] - rows[i, 2]
        i = above[i]
        if shift == 0 and growth == 0:
            alike += 1
            continue
        if alike > 0:
            at = _put(alike - 1, codes, digits, _put(ALIKE, codes, digits, at))
            alike = 0
        a, b = _unsigned(shift), _unsigned(growth)
        at = _put(ALIKE + (a * a + a + b if a >= b else b * b + a), codes, digits, at)
    if alike > 0:
        at = _put(alike - 1, codes, digits, _put(ALIKE, codes, digits, at))
    return _put(0, codes, digits, at)


@inlined
def _unsigned(number: int) -> int:
    return 2 * number if number >= 0 else -2 * number - 1


@inlined
def _put(number: int, codes: Bytes, digits: Bytes, at: int) -> int:
    """Write the digits of a number; return where the next one begins."""
    while number > 31:
        digits[at] = codes[32 + (number & 31)]
        number >>= 5
        at += 1
    digits[at] = codes[number]
    return at + 1


def _numbers(text: str) -> Iterator[int]:
    number = shift = 0
    for digit in text:
        value = _VALUES.get(digit)
        if value is None or shift > 60:
            raise ValueError(f"{digit!r} is out of place in it")
        number |= (value & 31) << shift
        if value > 31:
            shift += 5
        else:
            yield number
            number = shift = 0


def _next(numbers: Iterator[int]) -> int:
    try:
        return next(numbers)
    except StopIteration:
        raise ValueError("it ends too early") from None


def _signed(number: int) -> int:
    return -(number + 1) // 2 if number % 2 else number // 2


def _strip(
    row: int, column: int, single: int, numbers: Iterator[int], width: int, height: int
) -> Iterator[tuple[int, int, int]]:
    """Yield row, column and length of the runs of a strip."""
    cells = 1 if single else _next(numbers) + 1
    times = 1
    while times > 0:
        if not (0 <= column < width and 0 < cells <= width - column and row + times <= height):
            raise ValueError("it leaves the map")
        for _ in range(times):
            yield row, column, cells
            row += 1
        step, times = 0 if single else _next(numbers), 1
        if step == 0:
            return
        if step == ALIKE:
            times = _next(numbers) + 1
        else:
            shift, growth = _pair(step - ALIKE)
            column, cells = column + _signed(shift), cells + _signed(growth)


def _pair(number: int) -> tuple[int, int]:
    """Return the two numbers that make this one: b * b + a where a < b, else a * a + a + b."""
    # Szudzik, An elegant pairing function, NKS 2006.
    root = isqrt(number)
    rest = number - root * root
    return (rest, root) if rest < root else (root, rest - root)


def _joined(rows: Sequence[tuple[int, int, int]]) -> tuple[int, ...]:
    """Return the runs; join a run to the run of the same code that ends where it begins."""
    runs: list[int] = []
    for start, cells, code in rows:
        if runs and runs[-3] + runs[-2] > start:
            raise ValueError("it has a cell twice")
        if runs and runs[-3] + runs[-2] == start and runs[-1] == code:
            runs[-2] += cells
        else:
            runs += (start, cells, code)
    return tuple(runs)

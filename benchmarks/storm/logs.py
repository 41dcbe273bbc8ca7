"""Read a mission log from its description in docs/mission-log.md alone.

The product has its own reader. This reader exists so that a mistake in the format's description, or one shared by the
product's writer and reader, shows up as a finding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from string import ascii_lowercase, ascii_uppercase, digits

_DIGIT = {letter: value for value, letter in enumerate(ascii_uppercase + ascii_lowercase + digits + "+/")}

STEPS = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
"""Change of column and row for each digit of a drive's steps."""

Cell = tuple[int, int]


def numbers(text: str) -> Iterator[int]:
    """Yield the whole numbers of a text of base-64 digits, five bits each, lowest first."""
    value = shift = 0
    for letter in text:
        digit = _DIGIT[letter]
        value |= (digit & 31) << shift
        shift += 5
        if digit < 32:
            yield value
            value = shift = 0


def _signed(value: int) -> int:
    return value // 2 if value % 2 == 0 else -(value + 1) // 2


def _two_signed(p: int) -> tuple[int, int]:
    """Return the two signed numbers that one number encodes: p = a a + a + b, or b b + a where a is less than b."""
    root = math.isqrt(p)
    rest = p - root * root
    a, b = (rest, root) if rest < root else (root, rest - root)
    return _signed(a), _signed(b)


def looked_at(text: str) -> Iterator[tuple[Cell, int]]:
    """Yield the cells of a look and the terrain code of each."""
    stream = numbers(text)
    for code in stream:
        left = row = 0
        for _ in range(next(stream)):
            head = next(stream)
            row += head // 2
            left += _signed(next(stream))
            if head % 2:
                yield (left, row), code
                continue
            yield from _strip(left, row, next(stream) + 1, stream, code)


def _strip(left: int, row: int, length: int, stream: Iterator[int], code: int) -> Iterator[tuple[Cell, int]]:
    while True:
        for x in range(left, left + length):
            yield (x, row), code
        more = next(stream)
        if more == 0:
            return
        row += 1
        if more == 1:  # the next n + 1 rows are alike: n here, the last one by the loop
            for _ in range(next(stream)):
                for x in range(left, left + length):
                    yield (x, row), code
                row += 1
        else:
            right, longer = _two_signed(more - 1)
            left, length = left + right, length + longer


def route(cell: Cell, steps: str) -> list[Cell]:
    """Return the cells of a drive, the first one included."""
    cells = [cell]
    for step in steps:
        x, y = STEPS[int(step)]
        cells.append((cells[-1][0] + x, cells[-1][1] + y))
    return cells

"""Read a mission log from its description in docs/mission-log.md alone.

The product has its own reader. This reader exists so that a mistake in the format's description, or one shared by the
product's writer and reader, shows up as a finding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

STEPS = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
"""Change of column and row for each digit of a drive's steps."""

Cell = tuple[int, int]


def looked_at(numbers: Sequence[int], width: int) -> Iterator[tuple[Cell, int]]:
    """Yield the cells of a look on rows of `width` cells, and the terrain code of each."""
    at = 0
    for gap, length, code in zip(numbers[::3], numbers[1::3], numbers[2::3], strict=True):
        for number in range(at + gap, at + gap + length):
            yield (number % width, number // width), code
        at += gap + length


def route(cell: Cell, steps: str) -> list[Cell]:
    """Return the cells of a drive, the first one included."""
    cells = [cell]
    for step in steps:
        x, y = STEPS[int(step)]
        cells.append((cells[-1][0] + x, cells[-1][1] + y))
    return cells

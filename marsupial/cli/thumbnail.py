"""A grid map in a few lines of text: two points of the picture in a character, one above the other.

A point stands for a square of cells and shows what matters most in it: a robot, then an obstacle, then floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import numpy.typing as npt
from rich.text import Text

from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, CellArray

_UNKNOWN, _FLOOR, _OTHER, _OBSTACLE, _ROVER, _CARRIER = range(6)
_COLOURS = ("grey15", "grey74", "dark_khaki", "grey35", "yellow1", "cyan1")
Points = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Mark:
    """A robot at a cell."""

    x: int
    y: int
    carrier: bool


def thumbnail(cells: CellArray, marks: Iterable[Mark], columns: int, rows: int) -> Text:
    """Draw a map into at most that many characters; row 0 of the grid is at the bottom.

    Parameters
    ----------
    cells
        uint8 (height, width), terrain codes.
    """
    height, width = cells.shape
    scale = max(1, math.ceil(width / max(columns, 1)), math.ceil(height / max(2 * rows, 1)))
    points = _shrunk(_classes(cells), scale)
    for mark in sorted(marks, key=lambda mark: mark.carrier):
        points[mark.y // scale, mark.x // scale] = _CARRIER if mark.carrier else _ROVER
    return _text(points[::-1])


def _classes(cells: CellArray) -> Points:
    table = np.full(256, _OTHER, dtype=np.uint8)
    table[[OBSTACLE, FLOOR, UNKNOWN]] = _OBSTACLE, _FLOOR, _UNKNOWN
    return table[cells]


def _shrunk(points: Points, scale: int) -> Points:
    height, width = (-(-size // scale) for size in points.shape)
    padded = np.full((height * scale, width * scale), _UNKNOWN, dtype=np.uint8)
    padded[: points.shape[0], : points.shape[1]] = points
    blocks: Points = padded.reshape(height, scale, width, scale).max(axis=(1, 3))
    return blocks


def _text(points: Points) -> Text:
    if len(points) % 2:
        points = np.vstack([points, np.full((1, points.shape[1]), _UNKNOWN, dtype=np.uint8)])
    text = Text()
    for upper, lower in zip(points[0::2], points[1::2], strict=True):
        for (above, below), run in groupby(zip(upper.tolist(), lower.tolist(), strict=True)):
            text.append("\u2580" * len(list(run)), style=f"{_COLOURS[above]} on {_COLOURS[below]}")
        text.append("\n")
    text.right_crop(1)
    return text

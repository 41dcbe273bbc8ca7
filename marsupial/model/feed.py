"""A queue of newly revealed cells with several readers, each at its own position.

It is a linked list, and every reader points to its next entry. Entries that all readers have passed are freed by
reference counting: on a large map, all cells ever revealed would take hundreds of megabytes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.arrays import Ints

_Entry = list[Any]  # some cells and the next entry; the last entry of a feed is empty


class Feed:
    """Passes arrays of cells (n,), row-major indices, to its readers."""

    def __init__(self) -> None:
        self._last: _Entry = []

    def add(self, cells: Ints) -> None:
        """Append cells for all existing readers."""
        # fill the empty last entry: up-to-date readers already point to it
        following: _Entry = []
        self._last += (cells, following)
        self._last = following

    def reader(self) -> Reader:
        """Return a reader of all cells added from now on."""
        return Reader(self._last)


class Reader:
    """A position in a feed."""

    def __init__(self, entry: _Entry) -> None:
        self._entry = entry

    def parts(self) -> list[Ints]:
        """Return the arrays added since the last call."""
        found: list[Ints] = []
        while self._entry:
            cells, self._entry = self._entry
            found.append(cells)
        return found

    def cells(self) -> Ints:
        """Return the cells added since the last call as one array."""
        return np.concatenate([np.empty(0, dtype=np.int64), *self.parts()])

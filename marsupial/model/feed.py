"""A queue of newly revealed cells with several readers, each at its own position.

It is a linked list, and every reader points to its next entry. Entries that all readers have passed are freed by
reference counting: on a large map, all cells ever revealed would take hundreds of megabytes.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Ints


class _Entry:
    """Some cells and the next entry; the last entry of a feed is empty and has no next one."""

    __slots__ = ("cells", "following")

    cells: Ints
    following: _Entry | None

    def __init__(self) -> None:
        self.following = None


class Feed:
    """Passes arrays of cells (n,), row-major indices, to its readers."""

    def __init__(self) -> None:
        self._last = _Entry()

    def add(self, cells: Ints) -> None:
        """Append cells for all existing readers."""
        # fill the empty last entry: up-to-date readers already point to it
        self._last.cells, self._last.following = cells, _Entry()
        self._last = self._last.following

    def reader(self) -> Reader:
        """Return a reader of all cells added from now on."""
        return Reader(self._last)


class Reader:
    """A position in a feed."""

    def __init__(self, entry: _Entry) -> None:
        self._entry = entry

    def parts(self) -> list[Ints]:
        """Return the arrays added since the last call."""
        found = []
        while self._entry.following is not None:
            found.append(self._entry.cells)
            self._entry = self._entry.following
        return found

    def cells(self) -> Ints:
        """Return the cells added since the last call as one array."""
        return np.concatenate([np.empty(0, dtype=np.int64), *self.parts()])

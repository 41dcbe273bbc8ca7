"""A queue of newly revealed cells with several readers, each of which reads when it needs to.

A feed stores nothing itself: every reader has a list of what it has not read yet. So cells that all readers have read,
and cells for readers that are gone, are freed: on a large map, all cells ever revealed take hundreds of megabytes.
"""

from __future__ import annotations

from weakref import WeakSet

import numpy as np

from marsupial.arrays import Ints


class Feed:
    """Passes arrays of cells (n,), row-major indices, to its readers."""

    def __init__(self) -> None:
        self._readers: WeakSet[Reader] = WeakSet()

    def add(self, cells: Ints) -> None:
        """Append cells for all existing readers."""
        for reader in self._readers:
            reader.unread.append(cells)

    def reader(self) -> Reader:
        """Return a reader of all cells added from now on."""
        reader = Reader()
        self._readers.add(reader)
        return reader


class Reader:
    """A reader of a feed."""

    def __init__(self) -> None:
        self.unread: list[Ints] = []

    def parts(self) -> list[Ints]:
        """Return the arrays added since the last call."""
        found, self.unread = self.unread, []
        return found

    def cells(self) -> Ints:
        """Return the cells added since the last call as one array."""
        return np.concatenate([np.empty(0, dtype=np.int64), *self.parts()])

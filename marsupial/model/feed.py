"""Cells that come in from time to time, handed to each of those who read them once.

What everybody has read is kept by nobody: on a large map all that was ever revealed would be hundreds of megabytes.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Ints


class _Entry:
    """Some cells and the entry after it; the last entry of a feed has neither."""

    __slots__ = ("cells", "following")

    cells: Ints
    following: _Entry | None

    def __init__(self) -> None:
        self.following = None


class Feed:
    """Hands on cells (n,), row-major indices, to its readers."""

    def __init__(self) -> None:
        self._last = _Entry()

    def add(self, cells: Ints) -> None:
        """Hand on cells to everyone who reads by now."""
        self._last.cells, self._last.following = cells, _Entry()
        self._last = self._last.following

    def reader(self) -> Reader:
        """Return what reads all that is added from now on."""
        return Reader(self._last)


class Reader:
    """Reads a feed; an entry lives as long as a reader has not passed it."""

    def __init__(self, entry: _Entry) -> None:
        self._entry = entry

    def parts(self) -> list[Ints]:
        """Return what was added since the last time, as it was."""
        found = []
        while self._entry.following is not None:
            found.append(self._entry.cells)
            self._entry = self._entry.following
        return found

    def cells(self) -> Ints:
        """Return what was added since the last time in one."""
        return np.concatenate([np.empty(0, dtype=np.int64), *self.parts()])

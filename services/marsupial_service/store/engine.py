"""What the store asks of a database. Both understand the statements of this package, with `?` for values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol


class StoreRow(Protocol):
    """A row of a result: columns by their place or name."""

    def __getitem__(self, column: Any, /) -> Any:
        """Return a column."""
        ...

    def __iter__(self) -> Iterator[Any]:
        """Yield the columns in order."""
        ...


class StoreRows(Protocol):
    """What a statement found, or how many rows it changed."""

    @property
    def rowcount(self) -> int:
        """How many rows were changed."""
        ...

    def fetchone(self) -> Any:
        """Return the next row, None after the last one."""
        ...

    def fetchall(self) -> Sequence[Any]:
        """Return the rows that are left."""
        ...

    def __iter__(self) -> Iterator[Any]:
        """Yield the rows that are left."""
        ...


class Connection(Protocol):
    """A connection, used by one thread at a time."""

    def execute(self, sql: str, values: Sequence[object] = ..., /) -> StoreRows:
        """Run one statement."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class StoreBackend(Protocol):
    """A database that holds the tables, for one server.

    Attributes
    ----------
    place
        What messages call it.
    server
        By what name other servers know this one: another one each time it starts.
    begin, begin_reading
        How a transaction begins that writes, and one that only reads and sees one moment.
    row_lock
        What makes a SELECT keep its rows from other servers until the end of the transaction.
    skip_locked
        The same, leaving out rows that others keep.
    live
        Selects the names of the servers that are alive.
    errors, refusals
        What its library raises; which of them concern one write and not the database.
    interferences
        What it raises where another server was in the way, or this one too slow: nothing was committed, and the
        transaction may be tried again.
    breaks
        What it raises where the connection was lost.
    """

    place: str
    server: str
    begin: str
    begin_reading: str
    row_lock: str
    skip_locked: str
    live: str
    errors: tuple[type[Exception], ...]
    refusals: tuple[type[Exception], ...]
    interferences: tuple[type[Exception], ...]
    breaks: tuple[type[Exception], ...]

    def writer(self) -> Connection:
        """Connect to write; the tables are there and of this version. Raises StoreError."""
        ...

    def reader(self) -> Connection:
        """Connect to read. Raises one of `errors`."""
        ...

    def maintainer(self) -> Connection:
        """Connect for maintenance; nothing is made. Raises StoreError if nothing is there."""
        ...

    def lock(self, connection: Connection, name: str) -> None:
        """Let no other server go on from here with the same `name` until the end of the transaction."""
        ...

    def tell(self, connection: Connection, topics: frozenset[str]) -> None:
        """Have other servers told, with the commit, that there is news on these topics."""
        ...

    def shrink(self, connection: Connection) -> bool:
        """Give back some of the space that is no longer used, in a transaction; say whether there is more."""
        ...

    def settle(self) -> bool:
        """Give back what commits have left behind, outside of any transaction; say no if somebody is in the way.

        Raises one of `errors`.
        """
        ...

    def disk_bytes(self, connection: Connection) -> int:
        """Return how much of the disk is taken."""
        ...

    def free_bytes(self, connection: Connection) -> int:
        """Return how much of that is free, and given back or used again."""
        ...

    def version(self, connection: Connection) -> int:
        """Return the version of the tables; 0 if there are none."""
        ...

    def listen(self, heard: Callable[[frozenset[str] | None], None]) -> None:
        """Have `heard` called with the topics that other servers tell of; None: something may have been missed."""
        ...

    def close(self) -> None:
        """Let go of the database; the connections are closed."""
        ...

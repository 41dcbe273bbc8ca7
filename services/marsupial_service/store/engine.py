"""The interface of a database. Both databases accept the statements of this package, with `?` for values."""

import uuid
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

# a row of a result: columns by their place or name
StoreRow = Any


class StoreRows(Protocol):
    """The rows that a statement returned, or how many rows it changed."""

    @property
    def rowcount(self) -> int:
        """How many rows were changed."""

    def fetchone(self) -> Any:
        """Return the next row, None after the last one."""

    def fetchall(self) -> Sequence[Any]:
        """Return the rows that are left."""

    def __iter__(self) -> Iterator[Any]:
        """Yield the rows that are left."""


class Connection(Protocol):
    """A connection, used by one thread at a time."""

    def execute(self, sql: str, values: Sequence[object] = ..., /) -> StoreRows:
        """Run one statement."""

    def close(self) -> None:
        """Close the connection."""


class StoreError(Exception):
    """Nothing was stored; the message says why (no space, no permission, a damaged file, no connection).

    `public_message` is a message that anybody may read: it names no file, address or user.
    """

    def __init__(self, message: str, public_message: str = "the store is not available; see the server log") -> None:
        super().__init__(message)
        self.public_message = public_message


class StoreInUse(StoreError):
    """Another server uses the folder."""


def one_line(error: Exception) -> str:
    """Return the message of an error in one line."""
    return str(error).strip().replace("\n", " ") or type(error).__name__


class StoreBackend(ABC):
    """A database with the tables, for one server. Methods that only a shared database needs do nothing by default."""

    place: str  # its name in messages
    begin: str  # begins a transaction that writes
    begin_reading: str  # begins one that only reads, and sees one moment
    row_lock = ""  # makes a SELECT lock its rows against other servers until the end of the transaction
    skip_locked = ""  # the same, skipping rows that others have locked
    live: str  # selects the names of the servers that are alive
    errors: tuple[type[Exception], ...]  # what its library raises
    refusals: tuple[type[Exception], ...]  # those of them that concern one write and not the database
    # another server was in the way, or this one too slow: nothing was committed, and it may be tried again
    interferences: tuple[type[Exception], ...] = ()
    breaks: tuple[type[Exception], ...] = ()  # the connection was lost

    def __init__(self) -> None:
        self.server = uuid.uuid4().hex  # a new one at each start: what the last one held is nobody's

    def writer(self) -> Connection:
        """Connect to write, and make the tables if there are none. Raises StoreError, also for another version."""
        try:
            connection = self._connect()
            try:
                self._prepare(connection)
            except BaseException:
                connection.close()
                raise
        except self.errors as error:
            raise StoreError(f"{self.place}: {one_line(error)}") from error
        return connection

    @abstractmethod
    def reader(self) -> Connection:
        """Connect to read. Raises one of `errors`."""

    def maintainer(self) -> Connection:
        """Connect for maintenance; nothing is made. Raises StoreError if nothing is there, or one of `errors`."""
        return self._connect()

    @abstractmethod
    def _connect(self) -> Connection: ...

    @abstractmethod
    def _prepare(self, connection: Any) -> None: ...

    @abstractmethod
    def disk_bytes(self, connection: Connection) -> int:
        """Return how many bytes the database takes on disk."""

    @abstractmethod
    def version(self, connection: Connection) -> int:
        """Return the version of the tables; 0 if there are none."""

    @abstractmethod
    def close(self) -> None:
        """Release the database, once all connections are closed."""

    def lock(self, connection: Connection, name: str) -> None:
        """Take the lock `name`, and hold it until the end of the transaction."""

    def notify(self, connection: Connection, topics: frozenset[str]) -> None:
        """Notify other servers of news on these topics, with the commit."""

    def listen(self, on_news: Callable[[frozenset[str] | None], None]) -> None:
        """Call `on_news` with the topics that other servers notify; None: a notification may have been missed."""

    def shrink(self, connection: Connection) -> bool:
        """Free some unused space, in a transaction; return whether there is more."""
        return False

    def checkpoint(self) -> bool:
        """Give back what commits left behind, outside of transactions; False if others hold it. Raises `errors`."""
        return True

    def free_bytes(self, connection: Connection) -> int:
        """Return how much of what is taken is free, and given back or used again; 0 if that is not known."""
        return 0

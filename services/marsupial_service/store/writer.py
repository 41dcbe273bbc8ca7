"""The one thread that writes, and commits in groups.

A commit waits milliseconds for the disk, which limits the number of commits per second. So writes queue up while one
commit is in progress, and all waiting writes become the next transaction:

    callers    w1      w2 w3 w4          w5 w6
               |       |  |  |           |  |
    writer     [w1]----[w2 w3 w4]--------[w5 w6]----      each bracket is one transaction
                   commit       commit          commit    a future is resolved after its commit

The more callers there are, the larger the groups: throughput grows with load, and a lone write waits for nobody. A
future that has its result stands for data on the disk, so what the service acknowledges survives a power cut.

A failed write does not affect the others of its group. Each runs in a savepoint: if a write refuses (raises), only its
own changes are rolled back, and the others commit. If the commit itself fails, the whole group is rolled back and every
caller gets the error.

A shared database adds two cases. If another server was in the way (a deadlock, a lock held too long), the group is done
again write by write: then no write of ours waits for a lock while the group holds another that its holder wants. And if
the session was lost before the commit was asked for, a new session does the group again. If it was lost after that, the
commit may have happened: the callers get an error, and learn what was stored when they ask again (entries by their
keys, batches by their numbers).

After a commit listeners get its topics. After the first commit that follows a failure they learn that anything may have
changed, as a write that seemed to fail may be stored.
"""

import logging
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from marsupial_service.store.engine import Connection, StoreBackend, StoreError
from marsupial_service.store.outage import Outage
from marsupial_service.store.transaction import Transaction

# a commit that fails is the failure of all of its group
_LARGEST_GROUP = 256
# limits for retrying a write that other servers block: after that a client wants an answer
_MOST_TRIES = 20
_TRYING_S = 8.0

log = logging.getLogger("marsupial.store")


class WriteRequest:
    """A write that waits for its turn, and what became of it."""

    def __init__(self, write: Callable[[Transaction], Any]) -> None:
        self.write = write
        self.future: Future[Any] = Future()
        self.result: Any = None
        self.refusal: Exception | None = None

    def run(self, transaction: Transaction, engine: StoreBackend) -> None:
        """Run the write; roll back its changes if it raises."""
        self.refusal, before = None, len(transaction.on_rollback)
        transaction.execute("SAVEPOINT write")
        try:
            self.result = self.write(transaction)
        except Exception as error:
            if isinstance(error, engine.errors) and not isinstance(error, engine.refusals):
                raise
            self.refusal = error
            transaction.roll_back(before)
            transaction.execute("ROLLBACK TO SAVEPOINT write")
        transaction.execute("RELEASE SAVEPOINT write")

    def resolve(self) -> None:
        """Resolve the future, once committed."""
        if self.refusal is None:
            self.future.set_result(self.result)
        else:
            self.future.set_exception(self.refusal)


class Writer:
    """The thread; `notify` is called in it after every commit, with the topics that have news (None: any).

    Raises StoreError.
    """

    def __init__(self, engine: StoreBackend, notify: Callable[[frozenset[str] | None], None]) -> None:
        self._engine = engine
        self._connection: Connection | None = engine.writer()
        self._listener = notify
        self._waiting: queue.SimpleQueue[WriteRequest | None] = queue.SimpleQueue()
        self._outage = Outage("the store can't be written")
        self._lock = threading.Lock()
        self._closed = self._notify_again = False
        self._thread = threading.Thread(target=self._run, name="store-writer")
        self._thread.start()

    @property
    def failures(self) -> int:
        """The number of groups of writes that were not stored."""
        return self._outage.failures

    def write(self, write: Callable[[Transaction], Any]) -> Future[Any]:
        """Queue `write` as `Store.write` says."""
        request = WriteRequest(write)
        with self._lock:
            if self._closed:
                raise StoreError("the store is closed", "the service is shutting down")
            self._waiting.put(request)
        return request.future

    def close(self) -> None:
        """Run the waiting writes, then end."""
        with self._lock:
            self._closed = True
            self._waiting.put(None)
        self._thread.join()
        if self._connection is not None:
            self._connection.close()

    def _run(self) -> None:
        while (first := self._waiting.get()) is not None:
            group, last = [first], False
            while len(group) < _LARGEST_GROUP and not last and not self._waiting.empty():
                request = self._waiting.get()
                if request is None:
                    last = True
                else:
                    group.append(request)
            group = [request for request in group if request.future.set_running_or_notify_cancel()]
            if not self._commit(group):
                for request in group:  # one at a time: no write waits for a lock while the group holds another
                    tries, latest_s = 1, time.monotonic() + _TRYING_S
                    while not self._commit([request], tries >= _MOST_TRIES or time.monotonic() > latest_s):
                        tries += 1
            if last:
                return

    def _commit(self, group: list[WriteRequest], last_try: bool = False) -> bool:
        """Do a group of writes and resolve their futures; return False if they are to be tried again."""
        transaction, is_new = None, self._connection is None
        try:
            connection = self._connection = self._connection or self._engine.writer()
            transaction = Transaction(self._engine, connection)
            with transaction.committed():
                for request in group:
                    request.run(transaction, self._engine)
                if self._outage.lasts:  # a group that changes nothing doesn't show that it is over
                    transaction.execute("UPDATE servers SET beat_s = beat_s WHERE id = ?", (transaction.server,))
        except BaseException as error:
            if transaction is not None and transaction.is_broken:
                with suppress(*self._engine.errors):
                    connection.close()
                self._connection = None
                if transaction.is_lost and not is_new:  # the database was unavailable, or has ended the session
                    return self._commit(group, last_try)
            if isinstance(error, self._engine.interferences) and not last_try:
                return False
            self._fail(group, error)
            return True
        for request in group:
            request.resolve()
        if self._outage.end() or self._notify_again:
            self._notify(None)  # the write that failed last may be stored after all
        elif transaction.news:
            self._notify(frozenset(transaction.news))
        return True

    def _notify(self, topics: frozenset[str] | None) -> None:
        """Tell news; whatever a listener raises, this thread goes on, and tells again after the next commit."""
        self._notify_again = True
        try:
            self._listener(topics)
            self._notify_again = False
        except Exception:
            log.exception("listeners could not be notified of a commit")

    def _fail(self, group: list[WriteRequest], error: BaseException) -> None:
        self._outage.begin(str(error))
        for request in group:
            failure = StoreError(f"nothing was stored: {error}", "nothing was stored; see the server log")
            failure.__cause__ = error
            request.future.set_exception(failure)

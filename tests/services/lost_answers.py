"""A database connection that breaks right after a commit: the data is stored, but the writer gets an error."""

from collections.abc import Sequence
from typing import Self

from marsupial_service.store import Store
from marsupial_service.store.engine import Connection, StoreRows


class LostAnswers:
    """The write connection of a store: some commits succeed, but the connection breaks before their answer.

    Parameters
    ----------
    of
        Part of a statement; only transactions with such a statement lose their answer.
    """

    def __init__(self, store: Store, of: str, lost: int = 2) -> None:
        self._engine, self._of, self.left = store._engine, of, lost
        self._connect = self._engine.writer
        self._begun = False
        self._engine.writer = self._anew  # type: ignore[method-assign]
        broken = store._writer._connection
        assert broken is not None
        self._inner: Connection = broken
        store._writer._connection = self

    def _anew(self) -> Self:
        self._inner = self._connect()
        return self

    def execute(self, sql: str, values: Sequence[object] = (), /) -> StoreRows:
        self._begun = self._of in sql or (self._begun and not sql.startswith("BEGIN"))
        rows = self._inner.execute(sql, values)
        if sql == "COMMIT" and self._begun and self.left:
            self.left -= 1
            self._inner.close()
            raise self._engine.errors[0]("the answer is lost")
        return rows

    def close(self) -> None:
        self._inner.close()

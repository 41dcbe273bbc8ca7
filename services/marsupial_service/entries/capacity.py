"""The space that the entries of a store take, and a cap on it.

Beyond the cap, no jobs and missions are created. Reports of open missions are accepted until a reserve is used up too.
The results of accepted jobs and reports are always stored.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from marsupial_service.store.transaction import StoreReader

# the space that open missions may take beyond the cap, as a fraction of the cap
RESERVE = 0.1
# space becomes free only when old entries are removed
RETRY_AFTER_S = 60
# a sum is cached for this long: it takes some ms with thousands of entries
_FRESH_S = 1.0


class StoreFull(Exception):
    """No more entries or reports are accepted until old entries are removed."""


@dataclass(slots=True)
class StoreCapacity:
    """The cap on a store, `limit` bytes in all and `key_limit` per owner; only for the thread that writes."""

    limit: float = math.inf
    key_limit: float = math.inf
    clock_s: Callable[[], float] = time.monotonic
    _sums: dict[str | None, int] = field(default_factory=dict, init=False)
    _summed_s: float = field(default=-math.inf, init=False)

    def check(self, reader: StoreReader, owner: str, *, of_reports: bool = False) -> None:
        """Raise StoreFull if there is no space for an entry of that owner or (`of_reports`) for a report."""
        if self.clock_s() - self._summed_s > _FRESH_S:
            self._sums.clear()
            self._summed_s = self.clock_s()
        for whose, limit, what in (
            (None, self.limit, "the store is full: jobs"),
            (owner, self.key_limit, "your part of the store is full: your jobs"),
        ):
            # most stores have no cap and need no sum
            if limit == math.inf:
                continue
            if whose not in self._sums:
                self._sums[whose] = stored_bytes(reader, whose)
            if self._sums[whose] >= limit * (1 + RESERVE if of_reports else 1):
                taken = f"{what} and missions take {self._sums[whose]} bytes; the limit is {limit:.0f}"
                raise StoreFull(f"{taken}; old ones are removed automatically")


def stored_bytes(reader: StoreReader, owner: str | None = None) -> int:
    """Return the approximate bytes that all entries, or those of an owner, take."""
    of_all = "(SELECT coalesce(sum(bytes), 0) FROM {} WHERE owner = coalesce(?, owner))"
    sql = f"SELECT {of_all.format('jobs')} + {of_all.format('missions')} AS bytes"
    return int(reader.execute(sql, (owner, owner)).fetchone()["bytes"])

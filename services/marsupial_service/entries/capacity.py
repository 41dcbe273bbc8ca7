"""How much the entries of a store take, and a cap on it.

Beyond the cap no jobs and missions are made; what missions that are open report is still taken until a reserve is used
up as well, and what becomes of jobs and reports that were taken is always stored.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from marsupial_service.store.transaction import StoreReader

# what open missions may take beyond the cap, as a part of it
RESERVE = 0.1
# space comes back only as old entries are removed
RETRY_AFTER_S = 60
# a sum is kept for this long: it costs some ms where there are thousands of entries
_FRESH_S = 1.0


class StoreFull(Exception):
    """Nothing more is taken until old entries are removed."""


@dataclass(slots=True)
class StoreCapacity:
    """What is left of a store that may hold `limit` bytes, and of one owner `key_limit`; for the thread that writes."""

    limit: float = math.inf
    key_limit: float = math.inf
    clock_s: Callable[[], float] = time.monotonic
    _sums: dict[str | None, int] = field(default_factory=dict, init=False)
    _summed_s: float = field(default=-math.inf, init=False)

    def check(self, reader: StoreReader, owner: str, *, of_reports: bool = False) -> None:
        """Raise StoreFull if there is no space for an entry of that owner, or for a report."""
        if self.clock_s() - self._summed_s > _FRESH_S:
            self._sums.clear()
            self._summed_s = self.clock_s()
        for whose, limit, what in (
            (None, self.limit, "the store is full: jobs"),
            (owner, self.key_limit, "your part of the store is full: your jobs"),
        ):
            # most stores have no cap: the sum is not computed then
            if limit == math.inf:
                continue
            if whose not in self._sums:
                self._sums[whose] = stored_bytes(reader, whose)
            if self._sums[whose] >= limit * (1 + RESERVE if of_reports else 1):
                taken = f"{what} and missions take {self._sums[whose]} bytes, {limit:.0f} are allowed"
                raise StoreFull(f"{taken}; old ones are removed in time")


UNBOUNDED = StoreCapacity()


class Sizes(NamedTuple):
    """How many bytes all entries take, and how many the store does on the disk."""

    stored: int
    on_disk: int


def stored_bytes(reader: StoreReader, owner: str | None = None) -> int:
    """Return about how many bytes all entries take, or those of an owner."""
    of_all = "(SELECT coalesce(sum(bytes), 0) FROM {} WHERE owner = coalesce(?, owner))"
    sql = f"SELECT {of_all.format('jobs')} + {of_all.format('missions')} AS bytes"
    return int(reader.execute(sql, (owner, owner)).fetchone()["bytes"])

"""The quota: how many seconds of planning a key may use per hour.

Used seconds refill evenly, the whole quota within an hour: of 600 s, one every six seconds. Jobs reserve their budgets
when they are accepted. All work is charged for the time it took, including preparation (process start, parsing, map
analysis), so a small budget does not make it cheap. For each owner the store has the moment at which the quota will be
full again: this one number is valid for all servers and after a restart.
"""

import math
from dataclasses import dataclass

from marsupial_service.entries.records import TooMany
from marsupial_service.settings import UNBOUNDED_S, ServiceLimits
from marsupial_service.store import Transaction, documents
from marsupial_service.store.transaction import StoreReader

HOUR_S = 3600.0

PREPARATION_S = 1.0
"""What an attempt at a job may take beyond its budget; no job reserves less, no analysis begins with less left."""

# with the owner's name appended, the name of the document with that moment, in ms since 1970
_DOCUMENT = "planning/"

_RESERVED = (
    "SELECT owner, sum(left_s) AS seconds FROM"
    f" (SELECT owner, CASE WHEN seconds < {PREPARATION_S} THEN {PREPARATION_S} ELSE coalesce(seconds, ?) END"
    " - spent_ms / 1000.0 AS left_s"
    " FROM jobs WHERE finished_ms IS NULL AND owner = coalesce(?, owner)) AS open WHERE left_s > 0 GROUP BY owner"
)


@dataclass(frozen=True, slots=True)
class Quota:
    """The quota of each owner."""

    limits: ServiceLimits

    @property
    def is_bounded(self) -> bool:
        """Return whether there is a quota at all."""
        return self.limits.key_planning_s < UNBOUNDED_S

    def required_s(self, seconds: float | None) -> float:
        """Return how many seconds a budget (None: one in steps) can take."""
        return self.limits.steps_s if seconds is None else seconds

    def reserved_s(self, seconds: float | None) -> float:
        """Return how many seconds a job with such a budget reserves."""
        return max(PREPARATION_S, self.required_s(seconds))

    def check(self, reader: StoreReader, owner: str, required_s: float, now_ms: int, uncharged_s: float = 0.0) -> None:
        """Raise TooMany if the owner has less than `required_s` left; `uncharged_s` are used, but not charged yet."""
        wait_s = self.wait_s(reader, owner, required_s, now_ms, uncharged_s)
        if wait_s > 0:
            raise TooMany(self.wait_reason(required_s, wait_s), math.ceil(wait_s))

    def wait_reason(self, required_s: float, wait_s: float) -> str:
        return (
            f"your planning quota of {self.limits.key_planning_s:g} s per hour (key_planning_s) is used up or reserved"
            f" by your jobs; {required_s:g} s may be available in {math.ceil(wait_s)} s"
        )

    def wait_s(
        self, reader: StoreReader, owner: str, required_s: float, now_ms: int, uncharged_s: float = 0.0
    ) -> float:
        """Return how long until an owner has `required_s` left, if no job ends meanwhile; 0: now."""
        if not self.is_bounded:
            return 0.0
        # a request for more than the hourly quota would wait forever
        missing_s = min(required_s, self.limits.key_planning_s) - self.left_s(reader, now_ms, owner)[owner]
        missing_s += uncharged_s
        return max(0.0, missing_s * HOUR_S / self.limits.key_planning_s)

    def left_s(self, reader: StoreReader, now_ms: int, owner: str | None = None) -> dict[str, float]:
        """Return the seconds left for each owner who has used some; negative after overuse."""
        if not self.is_bounded:
            return {}
        if owner is None:
            moments = documents.texts_of(reader, _DOCUMENT)
        else:
            moments = {owner: documents.text_of(reader, _DOCUMENT + owner) or "0"}
        left = {}
        for name, moment in moments.items():
            left[name] = (
                self.limits.key_planning_s - max(0, int(moment) - now_ms) / 1000 * self.limits.key_planning_s / HOUR_S
            )
        for row in reader.execute(_RESERVED, (self.reserved_s(None), owner)):
            left[row["owner"]] = left.get(row["owner"], self.limits.key_planning_s) - float(row["seconds"])
        return left

    def charge(self, tx: Transaction, owner: str, used_ms: int, now_ms: int) -> None:
        """Charge an owner for time used."""
        if not self.is_bounded:
            return
        name = _DOCUMENT + owner
        tx.lock(name)
        free_ms = max(now_ms, int(documents.text_of(tx, name) or "0"))
        documents.store_text(tx, name, str(free_ms + math.ceil(used_ms * HOUR_S / self.limits.key_planning_s)))

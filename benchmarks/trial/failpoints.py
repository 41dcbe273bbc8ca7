"""Named points in the store at which a test can make things fail.

``MARSUPIAL_FAILPOINTS="after_commit=kill@3,before_commit=disk_full"``: at the third passing of the first point the
process is killed as by ``kill -9``; at every passing of the second one writing fails as on a full disk.
``python -m benchmarks.trial.failpoints`` is ``marsupial`` with the points that are in its environment.
"""

import os
import signal
import sqlite3
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from marsupial_service.store.transaction import Transaction

VARIABLE = "MARSUPIAL_FAILPOINTS"
BEFORE_COMMIT, AFTER_COMMIT = "before_commit", "after_commit"

_committed = Transaction.committed


def _disk_full() -> None:
    raise sqlite3.OperationalError("database or disk is full")


_KILL = partial(signal.raise_signal, signal.SIGKILL)

# when a group of writes is done but not committed, and when it is committed but not reported
POINTS: Mapping[str, Mapping[str, Callable[[], None]]] = {
    BEFORE_COMMIT: {"kill": _KILL, "disk_full": _disk_full},
    AFTER_COMMIT: {"kill": _KILL},
}


class Failpoints:
    """The points that are armed: what happens there, and at which passing (0: at every one). Any other does nothing."""

    def __init__(self, armed: Mapping[str, tuple[Callable[[], None], int]]) -> None:
        self._armed = armed
        self.passed = Counter[str]()

    def reach(self, point: str) -> None:
        """Run the action armed at `point`, if any."""
        self.passed[point] += 1
        if point in self._armed:
            act, at = self._armed[point]
            if at in (0, self.passed[point]):
                act()


def arm(text: str) -> Failpoints:
    """Arm points for all stores of this process, in place of those armed before. Raises ValueError for unknown ones."""
    points = Failpoints(dict(_parse(part) for part in text.split(",") if part.strip()))

    @contextmanager
    def committed(transaction: Transaction) -> Iterator[None]:
        with _committed(transaction):
            yield
            points.reach(BEFORE_COMMIT)
        points.reach(AFTER_COMMIT)

    Transaction.committed = committed  # type: ignore[method-assign, assignment]
    return points


def _parse(text: str) -> tuple[str, tuple[Callable[[], None], int]]:
    point, _, rest = text.strip().partition("=")
    action, _, at = rest.partition("@")
    actions = POINTS.get(point, {})
    if action not in actions or not (at or "0").isdecimal():
        known = ", ".join(f"{point}={action}" for point, actions in POINTS.items() for action in actions)
        raise ValueError(f"{VARIABLE}: {text!r} must be one of {known}, with an optional '@N'")
    return point, (actions[action], int(at or 0))


if __name__ == "__main__":  # child processes import this module under another name
    from marsupial.cli.main import main

    arm(os.environ.get(VARIABLE, ""))
    sys.exit(main())

"""Log a lasting fault once when it begins and once when it is over, however often it occurs in between."""

import logging
import threading
import time

log = logging.getLogger("marsupial.store")


class Outage:
    """A condition, named `message`, that any thread may report as begun or over."""

    def __init__(self, message: str) -> None:
        self._message = message
        self._lock = threading.Lock()
        self._since_s: float | None = None
        self.failures = 0  # so far

    @property
    def lasts(self) -> bool:
        return self._since_s is not None

    def begin(self, reason: str) -> None:
        """Record that the fault occurs; log it only once."""
        with self._lock:
            self.failures += 1
            if self._since_s is not None:
                return
            self._since_s = time.monotonic()
        log.error(self._message, extra={"reason": reason})

    def end(self) -> bool:
        """Record that the fault is over; return whether there was one until now."""
        # first without the lock: this runs after each commit, and there is rarely a fault
        if not self.lasts:
            return False
        with self._lock:
            if self._since_s is None:
                return False
            lasted_s, self._since_s = time.monotonic() - self._since_s, None
        log.warning("%s: resolved", self._message, extra={"lasted_s": round(lasted_s, 1)})
        return True

"""What is wrong for a while is logged when it begins and when it is over, however often it is met in between."""

import logging
import threading
import time

log = logging.getLogger("marsupial.store")


class Outage:
    """A condition, named `said`, that any thread may report as begun or over."""

    def __init__(self, said: str) -> None:
        self._said = said
        self._lock = threading.Lock()
        self._since_s: float | None = None

    def met(self, reason: str) -> None:
        """Note that it has begun; it is logged once."""
        with self._lock:
            if self._since_s is not None:
                return
            self._since_s = time.monotonic()
        log.error(self._said, extra={"reason": reason})

    def over(self) -> bool:
        """Enter that it works; return whether it did not until now."""
        # without the lock at first: after each commit nearly nothing is wrong
        if self._since_s is None:
            return False
        with self._lock:
            if self._since_s is None:
                return False
            lasted_s, self._since_s = time.monotonic() - self._since_s, None
        log.warning("%s: that is over", self._said, extra={"lasted_s": round(lasted_s, 1)})
        return True

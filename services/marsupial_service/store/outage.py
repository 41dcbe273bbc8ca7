"""What is wrong for a while is logged when it begins and when it is over, however often it is met in between."""

from __future__ import annotations

import logging
import threading
import time

log = logging.getLogger("marsupial.store")


class Outage:
    """Something that works, or does not, as `said`: may be told so by any thread."""

    def __init__(self, said: str) -> None:
        self._said = said
        self._lock = threading.Lock()
        self._since_s: float | None = None

    def met(self, reason: str) -> None:
        """Enter that it does not work."""
        with self._lock:
            if self._since_s is not None:
                return
            self._since_s = time.monotonic()
        log.error(self._said, extra={"reason": reason})

    def over(self) -> bool:
        """Enter that it works; say whether it did not until now."""
        if self._since_s is None:  # nearly always
            return False
        with self._lock:
            if self._since_s is None:
                return False
            lasted_s, self._since_s = time.monotonic() - self._since_s, None
        log.warning("%s: that is over", self._said, extra={"lasted_s": round(lasted_s, 1)})
        return True

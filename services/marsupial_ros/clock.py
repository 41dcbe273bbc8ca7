"""Mission time: that of this machine, or simulated time as ROS tells it."""

from __future__ import annotations

import time


class Clock:
    """Seconds that never go back, and mission time in ms; if `told`, from messages (``/clock``), not this machine."""

    def __init__(self, *, told: bool) -> None:
        self._told_s: float | None = None
        self._told = told
        self._began_s = 0.0
        self._began_ms = 0

    @property
    def known(self) -> bool:
        """Whether there is a time."""
        return not self._told or self._told_s is not None

    @property
    def now_s(self) -> float:
        """The time in seconds, from some moment on."""
        if not self._told:
            return time.monotonic()
        return self._told_s or 0.0

    @property
    def mission_ms(self) -> int:
        """The time of the mission."""
        return self._began_ms + max(0, round(1000 * (self.now_s - self._began_s)))

    def heard_s(self, stamp_s: float) -> float:
        """Return the time that what was heard just now is of, by its stamp; 0 is no stamp.

        ROS's stamps are by the clock of another machine, unless time is told: then they say how old something is.
        """
        return min(stamp_s, self.now_s) if self._told and stamp_s else self.now_s

    def tell(self, now_s: float) -> None:
        """Set the time. After a simulator was reset the clock stands still until it catches up."""
        self._told_s = now_s if self._told_s is None else max(now_s, self._told_s)

    def begin(self, at_ms: int = 0) -> None:
        """Set mission time to `at_ms`."""
        self._began_s, self._began_ms = self.now_s, at_ms

"""Background tasks that never fail silently: each failure is logged and counted, and the task restarts."""

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Callable, Coroutine
from contextlib import suppress

# pause before a restart, as the cause of the failure may persist
RESTART_S = 1.0
# a task that fails again and again must not fill the log
LOG_S = 60.0

Work = Callable[[], Coroutine[None, None, None]]

log = logging.getLogger("marsupial.background")


async def pause(event: asyncio.Event, seconds: float) -> None:
    """Wait until an event is set, for `seconds` at most."""
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await event.wait()


class BackgroundTasks:
    """The tasks of one event loop: none restarts once `stop` is set; `failed` gets each failed task's name."""

    def __init__(
        self, stop: asyncio.Event, failed: Callable[[str], None], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self.running: set[asyncio.Task[None]] = set()
        self._stop = stop
        self._failed = failed
        self._clock_s = clock_s
        self._logged_s: dict[str, float] = {}
        self._unlogged: Counter[str] = Counter()

    def start(self, name: str, work: Work, *, restart: bool = True) -> asyncio.Task[None]:
        """Start a task, and restart it whenever it fails (if `restart`), until it returns."""
        task = asyncio.create_task(self._supervise(name, work, restart), name=name)
        self.running.add(task)
        task.add_done_callback(self.running.discard)
        return task

    def report(self, name: str, error: Exception) -> None:
        """Count a failure, and log it unless one of that name was logged within `LOG_S`."""
        self._failed(name)
        self._unlogged[name] += 1
        now_s = self._clock_s()
        if now_s - self._logged_s.get(name, -LOG_S) >= LOG_S:
            self._logged_s[name] = now_s
            log.error("background task failed", exc_info=error, extra={"task": name, "times": self._unlogged.pop(name)})

    async def _supervise(self, name: str, work: Work, restart: bool) -> None:
        while True:
            try:
                return await work()
            except Exception as error:
                self.report(name, error)
            if not restart:
                return
            await pause(self._stop, RESTART_S)
            if self._stop.is_set():
                return

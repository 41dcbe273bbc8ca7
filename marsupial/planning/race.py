"""Engines in threads, side by side: what they say comes in one queue, and all of them can be stopped at any time.

An engine waits while its event is being looked at, as a generator does: otherwise it and who looks at it would slow
each other down, and engines that judge their pace by their first steps would be misled. It is stopped through the
`cancel` of its events where they have one, and through its clock, which then leaps ahead: an engine that keeps a budget
by that clock ends by itself at its next look at it.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from threading import Lock, Thread

from marsupial.model.planning import Cancellable, Finished, Improved

Clock = Callable[[], float]

PATIENCE_S = 2.0
"""How long is waited for engines that were stopped; one that heeds nothing is left to its thread, a daemon."""

_LEAP_S = 1e9

Event = Improved | Finished | Exception
"""What comes of an engine: what it says, or what it raised instead."""


Search = Callable[[Clock], Iterator[Improved | Finished]]
"""Asks an engine made around a clock."""


class Race:
    """The engines that run, each by a name of its own; `clock` gives wall-clock seconds."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._events: queue.SimpleQueue[tuple[str, Event | None, threading.Event]] = queue.SimpleQueue()
        self._looked_at = threading.Event()
        self._threads: dict[str, Thread] = {}
        self._cancellable: list[Cancellable] = []
        self._stopped = False
        self._leaps = 0
        self._lock = Lock()
        self.running: set[str] = set()

    def enter(self, name: str, search: Search) -> None:
        """Have an engine search in a thread of its own."""
        self.running.add(name)
        thread = Thread(target=self._follow, args=(name, search), name=f"planner {name}", daemon=True)
        self._threads[name] = thread
        thread.start()

    def next(self, seconds: float | None = None) -> tuple[str, Event] | None:
        """Return the next event with its engine's name, or None if there is none within `seconds` or an engine left."""
        self._looked_at.set()
        try:
            name, event, self._looked_at = self._events.get(timeout=None if seconds is None else max(0.0, seconds))
        except queue.Empty:
            return None
        if event is None:
            self.running.discard(name)
            return None
        return name, event

    @property
    def alive(self) -> bool:
        """Whether an engine has not ended yet, though it may have been stopped."""
        return any(thread.is_alive() for thread in self._threads.values())

    def stop(self, patience_s: float = PATIENCE_S) -> None:
        """Stop every engine and wait for them, though not for ever."""
        with self._lock:
            self._stopped = True
            for events in self._cancellable:
                events.cancel()
        self._looked_at.set()
        with suppress(queue.Empty):
            while True:
                self._events.get_nowait()[2].set()
        until = time.monotonic() + patience_s
        for thread in self._threads.values():
            thread.join(max(0.0, until - time.monotonic()))

    def _engine_clock(self) -> float:
        self._leaps += self._stopped  # each look: an engine that begins only now has to see it leap as well
        return self._clock() + _LEAP_S * self._leaps

    def _follow(self, name: str, search: Search) -> None:
        try:
            events = search(self._engine_clock)
            with self._lock:
                if isinstance(events, Cancellable):
                    self._cancellable.append(events)
                    if self._stopped:
                        events.cancel()
            for event in events:
                if not self._tell(name, event) and not isinstance(events, Cancellable):
                    break
        except Exception as error:
            self._tell(name, error)
        finally:
            self._tell(name, None)

    def _tell(self, name: str, event: Event | None) -> bool:
        """Hand over an event and wait until it has been looked at; say whether more is wanted."""
        looked_at = threading.Event()
        with self._lock:
            if self._stopped:
                return False
            self._events.put((name, event, looked_at))
        return looked_at.wait() and not self._stopped

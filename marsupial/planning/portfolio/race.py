"""Engines in threads, side by side: what they say comes in one queue, and all of them can be stopped at any time.

An engine waits while its event is being looked at, as a generator does: otherwise it and who looks at it would slow
each other down, and engines that judge their pace by their first steps would be misled. It is stopped through the
`cancel` of its events where they have one, and through its clock, which then leaps ahead: an engine that keeps a budget
by that clock ends by itself at its next look at it.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from contextlib import suppress
from threading import Event, Lock, Thread

from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Cancellable, Engine, Finished, Improved, Outcome
from marsupial.model.situation import Situation

Clock = Callable[[], float]

PATIENCE_S = 2.0
"""How long is waited for engines that were stopped; one that heeds nothing is left to its thread, a daemon."""

_LEAP_S = 1e9


class Race:
    """The engines that run for one situation; `clock` gives wall-clock seconds."""

    def __init__(self, situation: Situation, clock: Clock) -> None:
        self._situation = situation
        self._clock = clock
        self._events: queue.SimpleQueue[tuple[str, Improved | Finished | None, Event]] = queue.SimpleQueue()
        self._looked_at = Event()
        self._threads: dict[str, Thread] = {}
        self._cancellable: list[Cancellable] = []
        self._stopped = False
        self._leaps = 0
        self._lock = Lock()
        self.running: set[str] = set()

    def enter(self, name: str, make: Callable[[Clock], Engine], budget: Budget, start: Plan | None) -> None:
        """Have the engine that `make` makes around a clock search in a thread of its own."""
        self.running.add(name)
        thread = Thread(target=self._follow, args=(name, make, budget, start), name=f"planner {name}", daemon=True)
        self._threads[name] = thread
        thread.start()

    def next(self, seconds: float) -> tuple[str, Improved | Finished] | None:
        """Return the next event with its engine's name, or None if there is none within `seconds` or an engine left."""
        self._looked_at.set()
        try:
            name, event, self._looked_at = self._events.get(timeout=max(0.0, seconds))
        except queue.Empty:
            return None
        if event is None:
            self.running.discard(name)
            return None
        return name, event

    def stop(self) -> None:
        """Stop every engine and wait for them, though not for ever."""
        with self._lock:
            self._stopped = True
            for events in self._cancellable:
                events.cancel()
        self._looked_at.set()
        with suppress(queue.Empty):
            while True:
                self._events.get_nowait()[2].set()
        until = time.monotonic() + PATIENCE_S
        for thread in self._threads.values():
            thread.join(max(0.0, until - time.monotonic()))

    def _engine_clock(self) -> float:
        self._leaps += self._stopped  # each look: an engine that begins only now has to see it leap as well
        return self._clock() + _LEAP_S * self._leaps

    def _follow(self, name: str, make: Callable[[Clock], Engine], budget: Budget, start: Plan | None) -> None:
        try:
            events = make(self._engine_clock).solve(self._situation, budget, start=start)
            with self._lock:
                if isinstance(events, Cancellable):
                    self._cancellable.append(events)
                    if self._stopped:
                        events.cancel()
            for event in events:
                if not self._tell(name, event) and not isinstance(events, Cancellable):
                    break
        except Exception as error:
            self._tell(name, crash(error))
        finally:
            self._tell(name, None)

    def _tell(self, name: str, event: Improved | Finished | None) -> bool:
        """Hand over an event and wait until it has been looked at; say whether anybody is still interested."""
        looked_at = Event()
        with self._lock:
            if self._stopped:
                return False
            self._events.put((name, event, looked_at))
        return looked_at.wait() and not self._stopped


def crash(error: Exception) -> Finished:
    """Return the end of an engine that raised `error`."""
    return Finished(outcome=Outcome.CRASHED, detail=f"{type(error).__name__}: {error}")

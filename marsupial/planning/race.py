"""Engines in threads, side by side: their events come through one queue, and all can be stopped at any time.

An engine waits while its event is handled, as a generator does: otherwise it and the caller would slow each other down,
and engines that estimate their pace from their first steps would be misled. An engine is stopped by `cancel` of its
events where they have one, and by its clock, which then leaps ahead: an engine with a budget in seconds ends when it
next reads the clock.
"""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from threading import Lock, Thread

from marsupial.model import MAKESPAN, Objective, Plan, Situation
from marsupial.model.planning import Budget, Cancellable, Engine, Finished, Improved, Outcome

WallClock = Callable[[], float]

PATIENCE_S = 2.0  # longest wait for stopped engines; one that ignores it is left to its daemon thread

GRACE_S = 0.25  # time after the end of its budget in which an engine may still yield
_LEAP_S = 1e9

EngineEvent = Improved | Finished | Exception  # what an engine yields, or the exception that it raised


Search = Callable[[WallClock], Iterator[Improved | Finished]]  # starts the search of an engine that uses a given clock


class Race:
    """The engines that run, by unique names; `clock` gives wall-clock seconds."""

    def __init__(self, clock: WallClock) -> None:
        self._clock = clock
        self._events: queue.SimpleQueue[tuple[str, EngineEvent | None, threading.Event]] = queue.SimpleQueue()
        self._handled = threading.Event()
        self._threads: dict[str, Thread] = {}
        self._cancellable: list[Cancellable] = []
        self._stopped = False
        self._leaps = 0
        self._lock = Lock()
        self.running: set[str] = set()

    def enter(self, name: str, search: Search) -> None:
        """Start an engine in a thread of its own."""
        self.running.add(name)
        thread = Thread(target=self._follow, args=(name, search), name=f"planner {name}", daemon=True)
        self._threads[name] = thread
        thread.start()

    def next(self, seconds: float | None = None) -> tuple[str, EngineEvent] | None:
        """Return the next event with its engine's name, or None if there is none within `seconds` or an engine left."""
        self._handled.set()
        try:
            name, event, self._handled = self._events.get(timeout=None if seconds is None else max(0.0, seconds))
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
        """Stop all engines and wait for them, `patience_s` at most."""
        with self._lock:
            self._stopped = True
            for events in self._cancellable:
                events.cancel()
        self._handled.set()
        with suppress(queue.Empty):
            while True:
                self._events.get_nowait()[2].set()
        until = time.monotonic() + patience_s
        for thread in self._threads.values():
            thread.join(max(0.0, until - time.monotonic()))

    def _engine_clock(self) -> float:
        # The clock leaps at every reading: an engine that begins only now has to see a leap as well.
        self._leaps += self._stopped
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

    def _tell(self, name: str, event: EngineEvent | None) -> bool:
        """Pass an event on and wait until it is handled; return whether to continue."""
        handled = threading.Event()
        with self._lock:
            if self._stopped:
                return False
            self._events.put((name, event, handled))
        return handled.wait() and not self._stopped


class Punctual:
    """A third-party engine that is cut off `GRACE_S` after the end of a budget in seconds.

    marsupial's own engines read the clock, and external ones are processes that are killed. An engine in this process
    may do neither, and Python can't end a thread. So it searches in a thread that is abandoned when the time is up, and
    its later events are dropped. Until that thread ends, the engine is not asked again.
    """

    def __init__(self, engine: Engine) -> None:
        self.info = engine.info
        self._engine = engine
        self._last: Race | None = None

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        if budget.seconds is None:
            yield from self._engine.solve(situation, budget, objective=objective, start=start)
            return
        if self._last is not None and self._last.alive:
            yield Finished(outcome=Outcome.TIMEOUT, detail="not asked: still busy with what it was asked before")
            return
        begun = time.monotonic()
        end, patience_s = begun + budget.seconds + GRACE_S, PATIENCE_S
        race = self._last = Race(time.monotonic)
        race.enter(self.info.name, lambda _: self._engine.solve(situation, budget, objective=objective, start=start))
        outcome = Outcome.TIMEOUT
        try:
            while race.running:
                said = race.next(end - time.monotonic())
                if said is None and race.running:
                    patience_s = 0.0
                    detail = f"cut off {GRACE_S:g} s after its budget of {budget.seconds:g} s"
                    yield Finished(outcome=outcome, detail=detail, elapsed_s=time.monotonic() - begun)
                    return
                if said is not None:
                    _, event = said
                    if isinstance(event, Exception):
                        raise event
                    outcome = Outcome.SATISFICING
                    yield event
        finally:
            race.stop(patience_s)


def punctual(engine: Engine) -> Engine:
    """Return the engine, cut off when its budget is up; an unusable engine is returned unchanged."""
    return engine if isinstance(engine, Punctual) or engine.info.missing is not None else Punctual(engine)

"""Progress of a comparison on stderr: a bar with the time left on a terminal, else occasional lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from marsupial.bench.compare.conduct import Watch
from marsupial.bench.compare.rows import MissionRow
from marsupial.cli.display.messages import Volume, say, volume
from marsupial.wording import clock, counted

LINE_EVERY_S = 30.0  # wall-clock time between two lines
FRAME_EVERY_S = 0.2  # wall-clock time between two updates of the bar


@contextmanager
def compare_progress(now: Callable[[], float] = time.monotonic) -> Iterator[Watch]:
    """Yield the callback for the missions of a comparison; `now` returns wall-clock seconds."""
    console = Console(file=sys.stderr)
    if volume() is Volume.QUIET or not console.is_terminal or console.is_dumb_terminal:
        yield Lines(now).watch
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield _Bar(now, live).watch


class Lines:
    """Prints the progress of a comparison: at its start and end, at each failure, and every `LINE_EVERY_S`."""

    every_s = LINE_EVERY_S

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._began_s = now()
        self._printed_s = self._began_s
        self._before = 0

    def watch(self, row: MissionRow | None, done: int, total: int) -> None:
        """Print what a finished mission requires, or the start (None)."""
        if row is None:
            self._began_s = self._printed_s = self._now()
            self._before = done
            say(counted(total, "mission") + (f", {done} of them done before" if done else ""))
            return
        if not row.complete:
            self.tell(f"{row.trial}: {row.status}: {row.reason}")
        elif volume() is Volume.VERBOSE:
            self.tell(f"{row.trial}: {row.status}")
        if done == total or self._now() - self._printed_s >= self.every_s:
            self.show(done, total)

    def show(self, done: int, total: int) -> None:
        """Print the progress."""
        self._printed_s = self._now()
        say(self.words(done, total))

    def tell(self, text: str) -> None:
        """Print a message."""
        say(text)

    def words(self, done: int, total: int) -> str:
        """Return the progress as text, with the time left at the present rate."""
        elapsed = self._now() - self._began_s
        left = elapsed / max(1, done - self._before) * (total - done)
        ending = f"about {clock(left)} left" if done < total else f"done in {clock(elapsed)}"
        return f"{done:>{len(str(total))}} of {counted(total, 'mission')} ({done / total:.0%}), {ending}"


class _Bar(Lines):
    """Redraws a bar a few times a second."""

    every_s = FRAME_EVERY_S

    def __init__(self, now: Callable[[], float], live: Live) -> None:
        super().__init__(now)
        self._live = live

    def show(self, done: int, total: int) -> None:
        self._printed_s = self._now()
        bar = Table.grid(padding=(0, 1))
        bar.add_row(ProgressBar(total=total, completed=done, width=40), self.words(done, total))
        self._live.update(bar, refresh=True)
        if done == total:
            self.tell(self.words(done, total))

    def tell(self, text: str) -> None:
        self._live.console.print(text, markup=False, highlight=False)

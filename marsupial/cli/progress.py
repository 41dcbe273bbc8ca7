"""Progress of a mission on stderr: a live picture on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from marsupial.bench.simulate import reachable_area
from marsupial.cli.messages import say
from marsupial.cli.tables import clock
from marsupial.cli.thumbnail import Mark, thumbnail
from marsupial.cli.watch import Watch
from marsupial.mission.observer import Observer
from marsupial.mission.placement import place_team
from marsupial.model.mission import MissionEnded, MissionEvent, MissionStarted, Planned
from marsupial.model.robots import Role
from marsupial.model.scenario import Scenario

LINE_EVERY_MS = 180_000
"""Simulated time between two lines."""

FRAME_EVERY_S = 0.1
"""Wall-clock time between two pictures."""


@contextmanager
def progress(scenario: Scenario, seed: int) -> Iterator[Observer]:
    """Yield an observer that shows a mission of this scenario as it goes."""
    watch = Watch(reachable_area(scenario, place_team(scenario, seed)))
    console = Console(file=sys.stderr)
    if not console.is_terminal:
        yield _Lines(watch)
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield _Picture(watch, live, console)


class _Lines(Observer):
    """Prints the start, the end, and at a replanning a line if the last one is long ago."""

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._next_ms = 0

    def event(self, event: MissionEvent) -> None:
        self._watch.event(event)
        if isinstance(event, MissionStarted):
            say(f"{event.scenario}: {event.strategy} ({event.planner}), {len(event.robots)} robots, seed {event.seed}")
        elif isinstance(event, MissionEnded):
            say(f"{self._head()}  {event.status}: {event.reason}")
        elif isinstance(event, Planned) and event.t_ms >= self._next_ms:
            self._next_ms = event.t_ms + LINE_EVERY_MS
            say(f"{self._head()}  plan {event.revision} for {_counted(len(event.targets), 'target')} ({event.trigger})")

    def _head(self) -> str:
        return f"{clock(self._watch.t_ms / 1000):>8}  {self._watch.coverage:>4.0%}"


class _Picture(Observer):
    """Redraws the map, the clock and what every robot does, a few times a second."""

    def __init__(self, watch: Watch, live: Live, console: Console) -> None:
        self._watch = watch
        self._live = live
        self._console = console
        self._title = ""
        self._drawn_s = 0.0

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, MissionStarted):
            self._title = f"{event.scenario}: {event.strategy} ({event.planner}), seed {event.seed}"
        elif event.t_ms > self._watch.t_ms:  # amid the events of one moment robots seem to have nothing to do
            self._draw()
        self._watch.event(event)

    def _draw(self) -> None:
        if time.monotonic() - self._drawn_s >= FRAME_EVERY_S:
            self._live.update(self._frame(), refresh=True)
            self._drawn_s = time.monotonic()

    def _frame(self) -> Group:
        watch = self._watch
        rows = self._console.height - len(watch.robots) - 4
        head = Text(f"{self._title}   {clock(watch.t_ms / 1000)}   plan {watch.revision} ({watch.trigger})")
        head.truncate(self._console.width, overflow="ellipsis")
        bar = Table.grid(padding=(0, 1))
        bar.add_row(ProgressBar(total=1.0, completed=watch.coverage, width=40), f"{watch.coverage:.1%} known")
        parts: list[Text | Table] = [head, bar]
        if rows >= 4:
            parts.append(thumbnail(watch.cells, self._marks(), self._console.width - 1, rows))
        return Group(*parts, self._robots())

    def _marks(self) -> list[Mark]:
        marks = []
        for name, robot in self._watch.robots.items():
            if robot.carrier is None:
                cell = self._watch.cell_of(name)
                marks.append(Mark(cell.x, cell.y, robot.kind.role is Role.CARRIER))
        return marks

    def _robots(self) -> Table:
        table = Table.grid(padding=(0, 2))
        for name, robot in self._watch.robots.items():
            cargo = self._watch.aboard(name)
            style = "bold red" if robot.lost else "cyan" if robot.kind.role is Role.CARRIER else "yellow"
            words = self._watch.doing(name) + (f", with {', '.join(cargo)}" if cargo else "")
            table.add_row(Text(name, style=style), Text(words))
        return table


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"

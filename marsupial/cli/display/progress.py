"""Progress of a mission on stderr: a live picture on a terminal, else occasional lines."""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from marsupial.cli.display.messages import Alive, Volume, volume
from marsupial.cli.display.picture import Picture, moves, plan_line, plan_text, printable
from marsupial.mission.observer import Observer, Observers
from marsupial.mission.state import MissionTracker, RobotView, views
from marsupial.model import UNKNOWN, Mask, MissionEnded, MissionEvent, MissionStarted, Outcome, Planned, PlanningReport
from marsupial.wording import clock, counted

# Simulated time between two lines, as (up to this time, interval): longer missions print fewer lines.
LINE_EVERY_MS = ((3_600_000, 60_000), (36_000_000, 600_000), (math.inf, 3_600_000))

FRAME_EVERY_S = 0.1  # least wall-clock time between two pictures
FRAME_SHARE = 0.05  # greatest share of wall-clock time for drawing pictures, which takes long for large maps
PREPARING = "preparing the mission ..."  # message before the first event

# Outcomes that are not failures of a planner, even without a plan: there was nothing to do.
_WITH_PLAN = (Outcome.OPTIMAL, Outcome.SATISFICING, Outcome.UNSOLVABLE)


class MissionWatch(MissionTracker):
    """The state of a running mission. `area`: mask (height, width) of the cells to explore."""

    def __init__(self) -> None:
        super().__init__()
        self.area: Mask = np.zeros((0, 0), dtype=np.bool_)

    def reachable(self, area: Mask) -> None:
        self.area = area

    @property
    def coverage(self) -> float:
        """Known share of the reachable cells, 0 to 1."""
        wanted = int(np.count_nonzero(self.area))
        return int(np.count_nonzero(self.cells[self.area] != UNKNOWN)) / wanted if wanted else 1.0

    def views(self) -> tuple[RobotView, ...]:
        """Return the present state of every robot, in the order of the team."""
        return views(self.tracks, self.t_ms, whole_cells=True)


@contextmanager
def progress() -> Iterator[Observer]:
    """Yield an observer that shows the progress of a mission."""
    if volume() is Volume.QUIET:
        yield Observer()
        return
    console = Console(file=sys.stderr)
    if not moves(console):
        lines = _Lines()
        with Alive(lines.now) as lines.alive:
            yield Observers([lines, _Plannings(lines, lines.alive.say)])
        return
    with Live(Text(PREPARING), console=console, auto_refresh=False, transient=True) as live:
        picture = _LivePicture(live, console)
        yield Observers([picture, _Plannings(picture, lambda text: console.print(Text(text)))])


def headline(watch: MissionWatch) -> str:
    return f"{clock(watch.t_ms / 1000):>8}  {watch.coverage:>4.0%}"


class _Plannings(Observer):
    """Reports the first failure of the planner, and at the volume VERBOSE each plan with the time of planning."""

    def __init__(self, watch: MissionWatch, report: Callable[[str], None]) -> None:
        self._watch = watch
        self._print = report
        self._reported = False
        self._took = ""

    def planned(self, report: PlanningReport) -> None:
        self._took = f"; planned in {report.wall_s:.3f} s"
        # Nothing else shows a failure, as other plans are used then.
        if report.detail and report.outcome not in _WITH_PLAN and not self._reported:
            self._reported = True
            self._print(printable(f"{report.detail}; the mission goes on without (said once)"))

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, Planned) and volume() is Volume.VERBOSE:
            self._print(f"{headline(self._watch)}  {plan_line(event)}{self._took}")


class _Lines(MissionWatch):
    """Prints the start with the first plan, a line a minute of simulated time, and the end."""

    alive: Alive  # prints its lines, and `now` if none was printed for a while

    def __init__(self) -> None:
        super().__init__()
        self._next_ms = 0
        self._plans = 0
        self._targets = 0

    def now(self) -> str:
        if not self._plans:
            return PREPARING
        plans, targets = counted(self._plans, "plan"), counted(self._targets, "target")
        return f"{headline(self)}  {plans} so far, the last for {targets}"

    def event(self, event: MissionEvent) -> None:
        super().event(event)
        if isinstance(event, MissionStarted):
            robots = counted(len(event.robots), "robot")
            self.alive.say(f"{event.scenario}: {event.strategy} ({event.planner}), {robots}, seed {event.seed}")
        elif isinstance(event, MissionEnded):
            self.alive.say(f"{headline(self)}  {event.status}: {event.reason}")
            return
        elif isinstance(event, Planned):
            self._plans += 1
            self._targets = len(event.targets)
        if self._plans and event.t_ms >= self._next_ms and volume() is not Volume.VERBOSE:
            # The next line is due at a multiple of the interval.
            every_ms = next(every for until, every in LINE_EVERY_MS if event.t_ms < until)
            self._next_ms = (event.t_ms // every_ms + 1) * every_ms
            self.alive.say(self.now())


class _LivePicture(MissionWatch):
    """Redraws the map, the clock and the robots' actions a few times a second."""

    def __init__(self, live: Live, console: Console) -> None:
        super().__init__()
        self._live = live
        self._console = console
        self._picture: Picture | None = None
        self._title = ""
        self._next_s = 0.0

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, MissionStarted):
            self._title = f"{event.scenario}: {event.strategy} ({event.planner}), seed {event.seed}"
            self._picture = Picture(event, self.area, self._console)
        elif event.t_ms > self.t_ms:  # between events of the same moment robots seem idle
            self._draw()
        super().event(event)

    def _draw(self) -> None:
        began_s = time.monotonic()
        if self._picture is not None and began_s >= self._next_s:
            self._live.update(self._frame(self._picture), refresh=True)
            ended_s = time.monotonic()
            # a slow picture is followed by a long pause, so that drawing never dominates
            self._next_s = ended_s + max(FRAME_EVERY_S, (ended_s - began_s) / FRAME_SHARE)

    def _frame(self, picture: Picture) -> Group:
        robots = self.views()
        plan = "no plan yet" if self.plan is None else plan_text(self.plan)
        words = f"{clock(self.t_ms / 1000)}  {self._title}  {plan}"
        headline = Text(printable(words), no_wrap=True, overflow="ellipsis")
        bar = Table.grid(padding=(0, 1))
        bar.add_row(ProgressBar(total=1.0, completed=self.coverage, width=40), f"{self.coverage:.1%} known")
        return Group(picture.map(self.cells, robots), headline, bar, picture.team(robots))

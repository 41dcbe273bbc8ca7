"""The work of `marsupial compare` and `marsupial reproduce`: run missions, show progress on stderr, write documents.

Progress is a bar with the time left on a terminal, else occasional lines.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.conduct import LocalPool, MissionRunner, Watch, check_teams, compile_first, conduct
from marsupial.bench.compare.folder import read_curves, read_header, read_rows, read_timings
from marsupial.bench.compare.pairs import FOLDER, pair_pages, replays_in
from marsupial.bench.compare.plan import Comparison
from marsupial.bench.compare.ray_cluster import cluster_at, usable
from marsupial.bench.compare.ray_pool import RayPool
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.rows import CRASHED, ERROR, MissionRow
from marsupial.bench.compare.tables import main_table
from marsupial.cli.display.messages import Volume, say, volume, warn
from marsupial.cli.display.tables import print_table
from marsupial.cli.process.interrupt import Interrupted
from marsupial.errors import UsageError
from marsupial.formats.files import make_folder, replace_file, writing
from marsupial.papers import experiment
from marsupial.wording import clock, counted


def _runner(comparison: Comparison, workers: int | None, ray: str | None) -> MissionRunner:
    """Return the runner: processes on this machine, by default one per core, or a Ray cluster."""
    if ray is not None:
        if workers is not None:
            raise UsageError("--workers can't be combined with --ray: a Ray cluster uses all its processors")
        return RayPool(comparison, usable(cluster_at(ray)))
    return LocalPool(comparison, workers)


def carry_out(comparison: Comparison, out: Path, *, workers: int | None, ray: str | None, retry_failed: bool) -> None:
    """Run the remaining missions of a comparison, with progress on stderr, and write its documents."""
    check_teams(comparison)
    runner = _runner(comparison, workers, ray)
    make_folder(out)
    compile_first(comparison, say)
    drop = (ERROR, CRASHED) if retry_failed else ()
    try:
        with writing(out), compare_progress() as watch:
            conduct(comparison, runner, out, watch, drop=drop)
    except (Interrupted, KeyboardInterrupt):
        say(f"results so far are in {out}: the same command resumes, `marsupial compare --report {out}` shows them")
        raise
    if comparison.paper is None:
        _write_pairs(comparison, out)
    report(out)


def _outcome(out: Path) -> ComparisonOutcome:
    return ComparisonOutcome(read_header(out), read_rows(out), read_timings(out), read_curves(out))


def _write_pairs(comparison: Comparison, out: Path) -> None:
    outcome = _outcome(out)
    with writing(out):
        (out / FOLDER).mkdir(exist_ok=True)
        for name, data in pair_pages(comparison, outcome, out):
            replace_file(out / name, data)
        kept = {out / path for path in replays_in(out, outcome)}
        for file in set((out / FOLDER).glob("*.html")) - kept:
            file.unlink()


def report(out: Path) -> None:
    """Write the documents of the comparison in a folder, complete or not, and print the main table."""
    outcome = _outcome(out)
    paper = experiment(str(outcome.header.get("paper")))
    say("writing tables and figures ...")
    with writing(out):
        (out / "figures").mkdir(exist_ok=True)
        stale = {*out.glob("checklist.md"), *out.glob("figures/*.svg"), *out.glob("figures/*.png")}
        for name, data in documents(outcome, paper, replays_in(out, outcome)):
            replace_file(out / name, data)
            stale.discard(out / name)
        for file in stale:  # from before the comparison grew: out of date now
            file.unlink()
    table = main_table(outcome)
    if table.rows and (paper is None or paper.overview):
        # a terminal has room for one interval and no more than two of the other metrics
        cells = [[row[i].text for i in (0, 1, 2, 3, 4, -1)] for row in table.rows]
        rows = [[*row[:3], *(text.partition(" [")[0] for text in row[3:])] for row in cells]
        print_table([*table.heads[:5], table.heads[-1]], rows, right=range(2, 6))
        say(table.caption)
    if missing := outcome.planned - len(outcome.rows):
        warn(f"{missing} of {outcome.planned} missions are missing")
    if failed := len(outcome.incomplete()):
        warn(f"{failed} of {len(outcome.rows)} missions are not complete and count in no mean")
    say(f"wrote {out / 'report.html'}")


LINE_EVERY_S = 30.0  # wall-clock time between two lines
FRAME_EVERY_S = 0.2  # wall-clock time between two updates of the bar


@contextmanager
def compare_progress() -> Iterator[Watch]:
    console = Console(file=sys.stderr)
    if volume() is Volume.QUIET or not console.is_terminal or console.is_dumb_terminal:
        yield Lines(time.monotonic).watch
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield _Bar(time.monotonic, live).watch


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
        self._printed_s = self._now()
        say(self.words(done, total))

    def tell(self, text: str) -> None:
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

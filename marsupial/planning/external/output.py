"""The output of external planners: plans in IPC format on stdout and in files, and claims that there is none.

Each run of lines that are steps is a plan, and so is each file. Plans are timed again and checked; only plans that the
checker accepts and that improve are passed on, the others are counted. An incomplete plan, because the planner computes
before it prints the next line, or is still writing the file, counts once the checker accepts it. With batteries a plan
also counts as printed, with its waits, or changed so that its robots charge as long as they need.
"""

import contextlib
import re
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from marsupial.errors import PlanTextError
from marsupial.formats.pddl.plantext import read_plan_text
from marsupial.model import Plan, Situation
from marsupial.planning.batteries.engine import keeping
from marsupial.planning.checker import check
from marsupial.planning.incumbent import Incumbent
from marsupial.planning.schedule.timeline import retime
from marsupial.wording import counted

PLAN_PREFIX = "plan"  # prefixes of plan files' names
TAIL_BYTES = 2000  # most bytes of the last output stored

_LAST_LINES = 3
_LINE_LETTERS = 240  # most of the last output reported: characters of each line, and lines

# matches a line with the reason why there is no plan; some planners print all their options after it (POPF)
_COMPLAINT = re.compile(
    r"(?i)error|unknown|unrecogni[sz]ed|unsupported|invalid|fail|assert|no such|(?:can ?not|can't|could not) "
)

_SCAN_S = 0.05  # least time between two scans of the folder: output may arrive in thousands of chunks
_PLAN_BYTES = 4 << 20  # most bytes read of one plan

_LINE_BYTES = 1 << 16

_STEP = re.compile(r"\s*[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?\s*:\s*\(", re.IGNORECASE)
_UNSOLVABLE = re.compile(
    r"problem unsolvable(!|$)"  # POPF, OPTIC; not "unsolvable by EHC, and best-first search has been disabled"
    r"|the problem is unsolvable since at the fixpoint level"  # LPG
    r"|completely explored state space -- no solution"  # TFD
    r"|problem has been proven unsolvable",
    re.IGNORECASE,
)


def last_words(errors: bytes, printed: bytes) -> str:
    """Return the last lines of stderr and stdout, after the first that looks like an error, as text."""
    parts = [" | ".join(_last_lines(text.decode(errors="replace"))) for text in (errors, printed) if text.strip()]
    return f", saying: {' || '.join(parts)}" if parts else ""


def _last_lines(text: str) -> list[str]:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    last = lines[-_LAST_LINES:]
    complaint = next((line for line in lines[:-_LAST_LINES] if _COMPLAINT.search(line)), None)
    lines = last if complaint is None or any(map(_COMPLAINT.search, last)) else [complaint, *last]
    return [_shown(line) for line in lines]


def _shown(line: str) -> str:
    cut = line if len(line) <= _LINE_LETTERS else f"{line[:_LINE_LETTERS]}..."
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(cut.split()))


class Printed:
    """Cuts plans out of printed output; `claim` is the line that denies a plan, if any."""

    def __init__(self) -> None:
        self.claim: str | None = None
        self.tail = self._line = b""
        self._steps: list[str] = []
        self._size = self._reported = 0

    def feed(self, chunk: bytes) -> Iterator[str]:
        """Take the next chunk and yield the plans that it completes."""
        self.tail = (self.tail + chunk)[-TAIL_BYTES:]
        *lines, self._line = (self._line + chunk).split(b"\n")
        self._line = self._line[-_LINE_BYTES:]
        for line in lines:
            yield from self._take(line.decode(errors="replace"))

    def _take(self, line: str) -> Iterator[str]:
        if _STEP.match(line):
            self._size += len(line)
            if self._size <= _PLAN_BYTES:
                self._steps.append(line)
            return
        if _UNSOLVABLE.search(line.strip()):
            self.claim = line.strip()
        yield from self._flush()

    def _flush(self) -> Iterator[str]:
        steps, self._steps, self._size, self._reported = self._steps, [], 0, 0
        if steps:
            yield "\n".join(steps)

    def growing(self, chunk: bytes) -> Iterator[str]:
        """Yield the incomplete plan, once, when output pauses."""
        if not chunk and len(self._steps) > self._reported:
            self._reported = len(self._steps)
            yield "\n".join(self._steps)

    def rest(self) -> Iterator[str]:
        """Yield the plan left at the end."""
        yield from self.feed(b"\n")
        yield from self._flush()


class PlanFiles:
    """The files in a folder whose names begin like plan files; each one is a plan."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._seen: dict[Path, tuple[int, int]] = {}
        self._looked = 0.0

    def changed(self) -> Iterator[str]:
        """Yield the texts of files that are new or changed since the last look."""
        if time.monotonic() - self._looked < _SCAN_S:
            return
        self._looked = time.monotonic()
        for path in self._paths():
            with contextlib.suppress(OSError):  # renamed in the meantime
                state = path.stat()
                if self._seen.get(path) != (state.st_mtime_ns, state.st_size):
                    self._seen[path] = state.st_mtime_ns, state.st_size
                    yield _steps_in(path)

    def all(self) -> Iterator[str]:
        """Yield the texts of all files."""
        for path in self._paths():
            with contextlib.suppress(OSError):
                yield _steps_in(path)

    def _paths(self) -> list[Path]:
        return sorted(path for path in self._folder.glob(f"{PLAN_PREFIX}*") if path.is_file())


def _steps_in(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return "\n".join(line for line in file.read(_PLAN_BYTES).splitlines() if _STEP.match(line))


class PlanReader:
    """Reads, retimes and checks plans; passes improving plans on and records the faults of others."""

    def __init__(self, situation: Situation, start: Plan | None = None) -> None:
        self._situation = situation
        self.incumbent = Incumbent(situation)
        if start is not None:
            self.incumbent.take(start)
        self.accepted = 0
        self.faults: list[str] = []
        self._unlimited = situation.without_batteries(chargers=True)
        self._changes: list[Callable[[Plan], Plan]] = keeping(situation) if situation.batteries else []
        self._changed: dict[Plan, list[Plan]] = {}  # plans come again in files

    def better(self, texts: Iterable[str], *, complete: bool) -> Iterator[Plan]:
        """Yield the plans that are better than all before; what is wrong counts only where texts are `complete`."""
        # A text without steps is not a plan: planners write such a file if they have found none.
        for text in filter(None, texts):
            fault = ""
            try:
                taken, violations = [], []
                for plan in self._plans(read_plan_text(text, self._situation)):
                    taken += [plan] if self.incumbent.take(plan) else []
                    violations.append(self.incumbent.violation)
                if taken:
                    self.accepted += 1
                    yield taken[-1]
                elif None not in violations:
                    fault = f"wrong, {violations[0]}"
            except PlanTextError as error:
                fault = f"unreadable, {error.problems[0]}"
            if fault and complete:
                self.faults.append(fault)

    def _plans(self, printed: Plan) -> list[Plan]:
        """Return the plans that a printed one stands for."""
        soonest = retime(self._situation, printed.actions)
        if not self._situation.batteries:
            return [soonest]
        if soonest not in self._changed:
            valid = check(self._unlimited, soonest).valid
            self._changed[soonest] = [change(soonest) for change in self._changes] if valid else []
        return [printed, *self._changed[soonest]]

    @property
    def summary(self) -> str:
        """The number of plans accepted, and why others were not."""
        words = f"{counted(self.accepted, 'plan')} accepted"
        return f"{words}, {len(self.faults)} refused (first: {self.faults[0]})" if self.faults else words

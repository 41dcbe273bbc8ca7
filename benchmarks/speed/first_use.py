"""The time of a command's first use on a machine, without stored compiled code, against later uses.

Each use is its own process; its compiled code is stored in a folder that is empty before the first one. Precompiled
code is used where it came with the package, as by everybody. Counted are the process and those it waited for.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.speed.timing import Options, show
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.cli.display.messages import say
from marsupial.errors import UsageError
from marsupial.formats.situation import situation_to_json

INSTANCE = "mission-office-2x2-8"
"""The situation to plan for, from the planner suite."""

SITUATION = "situation.json"

COMMANDS = {
    "run": ("run", "lobby", "--steps", "8"),
    "plan": ("plan", SITUATION, "--steps", "8"),
}
"""The commands by name."""

PROGRAM = "import sys; from marsupial.cli.main import main; sys.exit(main(sys.argv[1:]))"


@dataclass(frozen=True, slots=True, kw_only=True)
class Use:
    """The times of one process, in seconds."""

    cpu_s: float
    wall_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstUseRow:
    """A command's first use, and the medians of its later uses."""

    name: str
    command: str
    first: Use
    later: Use

    @property
    def ratio(self) -> float:
        """How many times more CPU time the first use takes."""
        return self.first.cpu_s / max(self.later.cpu_s, 1e-9)


def bench_first_use(
    names: Sequence[str] = (), *, repeats: int = 3, tell: Callable[[str], None] = lambda text: None
) -> Iterator[FirstUseRow]:
    """Yield a row for each of these commands, all if none are named; `tell` gets the name of the next one.

    Raises
    ------
    UsageError
        If there is no such command, or one fails.
    """
    for name in names:
        if name not in COMMANDS:
            raise UsageError(f"no first use of {name!r} is measured; there are {', '.join(COMMANDS)}")
    for name in names or COMMANDS:
        with tempfile.TemporaryDirectory(prefix="marsupial-") as folder:
            place = Path(folder)
            (place / SITUATION).write_text(situation_to_json(INSTANCES[INSTANCE].situation()), encoding="utf-8")
            tell(f"{name}, nothing kept")
            first = use(COMMANDS[name], place)
            tell(f"{name}, again")
            later = [use(COMMANDS[name], place) for _ in range(repeats)]
        yield FirstUseRow(
            name=name,
            command=" ".join(("marsupial", *COMMANDS[name])),
            first=first,
            later=Use(cpu_s=median(each.cpu_s for each in later), wall_s=median(each.wall_s for each in later)),
        )


def use(command: Iterable[str], folder: Path) -> Use:
    """Run a command in a folder that holds its situation and receives compiled code.

    Raises
    ------
    UsageError
        If it fails.
    """
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    before, began = _cpu_of_children_s(), time.perf_counter()
    words = [str(folder / word) if word == SITUATION else word for word in command]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise UsageError(f"marsupial {' '.join(words)} failed: {done.stderr.strip()}")
    return Use(cpu_s=_cpu_of_children_s() - before, wall_s=time.perf_counter() - began)


def table(rows: Sequence[FirstUseRow]) -> str:
    """Write rows as text."""
    lines = [
        "the first use of a command with no code kept, and the median of those after it; a ratio is of CPU times",
        f"{'first CPU s':>12}{'wall s':>8}{'later CPU s':>13}{'wall s':>8}{'ratio':>8}  command",
    ]
    for row in rows:
        lines.append(
            f"{row.first.cpu_s:>12.1f}{row.first.wall_s:>8.1f}{row.later.cpu_s:>13.2f}{row.later.wall_s:>8.2f}"
            f"{row.ratio:>7.1f}x  {row.command}"
        )
    return "\n".join(lines)


def values(rows: Iterable[FirstUseRow]) -> list[dict[str, Any]]:
    """Return a mapping for each row; times in seconds."""
    return [{**asdict(row), "ratio": row.ratio} for row in rows]


def _cpu_of_children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    what = "The first use of a command, with no compiled code kept, beside the ones after it."
    options = Options("first-use", what, repeats=3)
    options.add_argument("commands", nargs="*", metavar="COMMAND", help=f"{', '.join(COMMANDS)} (both)")
    chosen = options.chosen(arguments)
    rows = list(bench_first_use(chosen.commands, repeats=chosen.repeats, tell=say))
    show(table(rows), values(rows), chosen.json)
    return 0

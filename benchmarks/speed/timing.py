"""Shared by speed benches: median CPU times of repeats, options, output of results."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Generic, TypeVar

from marsupial.cli.display.messages import Volume, set_volume
from marsupial.cli.display.tables import print_report
from marsupial.formats.files import write_file

Result = TypeVar("Result")

LONG_S = 2.0
"""A job that has taken this much CPU time is not repeated again."""

TICK_S = 1e-9
"""The least time reported, so that ratios are of times above 0."""


@dataclass(frozen=True, slots=True)
class Timed(Generic[Result]):
    """A job's last result, and its median CPU time in seconds."""

    result: Result
    cpu_s: float


def timed(job: Callable[[], Result], repeats: int, *, warm: bool = False) -> Timed[Result]:
    """Time a repeatable job; `warm`: run it once before, untimed, since the first run may compile."""
    if warm:
        job()
    seconds: list[float] = []
    while len(seconds) < repeats:
        before = time.process_time()
        result = job()
        seconds.append(time.process_time() - before)
        if sum(seconds) >= LONG_S:
            break
    return Timed(result, max(median(seconds), TICK_S))


class Options(argparse.ArgumentParser):
    """The options of all benches: number of repeats, a file for the rows, quiet."""

    def __init__(self, name: str, description: str, repeats: int) -> None:
        super().__init__(prog=f"python -m benchmarks {name}", description=description)
        self.add_argument(
            "--repeats",
            type=at_least(1),
            default=repeats,
            help="how often each is timed, for a median (%(default)s)",
        )
        self.add_argument("--json", type=Path, metavar="FILE", help="write all rows there")
        self.add_argument("--quiet", "-q", action="store_true", help="tell nothing but errors")

    def add_maps(self, least: int, sizes: Sequence[int]) -> None:
        """Add the options of drawn maps, of `least` cells a side at least."""
        self.add_argument(
            "--size",
            type=at_least(least),
            action="append",
            metavar="CELLS",
            help=f"of a map a side; may be repeated ({', '.join(map(str, sizes))})",
        )
        self.add_argument("--seed", type=at_least(0), default=1, help="draws maps and starts (%(default)s)")

    def chosen(self, arguments: Sequence[str] | None) -> argparse.Namespace:
        """Parse the arguments and set the volume; return the options."""
        found = self.parse_args(arguments)
        if found.quiet:
            set_volume(Volume.QUIET)
        return found


def at_least(least: int) -> Callable[[str], int]:
    """Return a parser of whole numbers of at least `least`."""

    def number(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"must be at least {least}, got {value}")
        return value

    return number


def show(text: str, rows: Sequence[Mapping[str, Any]], file: Path | None) -> None:
    """Print the text, and write the rows to a file if one is given."""
    if file is not None:
        write_file(file, json.dumps(rows, indent=1) + "\n")
    print_report(text)

"""The folder of a comparison: its head, and CSV files that grow with every mission.

Each result is written and synced before the next one, its row last: a mission is done if its row exists. What a killed
process left behind, an incomplete line or times without a row, is removed when the folder is opened again. At the end
lines are sorted, so that files do not depend on the order in which missions finished.
"""

import csv
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from marsupial.bench.compare.plan import Trial, demand_part, parse_header
from marsupial.bench.compare.rows import CURVES, ROWS, TIMINGS, Curve, Format, MissionRow, Record, Result, Timing
from marsupial.errors import InputError, UsageError
from marsupial.formats.files import replace_file, utf8

HEADER = "comparison.json"

FILES: Mapping[str, Format[Any]] = {"coverage.csv": CURVES, "timings.csv": TIMINGS, "rows.csv": ROWS}
"""The CSV files, in the order in which a result is written to them."""


def read_header(path: Path) -> dict[str, Any]:
    """Return the head of the comparison in a folder; raise an `InputError` if there is none or it can't be read."""
    file = path / HEADER
    try:
        return parse_header(utf8(file.read_bytes()).decode(), str(file))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("holds no comparison", source=str(path)) from error


def read_rows(path: Path) -> tuple[MissionRow, ...]:
    """Return the rows in a folder so far."""
    return _read(path / "rows.csv", ROWS)


def read_timings(path: Path) -> tuple[Timing, ...]:
    """Return the wall-clock times in a folder so far."""
    return _read(path / "timings.csv", TIMINGS)


def read_curves(path: Path) -> tuple[Curve, ...]:
    """Return the coverage over time in a folder so far."""
    return _read(path / "coverage.csv", CURVES)


@contextmanager
def opened(path: Path, header: Mapping[str, Any], *, drop: Sequence[str] = ()) -> Iterator[Callable[[Result], None]]:
    """Open the folder of a new or interrupted comparison, repair its files, and yield a function that stores a result.

    Rows with a status in `drop` are removed, so that their missions run again. Raise a `UsageError` if the folder holds
    another comparison or another process has it open, an `InputError` if a file can't be read.
    """
    path.mkdir(parents=True, exist_ok=True)
    with _locked(path):
        if (path / HEADER).exists():
            there = read_header(path)
            demand_part(there, header, str(path / HEADER))
            # the versions with which the folder was begun
            header = {**header, "made_with": there["made_with"]}
        elif any((path / name).exists() for name in FILES):
            raise UsageError(f"{path}: has rows but no {HEADER}: choose another --out")
        replace_file(path / HEADER, (json.dumps(header, indent=1) + "\n").encode())
        done = [row.trial for row in read_rows(path) if row.status not in drop]
        for name, lines in FILES.items():
            _rewrite(path / name, lines, done)
        with ExitStack() as stack:
            files = [stack.enter_context((path / name).open("a", encoding="utf-8", newline="")) for name in FILES]

            def add(result: Result) -> None:
                # FILES ends with the rows: a killed process leaves records without a row, never the reverse
                records = (result.curve, result.timing, result.row)
                for file, lines, record in zip(files, FILES.values(), records, strict=True):
                    if record is not None:
                        file.write(lines.encode(record))
                        file.flush()
                        os.fsync(file.fileno())

            yield add


def sort_lines(path: Path, trials: Sequence[Trial]) -> None:
    """Put the lines of all files into the order of `trials`."""
    for name, lines in FILES.items():
        _rewrite(path / name, lines, trials)


def _rewrite(path: Path, lines: Format[Any], trials: Iterable[Trial]) -> None:
    """Keep the records of `trials` only, in that order; leave the file alone if nothing changes."""
    found = {record.trial: record for record in _read(path, lines)}
    text = lines.head + "".join(lines.encode(found[trial]) for trial in trials if trial in found)
    data = text.encode()
    if not path.exists() or path.read_bytes() != data:
        replace_file(path, data)


def _read(path: Path, lines: Format[Record]) -> tuple[Record, ...]:
    """Return the first record of each mission in a file, without an incomplete last line."""
    try:
        text = utf8(path.read_bytes()).decode(errors="replace")
    except FileNotFoundError:
        return ()
    # a killed process may have cut off the last line
    whole = text[: text.rfind("\n") + 1].splitlines(keepends=True)
    if whole and whole[0] != lines.head:
        raise InputError("line 1: these are not the columns of this marsupial", source=str(path))
    records: dict[Trial, Record] = {}
    for number, fields in enumerate(csv.reader(whole[1:]), 2):
        try:
            record = lines.decode(fields)
        except (ValueError, TypeError) as error:
            raise InputError(f"line {number}: can't be read: {error}", source=str(path)) from error
        records.setdefault(record.trial, record)
    return tuple(records.values())


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock the folder against other processes, if the system supports it."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with (path / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UsageError(f"{path}: another process is at work on it") from error
        yield

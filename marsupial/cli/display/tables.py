"""Data on stdout: tables for people, JSON for programs.

A table is as wide as the terminal, or at most 100 columns if stdout is no terminal.
"""

import json
import sys
import textwrap
from collections.abc import Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from marsupial.formats.files import writing

WIDE = 100  # columns of output that is not a terminal: fits a window, a mail and a page


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]], *, right: Sequence[int] = ()) -> None:
    """Print a table with a header; the columns numbered in `right` are right-aligned."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for i, head in enumerate(heads):
        table.add_column(head, justify="right" if i in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    console = Console(file=sys.stdout, highlight=False, markup=False, width=None if sys.stdout.isatty() else WIDE)
    with writing("to stdout"):
        console.print(table)
        sys.stdout.flush()


def print_facts(facts: Sequence[tuple[str, str]]) -> None:
    """Print named values, one per line, in two columns."""
    widest = max(len(name) for name, _ in facts)
    print_text("".join(f"{name:<{widest}}  {value}\n" for name, value in facts))


def print_report(text: str) -> None:
    """Print the lines of a report; long ones are wrapped at words and indented."""
    lines = []
    for line in text.splitlines():
        inset = " " * (len(line) - len(line.lstrip()) + 2)
        wrapped = textwrap.fill(line, WIDE, subsequent_indent=inset, break_long_words=False, break_on_hyphens=False)
        lines.append(wrapped if len(line) > WIDE else line)
    print_text("".join(f"{line}\n" for line in lines))


def print_text(text: str) -> None:
    """Print `text` unchanged and flush; raise a `UsageError` if stdout can't be written to."""
    with writing("to stdout"):
        print(text, end="", flush=True)


def print_json(value: Any) -> None:
    """Print one JSON value, which must not contain infinite numbers or NaN."""
    print_text(json.dumps(value, indent=2, allow_nan=False, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, frozenset):
        return sorted(value)
    raise TypeError(f"no JSON for {value!r}")

"""What the bench of paths shows: a line per job and map with all references, and values for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from typing import Any

from marsupial.bench.paths import REFERENCES, PathsBench, PathsRow

_WIDTHS = {name: max(8, len(name) + 1) for name in REFERENCES}
"""Columns for the time of each reference; the whole line has 100."""


def table(result: PathsBench) -> str:
    """Write a result as text."""
    heads = "".join(f"{name:>{width}}{'ratio':>7}" for name, width in _WIDTHS.items())
    lines = [
        f"path costs, 8-connected, no corner cutting; seed {result.seed}, median CPU times of {result.repeats} in ms;",
        "a ratio says how many times faster ours is, `off by` how far lengths differ at most, in cells",
        f"{'map':<6}{'cells':>5} {'job':<16}{'ours':>8}{'ns/cell':>8}{heads}{'off by':>8}",
    ]
    for _, rows in groupby(result.rows, key=lambda row: (row.map, row.size, row.job)):
        lines.append(_line(list(rows)))
    lines += _notes(result)
    return "\n".join(lines)


def values(result: PathsBench) -> list[dict[str, Any]]:
    """Return a flat mapping for each row; times in CPU seconds, lengths in cells."""
    told = {"seed": result.seed, "repeats": result.repeats}
    return [{**told, **asdict(row), "ratio": row.ratio} for row in result.rows]


def _line(rows: Sequence[PathsRow]) -> str:
    first = rows[0]
    beside = {row.reference: row for row in rows}
    cells = "".join(_beside(beside.get(name), width) for name, width in _WIDTHS.items())
    return (
        f"{first.map:<6}{first.size:>5} {first.job:<16}{1e3 * first.ours_s:>8.1f}"
        f"{1e9 * first.ours_s / first.size**2:>8.1f}{cells}{max(row.difference for row in rows):>8.1e}"
    )


def _beside(row: PathsRow | None, width: int) -> str:
    return f"{'-':>{width}}{'-':>7}" if row is None else f"{1e3 * row.reference_s:>{width}.1f}{row.ratio:>6.2f}x"


def _notes(result: PathsBench) -> Iterator[str]:
    for pair in result.energy:
        yield (
            f"{pair.map:<6}{pair.size:>5} energy field {1e3 * pair.energy_s:.1f} ms over 8 headings a cell, of lengths "
            f"{1e3 * pair.length_s:.1f} ms: {pair.per_state:.2f} times per state"
        )
    for (name, size), seconds in result.build_s.items():
        yield f"{name:<6}{size:>5} scipy's graph took {1e3 * seconds:.0f} ms to build, not counted above"
    if result.missing is not None:
        yield f"C is left out: {result.missing}"

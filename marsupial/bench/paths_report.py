"""What the bench of paths shows: a line per job and map with all references, and values for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from typing import Any

from marsupial.bench.paths import REFERENCES, PathsBench, PathsRow


def table(result: PathsBench) -> str:
    """Write a result as text."""
    heads = "".join(f"{f'{name} ms':>15}{'ratio':>8}" for name in REFERENCES)
    lines = [
        f"path costs, 8-connected, no corner cutting; seed {result.seed}, median CPU time of {result.repeats}; "
        "a ratio says how many times faster ours is",
        f"{'map':<8}{'cells':>6}  {'job':<17}{'ours ms':>9}{'ns a cell':>11}{heads}{'max difference':>17}",
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
    cells = "".join(map(_beside, map(beside.get, REFERENCES)))
    return (
        f"{first.map:<8}{first.size:>6}  {first.job:<17}{1e3 * first.ours_s:>9.1f}"
        f"{1e9 * first.ours_s / first.size**2:>11.1f}{cells}{max(row.difference for row in rows):>17.1e}"
    )


def _beside(row: PathsRow | None) -> str:
    return f"{'-':>15}{'-':>8}" if row is None else f"{1e3 * row.reference_s:>15.1f}{row.ratio:>7.2f}x"


def _notes(result: PathsBench) -> Iterator[str]:
    for pair in result.energy:
        yield (
            f"{pair.map:<8}{pair.size:>6}  energy field {1e3 * pair.energy_s:.1f} ms over 8 headings a cell, field of "
            f"lengths {1e3 * pair.length_s:.1f} ms: {pair.per_state:.2f} times as long per state"
        )
    for (name, size), seconds in result.build_s.items():
        yield f"{name:<8}{size:>6}  scipy's graph took {1e3 * seconds:.0f} ms to build, not counted above"
    if result.missing is not None:
        yield f"C is left out: {result.missing}"

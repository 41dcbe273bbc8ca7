"""The legend of a map file in a few rows: many greys of the same meaning become a range."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import groupby

from marsupial.model.mapreading import LegendEntry

_NUMBERED = re.compile(r"(\w+) (\d+)")
"""A numbered symbol such as ``grey 205``."""

MOST, LEAST_SHARE = 3, 0.05
"""More symbols than this become a range; at most this many are named, those with at least this share of its cells."""

HEADS = ("symbol in the file", "means", "cells", "most of them")


def legend_rows(legend: Sequence[LegendEntry], names: Mapping[int, str]) -> list[tuple[str, str, str, str]]:
    """Return rows for `HEADS` with terrain `names` by code; many numbered symbols with the same meaning share a row."""
    runs: list[list[LegendEntry]] = []
    for _, alike in groupby(legend, key=_kind):
        run = list(alike)
        runs += [run] if len(run) > MOST else [[entry] for entry in run]
    return [
        (_symbols(run), names[run[0].code], str(sum(entry.cells for entry in run)), _commonest(run)) for run in runs
    ]


def _kind(entry: LegendEntry) -> tuple[str, int]:
    """Return the key of an entry's range: the word before its number, and its terrain code."""
    numbered = _NUMBERED.fullmatch(entry.symbol)
    return numbered[1] if numbered else entry.symbol, entry.code


def _symbols(run: Sequence[LegendEntry]) -> str:
    first, last = run[0].symbol, run[-1].symbol
    return first if len(run) == 1 else f"{first} to {last.rsplit(' ', 1)[1]}"


def _commonest(run: Sequence[LegendEntry]) -> str:
    """Return the most frequent symbols of a range as text."""
    if len(run) == 1:
        return ""
    cells = sum(entry.cells for entry in run)
    ranked = sorted(run, key=lambda entry: -entry.cells)[:MOST]
    named = [f"{entry.symbol} ({entry.cells / cells:.1%})" for entry in ranked if entry.cells >= LEAST_SHARE * cells]
    return ", ".join(named) or f"spread over {len(run)}"

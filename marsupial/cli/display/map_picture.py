"""A map as interpreted, as text: walls as quarters of characters or ``#``, ground in colours or letters; its legend.

A character stands for 2 x 4 small squares of the map. Each of its quarters is a wall if there is one in either of its
two squares; its background is what most of the ground in it is. Where there are no colours a letter says that, and
where there are no quarters (ASCII) a character is a wall if a wall crosses it.
"""

import math
import re
from collections.abc import Mapping, Sequence
from itertools import groupby

import numpy as np
from rich.console import Console
from rich.text import Text

from marsupial.exports.ground import box, coarse
from marsupial.exports.mapclasses import LOOKS, MapClass
from marsupial.model import CellArray, LegendEntry
from marsupial.replay.palette import LIGHT

QUARTERS = " ▘▝▀▖▌▞▛▗▚▐▜▄▙▟█"
"""Characters by the sum of their quarters: 1 upper left, 2 upper right, 4 lower left, 8 lower right."""

DOTS = np.array([[1, 2], [1, 2], [4, 8], [4, 8]])
"""The quarter of each small square of a character, (4, 2), top row first."""

ROWS, COLUMNS = DOTS.shape

CROSSING = 2  # small squares of wall that make a letter a wall: a line from side to side has at least as many

# Columns without a terminal; lines of a terminal that are left for the key and the prompt.
PLAIN_WIDTH, LINES_BESIDE = 80, 4


def map_picture(classes: CellArray, console: Console, *, blocks: bool) -> Text:
    """Return the picture of the known part, as large as fits the console, with its key below."""
    coloured = console.is_terminal and console.color_system is not None and not console.no_color
    wide = console.width if console.is_terminal else PLAIN_WIDTH
    high = max(4, console.height - LINES_BESIDE) if console.is_terminal else classes.shape[0]
    bottom, top, left, right = box(classes != MapClass.UNSEEN)
    shown = classes[bottom:top, left:right]
    block = max(1, math.ceil(shown.shape[1] / (COLUMNS * wide)), math.ceil(shown.shape[0] / (ROWS * high)))
    letters = characters(coarse_map(shown, block), blocks=blocks, plain=not coloured)
    lines = [Text.assemble(*_runs(line, coloured=coloured), no_wrap=True, overflow="crop") for line in letters]
    return Text("\n").join([*lines, *_key(shown, wide, coloured=coloured)])


def coarse_map(classes: CellArray, block: int) -> CellArray:
    """Return one class per block of `block` x `block` cells; any wall or leak in a block decides its class."""
    picture = coarse(classes, block)
    leaks = coarse(np.where(classes == MapClass.LEAK, np.uint8(MapClass.LEAK), np.uint8(MapClass.UNSEEN)), block)
    return np.where(leaks == MapClass.LEAK, leaks, picture).astype(np.uint8)


def characters(picture: CellArray, *, blocks: bool, plain: bool) -> list[list[tuple[str, MapClass]]]:
    """Return the lines of characters, top first, each with the class of its ground."""
    height, width = picture.shape
    upright = picture[::-1]  # row 0 of a map is its lowest
    padded = np.pad(upright, ((0, -height % ROWS), (0, -width % COLUMNS)), constant_values=MapClass.UNSEEN)
    lines = []
    for y in range(0, padded.shape[0], ROWS):
        squares = [padded[y : y + ROWS, x : x + COLUMNS] for x in range(0, padded.shape[1], COLUMNS)]
        lines.append([_character(square, blocks=blocks, plain=plain) for square in squares])
    return lines


def _character(square: CellArray, *, blocks: bool, plain: bool) -> tuple[str, MapClass]:
    walls = square == MapClass.WALL
    ground = square[~walls]
    kind = MapClass.WALL
    if ground.size:
        leak = (ground == MapClass.LEAK).any()
        kind = MapClass.LEAK if leak else MapClass(int(np.bincount(ground).argmax()))
    count = int(walls.sum())
    if blocks and count:
        return QUARTERS[int(np.bitwise_or.reduce(DOTS[walls]))], kind
    if count >= CROSSING:
        return LOOKS[MapClass.WALL].letter, kind
    return (LOOKS[kind].letter if plain else " "), kind


def _runs(line: list[tuple[str, MapClass]], *, coloured: bool) -> list[tuple[str, str]]:
    return [
        ("".join(letter for letter, _ in run), _style(kind) if coloured else "")
        for kind, run in groupby(line, key=lambda character: character[1])
    ]


def _style(kind: MapClass) -> str:
    return f"{LIGHT.wall} on {LOOKS[kind].colour}"


def _key(classes: CellArray, wide: int, *, coloured: bool) -> list[Text]:
    """Return the key: lines with the meaning of the colours or letters that occur."""
    there = set(np.unique(classes).tolist())
    lines = [Text(no_wrap=True)]
    for kind, look in LOOKS.items():
        if kind in there and (kind is not MapClass.WALL or not coloured):
            mark = Text("  " if coloured else look.letter, _style(kind) if coloured else "")
            entry = mark.append(f" {look.text}   ", "")
            if len(lines[-1]) + len(entry) > wide + 2:
                lines.append(Text(no_wrap=True))
            lines[-1] = Text.assemble(lines[-1], entry, no_wrap=True)
    return lines


_NUMBERED = re.compile(r"(\w+) (\d+)")  # a numbered symbol such as ``grey 205``

# More symbols than this become a range; at most this many are named, those with at least this share of its cells.
MOST_SYMBOLS, LEAST_SHARE = 3, 0.05

LEGEND_HEADS = ("symbol in the file", "means", "cells", "most of them")


def legend_rows(legend: Sequence[LegendEntry], names: Mapping[int, str]) -> list[tuple[str, str, str, str]]:
    """Return rows for `LEGEND_HEADS`; many numbered symbols of the same meaning, such as greys, share a row."""
    runs: list[list[LegendEntry]] = []
    for _, alike in groupby(legend, key=_kind):
        run = list(alike)
        runs += [run] if len(run) > MOST_SYMBOLS else [[entry] for entry in run]
    rows = []
    for run in runs:
        symbols = run[0].symbol if len(run) == 1 else f"{run[0].symbol} to {run[-1].symbol.rsplit(' ', 1)[1]}"
        rows.append((symbols, names[run[0].code], str(sum(entry.cells for entry in run)), _commonest(run)))
    return rows


def _kind(entry: LegendEntry) -> tuple[str, int]:
    """Return the key of an entry's range: the word before its number, and its terrain code."""
    numbered = _NUMBERED.fullmatch(entry.symbol)
    return numbered[1] if numbered else entry.symbol, entry.code


def _commonest(run: Sequence[LegendEntry]) -> str:
    """Return the most frequent symbols of a range as text."""
    if len(run) == 1:
        return ""
    cells = sum(entry.cells for entry in run)
    ranked = sorted(run, key=lambda entry: -entry.cells)[:MOST_SYMBOLS]
    named = [f"{entry.symbol} ({entry.cells / cells:.1%})" for entry in ranked if entry.cells >= LEAST_SHARE * cells]
    return ", ".join(named) or f"spread over {len(run)}"

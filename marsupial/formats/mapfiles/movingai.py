"""The grid benchmark format of movingai.com: `.map` files.

``.`` and ``G`` are floor, ``S`` (swamp) is rough ground; ``@`` and ``O`` (out of bounds) and ``T`` (trees) are
obstacles. So is ``W``: the format forbids entering water from land, and robots start on land. The format has no scale:
a cell is one metre unless the caller gives another size. Files have the top row first, grids the bottom row, so rows
are reversed here.

Maps of the League of Robot Runners have the same format, but ``E`` (emitter) and ``S`` (service point) are floor. A
file with an ``E`` is one of theirs; with ``S`` alone it may be of either kind, and counts as MovingAI's. A warning says
so.

References: N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", 2012, and the format page of movingai.com;
`Input_Output_Format.md` of MAPF-Competition/Start-Kit.
"""

from contextlib import suppress
from pathlib import Path

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.formats.files import raise_any, read_bytes, utf8
from marsupial.formats.mapfiles.images import MAX_CELLS
from marsupial.model import FLOOR, OBSTACLE, ROUGH, Grid, LegendEntry, MapReading
from marsupial.wording import counted

SYMBOLS = {".": FLOOR, "G": FLOOR, "S": ROUGH, "@": OBSTACLE, "O": OBSTACLE, "T": OBSTACLE, "W": OBSTACLE}
"""Terrain code of each character."""

LEAGUE_SYMBOLS = SYMBOLS | {"E": FLOOR, "S": FLOOR}
"""The same in maps of the League of Robot Runners."""

_PROBLEM_WORDS = 9  # words in a line of a `.scen` file: bucket, map, width, height, start x and y, goal x and y, length
UNIT_M = 1.0  # default size of a cell


def read_movingai(path: Path | str, resolution_m: float | None = None) -> MapReading:
    """Read a `.map` file and how it was interpreted; cells have `resolution_m`, by default `UNIT_M` with a warning."""
    lines = _lines(utf8(read_bytes(Path(path), MapError, 2 * MAX_CELLS)))
    if not lines:
        raise MapError("is empty", source=str(path))
    if not lines[0].startswith(b"type"):
        fault = f"is no MovingAI map: line 1 must be `type octile`, got {_shown(lines[0][:40])}"
        raise MapError(fault, source=str(path))
    width, height = _size(lines, str(path))
    rows = lines[4:]
    _check_rows(rows, width, height, str(path))
    characters = np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(height, width)
    counts = {symbol: int(np.count_nonzero(characters == ord(symbol))) for symbol in LEAGUE_SYMBOLS}
    symbols = LEAGUE_SYMBOLS if counts["E"] else SYMBOLS
    codes = np.zeros(256, dtype=np.uint8)
    codes[[ord(symbol) for symbol in symbols]] = list(symbols.values())
    warnings = []
    if resolution_m is None:
        warnings.append(
            f"MovingAI maps have no scale: a cell counts as {UNIT_M:g} m here; "
            "a scenario file can say otherwise (`resolution_m` beside `file`)"
        )
    scale_m = UNIT_M if resolution_m is None else resolution_m
    if counts["E"]:
        here = f"'E' in {counted(counts['E'], 'cell')}" + (f" and 'S' in {counts['S']}" if counts["S"] else "")
        warnings.append(f"{here} became floor, as in maps of the League of Robot Runners, since MovingAI has no 'E'")
    elif counts["S"]:
        warnings.append(
            f"'S' became rough ground in {counted(counts['S'], 'cell')} (MovingAI's swamp): robots without rough among "
            "their terrains keep out; if it is a service point of the League of Robot Runners, write '.' instead"
        )
    if counts["W"]:
        warnings.append(f"{counted(counts['W'], 'cell')} of water ('W') became obstacles: no robot on land gets there")
    return MapReading(
        grid=Grid(cells=np.ascontiguousarray(np.flipud(codes[characters])), resolution_m=scale_m),
        format=f"MovingAI map, {scale_m:g} m a cell",
        legend=tuple(LegendEntry(symbol=f"'{s}'", code=symbols[s], cells=n) for s, n in counts.items() if n),
        warnings=tuple(warnings),
        walled=True,
    )


def scenario_map(path: Path) -> str | None:
    """Return the map's name in the first problem of a `.scen` file; None if it can't be read."""
    with suppress(MapError):
        for line in utf8(read_bytes(path, MapError, MAX_CELLS)).splitlines()[1:2]:
            words = line.split(b"\t") if b"\t" in line else line.split()
            return words[1].decode(errors="replace") if len(words) == _PROBLEM_WORDS else None
    return None


def _lines(data: bytes) -> list[bytes]:
    """Return the lines without line ends (LF or CRLF), and without blank lines at the end of the file."""
    lines = [line.rstrip() for line in data.split(b"\n")]
    while lines and not lines[-1]:
        lines.pop()
    return lines


def _size(lines: list[bytes], source: str) -> tuple[int, int]:
    """Return (width, height) from the four header lines, in which height and width may come in either order."""
    head = [line.split() for line in lines[:4]] + [[]] * 4
    problems: list[Problem] = []
    if head[0] != [b"type", b"octile"]:
        problems.append(Problem("line 1", f"must be `type octile`, got {_shown(b' '.join(head[0]))}"))
    sizes: dict[bytes, int] = {}
    for number, words in enumerate(head[1:3], start=2):
        if len(words) == 2 and words[0] in (b"height", b"width") and words[1].isdigit() and len(words[1]) < 10:
            sizes[words[0]] = int(words[1])
        else:
            message = f"must be `height N` or `width N`, got {_shown(b' '.join(words))}"
            problems.append(Problem(f"line {number}", message))
    problems += _size_problems(sizes) if not problems else []
    if head[3] != [b"map"]:
        problems.append(Problem("line 4", f"must be `map`, got {_shown(b' '.join(head[3]))}"))
    raise_any(problems, source)
    return sizes[b"width"], sizes[b"height"]


def _size_problems(sizes: dict[bytes, int]) -> list[Problem]:
    if len(sizes) < 2:
        return [Problem("line 3", "height and width must both be given")]
    width, height = sizes[b"width"], sizes[b"height"]
    if width < 1 or height < 1:
        return [Problem("line 3", f"height and width must be positive, got {width} x {height}")]
    if width * height > MAX_CELLS:
        return [Problem("line 3", f"{width} x {height} cells are more than the limit of {MAX_CELLS}")]
    return []


def _check_rows(rows: list[bytes], width: int, height: int, source: str) -> None:
    known = "".join(LEAGUE_SYMBOLS).encode()
    known_text = " ".join(LEAGUE_SYMBOLS)
    problems: list[Problem] = []
    for number, row in enumerate(rows[:height], start=5):
        if len(row) != width:
            problems.append(Problem(f"line {number}", f"has {len(row)} cells, but width is {width}"))
        if strange := row.translate(None, known):
            column = row.index(strange[:1]) + 1
            fault = f"unknown character {_shown(strange[:1])} in column {column}; known are {known_text}"
            problems.append(Problem(f"line {number}", fault))
    if len(rows) != height:
        message = f"ends the map after {len(rows)} rows, but height is {height}"
        problems.append(Problem(f"line {len(rows) + 4}", message))
    raise_any(problems, source)


def _shown(text: bytes) -> str:
    shown = repr(text[:40].decode("utf-8", errors="backslashreplace"))
    return shown if len(text) <= 40 else f"{shown}..."

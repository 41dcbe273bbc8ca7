"""Reading the `.scen` problems of the MovingAI benchmarks, whose optimal lengths our path searches are held to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from marsupial.errors import MapError, Problem
from marsupial.formats.files import raise_any, read_bytes
from marsupial.formats.mapfiles import movingai
from marsupial.model.grid import Cell


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenProblem:
    """One row of a `.scen` file.

    Parameters
    ----------
    bucket
        Difficulty class: a quarter of the optimal length, rounded down, in most files.
    map_name
        The map as the row writes it, often with a folder.
    width, height
        Size of the map in cells.
    start, goal
        Cells of our grid (row 0 the lowest).
    optimal_length
        Length of the shortest path without cutting corners, in cells.
    """

    bucket: int
    map_name: str
    width: int
    height: int
    start: Cell
    goal: Cell
    optimal_length: float


def read_scen(path: Path | str) -> tuple[ScenProblem, ...]:
    """Read a `.scen` file.

    Raises
    ------
    MapError
        Naming the line of every fault.
    """
    lines = movingai._lines(read_bytes(Path(path), MapError, 256 * 1024 * 1024))
    problems: list[Problem] = []
    found: list[ScenProblem] = []
    if not lines or lines[0].split()[:1] != [b"version"] or lines[0].split()[1:] not in ([b"1"], [b"1.0"]):
        problems.append(Problem("line 1", f"must be `version 1`, got {movingai._shown(lines[0] if lines else b'')}"))
    for number, line in enumerate(lines[1:], start=2):
        if not line:
            continue
        try:
            found.append(_scen_problem(line))
        except ValueError as error:
            problems.append(Problem(f"line {number}", str(error)))
    raise_any(problems, str(path))
    return tuple(found)


def _scen_problem(line: bytes) -> ScenProblem:
    text = line.decode("utf-8")
    fields = text.split("\t") if "\t" in text else text.split()
    if len(fields) != 9:
        raise ValueError(f"must have 9 fields, got {len(fields)}")
    try:
        bucket, width, height, sx, sy, gx, gy = (int(fields[i]) for i in (0, 2, 3, 4, 5, 6, 7))
        length = float(fields[8])
    except ValueError:
        raise ValueError(f"must be numbers beside the map's name, got {movingai._shown(line)}") from None
    for name, x, y in (("start", sx, sy), ("goal", gx, gy)):
        if not (0 <= x < width and 0 <= y < height):
            raise ValueError(f"{name} ({x}, {y}) lies outside {width} x {height} cells")
    if not (math.isfinite(length) and length >= 0):
        raise ValueError(f"the optimal length must be 0 or more, got {fields[8]}")
    return ScenProblem(
        bucket=bucket,
        map_name=fields[1],
        width=width,
        height=height,
        start=Cell(sx, height - 1 - sy),
        goal=Cell(gx, height - 1 - gy),
        optimal_length=length,
    )

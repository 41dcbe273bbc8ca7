"""A map as it was read, with what its symbols were taken to mean.

Maps are misread more often than they are broken: a grey that meant unknown becomes free, and exploration ends
before it began. So a reader hands back, beside the grid, what became of every symbol and what looks doubtful.
"""

from __future__ import annotations

from dataclasses import dataclass

from marsupial.model.grid import Grid


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """One symbol of a map file (``grey 205``, ``'@'``): the terrain code it became, in how many cells."""

    symbol: str
    code: int
    cells: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReading:
    """A map and how it was understood.

    Parameters
    ----------
    grid
        The map.
    format
        What the file was read as, in words.
    legend
        What became of every symbol in the file, in the order of the symbols.
    warnings
        What looks as if it meant something else, each with the symbols and the numbers of cells.
    walled
        Whether the format itself closes the map at its edge, so that free space there is no leak.
    """

    grid: Grid
    format: str
    legend: tuple[LegendEntry, ...] = ()
    warnings: tuple[str, ...] = ()
    walled: bool = False

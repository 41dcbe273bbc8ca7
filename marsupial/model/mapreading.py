"""The result of reading a map file: the grid, and how the reader interpreted each symbol.

Maps are misread more often than they are broken: a grey that meant unknown becomes free, and exploration ends before
it began. So readers also return the meaning that they gave to every symbol, and warnings about doubtful ones.
"""

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
    """A map and how it was interpreted."""

    grid: Grid
    format: str  # in words
    legend: tuple[LegendEntry, ...] = ()  # the interpretation of every symbol in the file, ordered by symbol
    warnings: tuple[str, ...] = ()  # interpretations that look wrong, with the symbols and numbers of cells
    # whether the format itself closes the map at its edge, so that free space there is no gap in a wall
    walled: bool = False

"""Built-in map generators: seeded, sized, and the same bytes every time.

`GENERATORS` is the registry that scenario files and built-in scenarios choose from.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.generators.canvas import CanvasSize, solid
from marsupial.generators.maze import maze
from marsupial.generators.natural import DEFAULT_SHARE, MOST_SHARE, cave, random_obstacles
from marsupial.generators.office import lobby, office
from marsupial.generators.rooms import rooms
from marsupial.model.grid import Grid


@dataclass(frozen=True, slots=True)
class Generator:
    """A map generator."""

    # carves a map out of cells (height, width) that are all obstacle; takes them, a random generator, a `CanvasSize`,
    # and the `options` by keyword
    carve: Callable[..., None]
    least_m: tuple[float, float]  # smallest width and height that it can fill
    # further parameters, numbers from 0 on, with their defaults
    options: Mapping[str, float] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)  # highest value of each option

    def make(self, *, width_m: float, height_m: float, resolution_m: float, seed: int, **options: float) -> Grid:
        """Generate a map with its lower left corner at the origin; raise a `MapError` with every wrong parameter."""
        if wrong := {key: value for key, value in options.items() if not 0 <= value <= self.most[key]}:
            raise MapError([Problem(key, f"must be 0 to {self.most[key]}, got {wrong[key]}") for key in wrong])
        size = CanvasSize(width_m, height_m, resolution_m)
        cells = solid(size, seed, self.least_m)
        self.carve(cells, np.random.default_rng(seed), size, **options)
        return Grid(cells=cells, resolution_m=resolution_m)


GENERATORS: dict[str, Generator] = {
    "office": Generator(office, (30, 24)),
    "maze": Generator(maze, (24, 24)),
    "rooms": Generator(rooms, (12, 12)),
    "random": Generator(random_obstacles, (6, 6), {"share": DEFAULT_SHARE}, {"share": MOST_SHARE}),
    "cave": Generator(cave, (15, 15)),
    "lobby": Generator(lobby, (8, 9)),
}

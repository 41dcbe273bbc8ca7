"""Built-in map generators: seeded, sized, and the same bytes every time.

`GENERATORS` is the registry that scenario files and built-in scenarios choose from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from marsupial.generators.cave import cave
from marsupial.generators.lobby import lobby
from marsupial.generators.maze import maze
from marsupial.generators.office import office
from marsupial.generators.random_obstacles import DEFAULT_SHARE, random_obstacles
from marsupial.generators.rooms import rooms
from marsupial.model.grid import Grid


@dataclass(frozen=True, slots=True, kw_only=True)
class Generator:
    """A map generator.

    Parameters
    ----------
    make
        Takes ``width_m, height_m, resolution_m, seed`` and the `options` by keyword.
    options
        Further parameters, all numbers, with their defaults.
    """

    make: Callable[..., Grid]
    summary: str
    options: Mapping[str, float] = field(default_factory=dict)


GENERATORS: dict[str, Generator] = {
    "office": Generator(make=office, summary="two corridors and rooms on both sides, half of them for rovers only"),
    "maze": Generator(make=maze, summary="a maze around a centre for rovers only with several openings"),
    "rooms": Generator(make=rooms, summary="rooms without corridors, some behind narrow doors"),
    "random": Generator(
        make=random_obstacles, summary="open ground with random boxes", options={"share": DEFAULT_SHARE}
    ),
    "cave": Generator(make=cave, summary="winding halls with patches of rough ground"),
    "lobby": Generator(make=lobby, summary="one hall with a few rooms"),
}

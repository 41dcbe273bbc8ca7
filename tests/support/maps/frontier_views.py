"""Views of a mission for frontier-based strategies, built from a map and the robots on it."""

from collections.abc import Sequence

import numpy as np
from support.maps.drawn_maps import standing

from marsupial.arrays import Floats, Ints
from marsupial.maps.growth import reach_of
from marsupial.maps.targets import Frontier, TargetFinder, cell_at
from marsupial.maps.territory import Territory
from marsupial.model import Grid
from marsupial.paths.fields import PathSearch
from marsupial.strategies.frontier.rule import Explorer, FrontierView


def moment(
    grid: Grid, robots: Sequence[Explorer], frontiers: dict[str, Frontier] | None = None, *, seed: int = 1
) -> FrontierView:
    """Return the view of these robots, with the frontiers of the map by default."""
    territory = Territory(grid, tuple({robot.kind.name: robot.kind for robot in robots}.values()))
    placed = [standing(robot.name, robot.cell, robot.kind.name) for robot in robots]
    standable = {name: footprint.standable for name, footprint in territory.footprints.items()}

    def lengths(robot: Explorer, wanted: Ints) -> Floats:
        search = PathSearch(standable[robot.kind.name], robot.kind.diagonal)
        return search.lengths(robot.cell, [cell_at(cell, grid.width) for cell in wanted.tolist()])

    return FrontierView(
        grid=grid,
        robots=tuple(robots),
        frontiers=frontiers or TargetFinder(territory).frontiers(reach_of(territory, placed)),
        standable=standable,
        lengths=lengths,
        rng=np.random.default_rng(seed),
    )

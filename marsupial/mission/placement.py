"""Where the robots of a scenario start.

Robots without a start of their own are drawn by a seed: the first carrier anywhere in the carriers' largest connected
reach, the others as near to it as they have room ("the robots actually start from the same place",
Wurm et al. 2010, section III).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from marsupial.errors import Problem, ScenarioError
from marsupial.maps.reach import largest_reach
from marsupial.model.grid import Cell, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.scenario import Scenario
from marsupial.paths.fields import PathSearch


def place_team(scenario: Scenario, seed: int) -> tuple[PlacedRobot, ...]:
    """Return every robot of the team at its start.

    Raises
    ------
    ScenarioError
        If there is no room for a robot.
    """
    rng = np.random.default_rng(seed if scenario.start_seed is None else scenario.start_seed)
    grid = scenario.grid.solid()
    drawn = {member.type for member in scenario.team if member.start is None and member.carrier is None}
    reach = {kind.name: largest_reach(grid, kind) for kind in scenario.robot_types if kind.name in drawn}
    taken: list[tuple[Cell, float]] = []
    anchor = next((m.start for m in scenario.team if m.start is not None), None)
    placed: list[PlacedRobot] = []
    for i, member in enumerate(scenario.team):
        cell = member.start
        if cell is None and member.carrier is None:
            kind = scenario.type_of(member)
            room = np.flatnonzero(reach[kind.name])
            room = _nearest_first(room, anchor, reach[kind.name]) if anchor is not None else rng.permutation(room)
            cell = _first_free(room, grid.width, taken, kind.radius_m / grid.resolution_m)
            if cell is None:
                raise ScenarioError([Problem(f"team[{i}].start", f"no room on the map for {member.name} to start")])
        if cell is not None:
            anchor = anchor or cell
            taken.append((cell, scenario.type_of(member).radius_m / grid.resolution_m))
        placed.append(PlacedRobot(name=member.name, type=member.type, cell=cell, carrier=member.carrier))
    return tuple(placed)


def _nearest_first(room: npt.NDArray[np.int64], anchor: Cell, reach: Mask) -> npt.NDArray[np.int64]:
    """Return `room` (row-major indices) by length of the way from `anchor`; where there is none, as the crow flies."""
    way = PathSearch(reach).field(anchor).ravel()[room]
    width = reach.shape[1]
    straight = np.hypot(room % width - anchor.x, room // width - anchor.y)
    return room[np.lexsort((straight, way))]


def _first_free(room: npt.NDArray[np.int64], width: int, taken: list[tuple[Cell, float]], radius: float) -> Cell | None:
    """Return the first cell of `room` (row-major indices) that keeps clear of the robots already there."""
    x, y = room % width, room // width
    free = np.ones(len(room), dtype=np.bool_)
    for cell, other in taken:
        free &= np.hypot(x - cell.x, y - cell.y) >= max(radius + other, 1.0)
    chosen = np.flatnonzero(free)
    if not len(chosen):
        return None
    return Cell(int(x[chosen[0]]), int(y[chosen[0]]))

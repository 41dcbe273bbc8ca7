"""Places the robots of a scenario at their starts.

Starts that the scenario does not fix are drawn by the seed: the first carrier anywhere in the carriers' largest
connected reach, the others as near to that carrier as space allows ("the robots actually start from the same place",
Wurm et al. 2010, section III).
"""

from collections.abc import Iterable, Iterator

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.errors import Problem, ScenarioError
from marsupial.maps.reach import largest_reach
from marsupial.model import Cell, Mask, PlacedRobot, Scenario
from marsupial.model.zones import at_start, zoned
from marsupial.paths.fields import PathSearch

NEAR = 65536  # number of nearest cells sorted first: a team finds room there, and sorting all of a large map takes long
AT_ONCE = 4096  # number of cells tested for room in one batch


def place_team(scenario: Scenario, seed: int) -> tuple[PlacedRobot, ...]:
    """Return every robot of the team at its start; raise ScenarioError if there is no room for one."""
    rng = np.random.default_rng(seed if scenario.start_seed is None else scenario.start_seed)
    grid = zoned(scenario.grid.solid(), at_start(scenario.zones))
    rooms: dict[str, _FreeRoom] = {}
    taken: list[tuple[Cell, float]] = []
    # robots without a start are placed near the first fixed one, or near the first that is drawn
    anchor = next((m.start for m in scenario.team if m.start is not None), None)
    placed: list[PlacedRobot] = []
    for i, member in enumerate(scenario.team):
        cell, kind = member.start, scenario.type_of(member)
        if cell is None and member.carrier is None:
            if kind.name not in rooms:
                rooms[kind.name] = _FreeRoom(largest_reach(grid, kind))
            room = rooms[kind.name]
            order = [rng.permutation(room.cells)] if anchor is None else room.nearest_first(anchor)
            cell = _first_free(order, grid.width, taken, kind.radius_m / grid.resolution_m)
            if cell is None:
                raise ScenarioError([Problem(f"team[{i}].start", f"no room on the map for {member.name} to start")])
        if cell is not None:
            anchor = anchor or cell
            taken.append((cell, kind.radius_m / grid.resolution_m))
        placed.append(PlacedRobot(name=member.name, type=member.type, cell=cell, carrier=member.carrier))
    return tuple(placed)


class _FreeRoom:
    """The cells where robots of one type may start."""

    def __init__(self, reach: Mask) -> None:
        self._reach = reach
        self.cells = np.flatnonzero(reach)  # row-major indices, in ascending order
        self._length: Floats | None = None
        self._near: Flags = np.zeros(0, dtype=np.bool_)
        self._nearest: Ints = self.cells

    def nearest_first(self, anchor: Cell) -> Iterator[Ints]:
        """Yield the cells in two batches, by path length from `anchor` (always the same), then by straight distance."""
        if self._length is None:
            self._length = PathSearch(self._reach).field(anchor).ravel()[self.cells]
            far = np.partition(self._length, NEAR)[NEAR] if len(self.cells) > NEAR else np.inf
            self._near = self._length <= far
            self._nearest = self._sorted(self._near, anchor)
        yield self._nearest
        yield self._sorted(~self._near, anchor)

    def _sorted(self, among: Flags, anchor: Cell) -> Ints:
        assert self._length is not None
        cells, width = self.cells[among], self._reach.shape[1]
        straight = np.hypot(cells % width - anchor.x, cells // width - anchor.y)
        return cells[np.lexsort((straight, self._length[among]))]


def _first_free(order: Iterable[Ints], width: int, taken: list[tuple[Cell, float]], radius: float) -> Cell | None:
    """Return the first cell, of row-major indices in batches, that keeps clear of the robots already placed."""
    for cells in order:
        for begin in range(0, len(cells), AT_ONCE):
            part = cells[begin : begin + AT_ONCE]
            x, y = part % width, part // width
            free = np.ones(len(part), dtype=np.bool_)
            # two points (radius 0) still need cells of their own
            for cell, other in taken:
                free &= np.hypot(x - cell.x, y - cell.y) >= max(radius + other, 1.0)
            chosen = np.flatnonzero(free)
            if len(chosen):
                return Cell(int(x[chosen[0]]), int(y[chosen[0]]))
    return None

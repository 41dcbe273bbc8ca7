"""Exploration targets: clusters of frontier cells that some robot type can go to.

A *frontier cell* is known, drivable and next to an unknown cell. A *viewpoint* of a type is a cell of its reach next to
one where it could stand if the unknown under its footprint turned out to be drivable: standing there reveals that
unknown. For a point robot these are the reachable cells next to unknown ones; for a robot with a footprint they leave
out unknown cells that its sensor could see but its body can't get closer to.

    # # # # # # # #
    . . . . f ? ? ?       f: frontier cells, at the unknown (?)
    . . . v f ? ? ?       v: viewpoint of a robot that covers 3 x 3 cells: one cell further its footprint
    . . . . f ? ? ?          would cover unknown cells
    # # # # # # # #

With `Goal.least_ground`, one robot type at least has to get on from its viewpoint: if all that is unknown is free, to
new cells to stand on, at least that many times as many as its own footprint has. Otherwise what is unknown there is a
gap in a wall that was seen at a slant, or a corner behind furniture: in buildings mapped with small cells, much of an
exploration goes to these, for a thousandth of the ground. Nothing is left out where a robot is no larger than
a cell (`least_cells`); nor is anything at the edge of the map, which may go on there.

Frontier cells near viewpoints of the same types, and visible from one of them within sensor range, form one target.

References
----------
Wurm et al. 2010, sections III-B and IV-C; the clustering follows the visibility rule of Burgard et al. 2005, which
they cite.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Flags, Floats, Ints, Ints32
from marsupial.maps.discs import disc, least_cells
from marsupial.maps.footprint import Footprint
from marsupial.maps.reach import groups, middle
from marsupial.maps.sight import hopeful_codes
from marsupial.maps.territory import Reach, Territory
from marsupial.maps.views import Views
from marsupial.model import FrameShift, Goal, MapTarget, Remaining
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Mask, code_table
from marsupial.native import inlined, native
from marsupial.paths.nearest import Nearest

LITTLE_GROUND = "there is too little that could be ground behind it"

_BESIDE: Ints = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)], dtype=np.int64)  # offsets (4, 2) of a cell's neighbours


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A target with the viewpoint of each type that can explore it; `cells` are its frontier cells, row-major."""

    name: str
    cell: Cell
    viewpoints: Mapping[str, Cell]
    cells: Ints
    reveal_m2: float
    priority: float = 1.0  # how much more it is worth than others

    def moved(self, shift: FrameShift) -> Target:
        """Return the target re-indexed for a larger frame."""
        return replace(
            self,
            cell=shift.cell(self.cell),
            viewpoints=shift.cells(self.viewpoints),
            cells=shift.indices(self.cells),
        )

    def on_map(self) -> MapTarget:
        """Return the target as the mission log records it."""
        return MapTarget(
            name=self.name,
            cell=self.cell,
            explorers=tuple(sorted(self.viewpoints)),
            reveal_m2=self.reveal_m2,
            frontier_cells=len(self.cells),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frontier:
    """What a robot type can explore: cells (n,), ascending row-major indices, and the viewpoint (n,) of each.

    The cells are the frontier cells near a viewpoint or, if there are none, the viewpoints themselves: then robots look
    for ground to set rovers down on (`marsupial.maps.landings`).
    """

    cells: Ints
    viewpoints: Ints

    def approach(self, cell: int, width: int) -> Cell:
        """Return the viewpoint of a cell of this frontier."""
        return cell_at(int(self.viewpoints[np.searchsorted(self.cells, cell)]), width)


class TargetFinder:
    """Finds the targets on one growing map; the owner of the territory updates it."""

    def __init__(self, territory: Territory, least_ground: float = Goal().least_ground) -> None:
        self._territory = territory
        grid = territory.grid
        self._least = least_cells(territory.kinds.values(), grid.resolution_m, least_ground)
        self._small: dict[str, Ints] = {}  # viewpoints with too little ground behind them
        # views pass through unknown cells: they count the cells that a robot may reveal
        self._views = Views(grid.cells, hopeful_codes(grid), UNKNOWN)
        self._drivable = code_table({code for kind in territory.kinds.values() for code in kind.terrains})
        self._frontier = np.flatnonzero(grid.cells != UNKNOWN)
        self._revealed = territory.revealed.reader()
        self._viewpoints: dict[str, Ints] = {}
        self._body_cells = {kind.name: kind.radius_m / grid.resolution_m for kind in territory.kinds.values()}
        self._near_cells = {name: 1.1 * cells + 2.5 for name, cells in self._body_cells.items()}
        self._nearest = Nearest(territory.see_through, max(self._near_cells.values()))

    def frontier(self) -> Ints:
        """Return the frontier cells, ascending."""
        news = self._revealed.parts()
        self._views.forget()
        for indices in news:
            self._views.revealed(indices)
        # a cell revealed before never becomes a frontier cell, so only the last and the new cells are tested
        left = np.concatenate([self._frontier, *news])
        self._frontier = np.sort(left[self.at_unknown(left)])
        return self._frontier

    def find(self, frontiers: Mapping[str, Frontier]) -> tuple[Target, ...]:
        """Return the targets for a team that can explore these frontiers, by explorers, then longest frontier first."""
        targets: list[Target] = []
        for explorers, cells in self._by_explorers(frontiers):
            kinds = self._territory.kinds
            range_cells = min(kinds[name].sensor_range_m for name in explorers) / self._territory.grid.resolution_m
            # only known walls separate cells, unknown ones between them do not; long frontiers choose their seeds first
            touching = sorted(groups(cells, self._territory.grid.cells.shape), key=lambda g: (-len(g), int(g[0])))
            for seed, members in self._views.clusters(touching, range_cells):
                targets.append(self._seen_by(explorers, frontiers, seed, members))
        return tuple(targets)

    def find_whole(self, frontiers: Mapping[str, Frontier], soonest_s: Mapping[str, Floats]) -> tuple[Target, ...]:
        """Return a target per reachable group of touching cells, at the cell that is reached `soonest_s` (by type)."""
        targets: list[Target] = []
        for explorers, cells in self._by_explorers(frontiers):
            reached = np.full(len(cells), np.inf)
            for name in explorers:
                at = np.searchsorted(frontiers[name].cells, cells)
                reached = np.minimum(reached, soonest_s[name][at])
            for members in groups(cells, self._territory.grid.cells.shape):
                of_members = reached[np.searchsorted(cells, members)]
                if np.isfinite(of_members).any():
                    seed = int(members[np.argmin(of_members)])
                    targets.append(self._seen_by(explorers, frontiers, seed, members))
        return tuple(targets)

    def frontiers(self, reach: Reach) -> Mapping[str, Frontier]:
        """Return what each type can explore, by name, given the next reach after that of the last call."""
        cells, zoning = self.frontier(), self._territory.grid.zoning
        inside = None if zoning is None else zoning.inside
        # before robots can get into the area to explore, they look for a way there
        limited = inside is not None and any((mask & inside).any() for mask in reach.by_type.values())
        cells = cells[self._leads_inside(cells, _BESIDE)] if limited else cells
        kinds = sorted(self._territory.kinds)
        viewpoints = {name: self._viewpoints_of(name, reach) for name in kinds}
        leading = {name: self._leading_on(name, viewpoints[name], reach.by_type[name]) for name in kinds}
        nearest = {name: self._nearest.once(viewpoints[name], cells, self._near_cells[name]) for name in kinds}
        # whoever sees a cell may explore it, if some robot gets on from there
        wanted = np.zeros(len(cells), dtype=np.bool_)
        for name in kinds:
            all_lead = len(leading[name]) == len(viewpoints[name])
            on = nearest[name] if all_lead else self._nearest.once(leading[name], cells, self._near_cells[name])
            wanted |= on >= 0
        return {
            name: self._frontier_of(name, cells[wanted], nearest[name][wanted], leading[name], limited=limited)
            for name in kinds
        }

    def at_unknown(self, cells: Ints) -> Flags:
        """Return which cells (n,), row-major, are frontier cells."""
        return _at_unknown(self._territory.grid.cells, self._drivable, cells)

    def _leads_inside(self, cells: Ints, offsets: Ints) -> Flags:
        """Return which cells (n,) have an unknown cell in the area to explore at one of some offsets (m, 2)."""
        grid = self._territory.grid
        assert grid.zoning is not None
        assert grid.zoning.inside is not None
        y, x = np.divmod(cells[:, None], grid.width)
        u, v = np.clip(x + offsets[:, 0], 0, grid.width - 1), np.clip(y + offsets[:, 1], 0, grid.height - 1)
        return np.asarray(((grid.cells[v, u] == UNKNOWN) & grid.zoning.inside[v, u]).any(axis=1))

    def refused(self, targets: Sequence[Target], reach: Reach) -> tuple[Remaining, ...]:
        """Return the groups of frontier cells that belong to none of these targets, each with the reason."""
        covered = np.concatenate([np.empty(0, dtype=np.int64), *(target.cells for target in targets)])
        left = np.setdiff1d(self.frontier(), covered)
        return tuple(self._refusal(group, reach) for group in groups(left, self._territory.grid.cells.shape))

    def _viewpoints_of(self, name: str, reach: Reach) -> Ints:
        """Return the viewpoints (n,) of a type, given the next reach."""
        footprint = self._territory.footprints[name]
        # a cell that was no viewpoint when first reached never becomes a viewpoint
        left = self._viewpoints.get(name)
        left = np.flatnonzero(reach.by_type[name]) if left is None else np.concatenate([left, reach.fresh[name]])
        found = left[_are_viewpoints(left, reach.by_type[name], footprint.standable, footprint.possible)]
        self._viewpoints[name] = np.unique(found)
        return self._viewpoints[name]

    def _frontier_of(self, name: str, cells: Ints, nearest: Ints, viewpoints: Ints, *, limited: bool) -> Frontier:
        """Return what a type can explore of cells (n,) with their `nearest` viewpoints (n,), -1 for none.

        Without any such cell, these are its `viewpoints` (m,) that lead on; `limited` to the area to explore.
        """
        near = nearest >= 0
        if near.any():
            return Frontier(cells=cells[near], viewpoints=nearest[near])
        if limited:  # a viewpoint's own body is beside the unknown
            viewpoints = viewpoints[self._leads_inside(viewpoints, disc(self._body_cells[name] + 1.0 + 1e-6))]
        return Frontier(cells=viewpoints, viewpoints=viewpoints)

    def _leading_on(self, name: str, viewpoints: Ints, reached: Mask) -> Ints:
        """Return the viewpoints (n,) of a type behind which may be enough new ground; note the others."""
        least = self._least[name]
        if least <= 1:  # as beside every viewpoint
            return viewpoints
        footprint, marks = self._territory.footprints[name], np.zeros(reached.size, dtype=np.int32)
        possible, edge = footprint.possible.ravel(), int(footprint.offsets.max())
        leads = _lead_on(viewpoints, possible, reached.ravel(), marks, reached.shape, edge, least)
        self._small[name] = viewpoints[~leads]
        return viewpoints[leads]

    def _by_explorers(self, frontiers: Mapping[str, Frontier]) -> Iterator[tuple[list[str], Ints]]:
        """Yield each set of types with the cells, ascending, that exactly these types can explore."""
        kinds = sorted(self._territory.kinds)
        cells = np.unique(np.concatenate([frontier.cells for frontier in frontiers.values()]))
        access = np.zeros(len(cells), dtype=np.int64)
        for bit, name in enumerate(kinds):
            access[np.searchsorted(cells, frontiers[name].cells)] |= 1 << bit
        for code in np.unique(access).tolist():
            yield [name for bit, name in enumerate(kinds) if code >> bit & 1], cells[access == code]

    def _seen_by(self, types: Sequence[str], frontiers: Mapping[str, Frontier], seed: int, members: Ints) -> Target:
        """Return the target of these frontier cells, with each type's viewpoint of `seed`."""
        width = self._territory.grid.width
        return self.target(seed, members, {name: frontiers[name].approach(seed, width) for name in types})

    def target(self, seed: int, members: Ints, viewpoints: Mapping[str, Cell]) -> Target:
        """Return the target of these frontier cells, named after `seed`."""
        grid = self._territory.grid
        cell = cell_at(seed, grid.width)
        best = max(viewpoints, key=lambda name: (self._territory.kinds[name].sensor_range_m, name))
        range_cells = self._territory.kinds[best].sensor_range_m / grid.resolution_m
        hidden = self._views.hidden(viewpoints[best], range_cells)
        weights = None if grid.zoning is None else grid.zoning.weights
        return Target(
            name=grid.name_of("t", cell),
            cell=cell,
            viewpoints=viewpoints,
            cells=members,
            reveal_m2=round(hidden * grid.cell_area_m2, 6),
            priority=1.0 if weights is None else float(weights.ravel()[members].max()),
        )

    def _refusal(self, group: Ints, reach: Reach) -> Remaining:
        grid, width = self._territory.grid, self._territory.grid.width
        prints, zoning = self._territory.footprints, grid.zoning
        if zoning is not None and zoning.inside is not None and not self._leads_inside(group, _BESIDE).any():
            reason = "outside the area to explore"
        elif any(
            (self._nearest.once(self._small[name], group, self._near_cells[name]) >= 0).any() for name in self._small
        ):
            reason = LITTLE_GROUND
        elif any(_stands_beside(group, prints[name].offsets, mask) for name, mask in reach.by_type.items()):
            reason = "robots can stand beside it, but none gets any farther"
        elif any(_stands_beside(group, footprint.offsets, footprint.standable) for footprint in prints.values()):
            reason = "no robot that fits there can get there: not connected to the reach of the team"
        elif _may_turn_out(group, prints.values(), grid.cells.shape):
            reason = "not reached: no robot can stand close enough to reveal more"
        else:
            reason = "too narrow for every robot type of the team"
        seed = int(middle(group, width))
        return Remaining(cell=cell_at(seed, width), frontier_cells=len(group), reason=reason)


def cell_at(index: int, width: int) -> Cell:
    """Return the cell of a row-major index."""
    return Cell(index % width, index // width)


def _may_turn_out(group: Ints, prints: Iterable[Footprint], shape: tuple[int, int]) -> bool:
    """Return whether some robot may prove to fit on one of the cells or beside it."""
    near = np.arange(-1, 2)
    y = np.clip((group // shape[1])[:, None] + np.repeat(near, 3), 0, shape[0] - 1)
    x = np.clip((group % shape[1])[:, None] + np.tile(near, 3), 0, shape[1] - 1)
    return any((footprint.possible[y, x] & ~footprint.standable[y, x]).any() for footprint in prints)


@native
def _stands_beside(cells: Ints, offsets: Ints, where: Mask) -> bool:
    """Return whether a robot with footprint `offsets` (n, 2), standing somewhere, covers one of the cells or is beside
    it.
    """
    height, width = where.shape
    for index in cells:
        y, x = index // width, index % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if where[v, u]:
                    return True
        for i in range(len(offsets)):
            u, v = x + offsets[i, 0], y + offsets[i, 1]
            if 0 <= u < width and 0 <= v < height and where[v, u]:
                return True
    return False


@native
def _at_unknown(cells: CellArray, drivable: Flags, indices: Ints) -> Flags:
    """Return which cells of the map (height, width) have a drivable code (256,) and an unknown neighbour."""
    height, width = cells.shape
    out = np.zeros(indices.size, dtype=np.bool_)
    for i, index in enumerate(indices):
        y, x = index // width, index % width
        if drivable[cells[y, x]]:
            out[i] = (
                (x > 0 and cells[y, x - 1] == UNKNOWN)
                or (x + 1 < width and cells[y, x + 1] == UNKNOWN)
                or (y > 0 and cells[y - 1, x] == UNKNOWN)
                or (y + 1 < height and cells[y + 1, x] == UNKNOWN)
            )
    return out


@native
def _lead_on(
    viewpoints: Ints, possible: Flags, reached: Flags, marks: Ints32, shape: tuple[int, int], reach: int, least: int
) -> Flags:
    """Return behind which viewpoints the robot may turn out to get to `least` new cells, or to the edge of the map.

    These are connected cells where it may stand, but which it has not reached. The flags of all cells (cells,) are
    row-major; `marks` are 0 before, and then the number of the search that has come to a cell. A robot as near to the
    edge as `reach`, that of its footprint in cells, may find that the map goes on there.
    """
    height, width = shape
    out = np.zeros(viewpoints.size, dtype=np.bool_)
    leads = np.zeros(4 * viewpoints.size + 1, dtype=np.bool_)  # by search
    queue = np.empty(least, dtype=np.int64)
    search = 0
    for k, viewpoint in enumerate(viewpoints):
        for start in _neighbours(viewpoint, height, width):
            if start < 0 or not possible[start] or reached[start]:
                continue
            if not marks[start]:
                search += 1
                marks[start], queue[0] = search, start
                head, tail = 0, 1
                while head < tail < least and not leads[search]:
                    y, x = queue[head] // width, queue[head] % width
                    leads[search] = min(x, y, width - 1 - x, height - 1 - y) <= reach
                    for cell in _neighbours(queue[head], height, width):
                        if cell < 0 or not possible[cell] or reached[cell]:
                            continue
                        if not marks[cell] and tail < least:
                            marks[cell], queue[tail] = search, cell
                            tail += 1
                        elif leads[marks[cell]]:
                            leads[search] = True
                    head += 1
                leads[search] = leads[search] or tail >= least
            out[k] = out[k] or leads[marks[start]]
    return out


@inlined
def _neighbours(cell: int, height: int, width: int) -> tuple[int, int, int, int]:
    """Return the four neighbours of a cell, row-major; -1 for those off the map."""
    x = cell % width
    return (
        cell - 1 if x > 0 else -1,
        cell + 1 if x + 1 < width else -1,
        cell - width if cell >= width else -1,
        cell + width if cell + width < height * width else -1,
    )


@native
def _are_viewpoints(cells: Ints, reach: Mask, standable: Mask, possible: Mask) -> Flags:
    """Return which cells are reachable and beside one where the robot may turn out to fit; masks (height, width)."""
    height, width = reach.shape
    out = np.zeros(cells.size, dtype=np.bool_)
    for k, index in enumerate(cells):
        y, x = index // width, index % width
        out[k] = reach[y, x] and (
            (x > 0 and possible[y, x - 1] and not standable[y, x - 1])
            or (x + 1 < width and possible[y, x + 1] and not standable[y, x + 1])
            or (y > 0 and possible[y - 1, x] and not standable[y - 1, x])
            or (y + 1 < height and possible[y + 1, x] and not standable[y + 1, x])
        )
    return out

"""Gives up what no look reveals: glass, a black wall, a frontier that no robot gets near.

A *look* is an explore that has ended, of a robot on the ground. It covers unknown cells of its target: those beside the
frontier cells of the target, and those under the robot's body if it drove on.

- If the explore was carried out, the look covers those of them that the robot sees from where it stands (in sensor
  range and in line of sight over known ground). At the viewpoint it also covers the cells that this was chosen for:
  those beside the target's own cell, and under the body.
- If there are none, the robot has stopped short; if its drive failed, it was kept away. Then the look covers all.

A look is *in vain* as long as none of the cells that it covers is known. If it has revealed a part of its target, it
covers only what the viewpoint was chosen for, since sensors may not reach as far as they should. Looks count only on
maps of other software (`MissionOrder.waits`): one of a simulated robot shows all that it ever will.

Such maps may be late, so cells that a robot has stood beside rest for `APART_MS`: they are no target, the robot does
other things, and a mission without other targets waits. A robot that still stands there then has looked again. After
`MOST_LOOKS` looks so far apart a cell is given up. Only looks from about as near as any count, because a robot that
comes nearer may see more, and failed drives only if several robots failed: else the robot may be the cause.

Cells that rest or are given up count as obstacles (`flicker`). For robots they were that before, as
they can't stand on unknown cells, so no route changes. A given-up cell is taken up again when its looks prove not to be
in vain, as the late map has arrived, or when known cells near it change: at most `MOST_CHANGES` times, as maps of other
software never stop changing.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.discs import disc
from marsupial.maps.sight import Sight
from marsupial.maps.targets import Target
from marsupial.model import (
    UNKNOWN,
    Action,
    ActionName,
    Cell,
    CellArray,
    FrameShift,
    Grid,
    RobotReport,
    RobotType,
    World,
)
from marsupial.model.grid import code_table
from marsupial.model.world import News

MOST_LOOKS = 3  # how many looks in vain a cell gets before it is given up

APART_MS = 15_000  # least time between two of them: SLAM publishes maps every 5 to 10 s, and they may be late

AS_NEAR_CELLS = 2.0  # looks from this much farther than the nearest count too: robots stop a cell or two apart

MOST_CHANGES = 3  # how often a cell is taken up again because known cells near it have changed

NEAR_CELLS = 2  # how near they are

UNREVEALED = "three looks revealed nothing: glass, or a wall that sensors do not see?"
UNREACHED = "three drives towards it ended farther away: no robot gets any nearer"
RESTS = "a look revealed nothing, and there was no time for another"

_NONE: Ints = np.empty(0, dtype=np.int64)
_STEPS: Ints = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)], dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VainLook:
    """A look that has revealed nothing so far."""

    robot: str
    cell: Cell  # where it stood
    t_ms: int
    cells: Ints  # (n,): the unknown cells that it covers, row-major indices
    far_cells: float  # how far from its target it was made
    reached: bool  # whether the robot came near enough to see some of them
    beside: bool  # whether it stood right beside the target
    failed: bool  # whether its drive failed


class VainLooks:
    """The looks in vain on one map, and the cells that are given up; `world` has the map of which plans are made.

    `way` returns the route of a robot type between two cells, or None.
    """

    def __init__(
        self,
        world: World,
        kinds: Mapping[str, RobotType],
        way: Callable[[str, Cell, Cell], Sequence[Cell] | None],
    ) -> None:
        self._world, self._kinds, self._way = world, kinds, way
        self._looks: list[VainLook] = []
        self._sent: dict[str, tuple[Target, ...]] = {}  # the targets of rovers out of contact
        self._partly_ms = -APART_MS  # when the last look ended that revealed only a part of its target
        self._changes = Counter[int]()  # how often each cell was taken up again because of changes near it
        self.left_out: Mapping[str, Ints] = {}  # cells that rest or are given up, row-major indices by the reason

    @property
    def any(self) -> bool:
        """Whether there are looks in vain, or were at the last update."""
        return bool(self._looks or self.left_out)

    @property
    def wake_ms(self) -> int | None:
        """When the next cells have rested, or None if none rest."""
        now_ms = self._world.now_ms
        ends = [look.t_ms + APART_MS for look in self._looks if look.beside]
        return min((end for end in ends if end > now_ms), default=None) if RESTS in self.left_out else None

    @property
    def rest_comes_ms(self) -> int | None:
        """Until when the rest of a target may still appear on a late map, or None."""
        until_ms = self._partly_ms + APART_MS
        return until_ms if self._world.now_ms < until_ms else None

    def move(self, shift: FrameShift) -> None:
        """Re-index all cells after the frame grew."""
        self._looks = [
            replace(look, cell=shift.cell(look.cell), cells=shift.indices(look.cells)) for look in self._looks
        ]
        self._sent = {name: tuple(target.moved(shift) for target in sent) for name, sent in self._sent.items()}
        self._changes = Counter({shift.index(cell): times for cell, times in self._changes.items()})
        self.left_out = {reason: shift.indices(cells) for reason, cells in self.left_out.items()}

    def add_looks(self, targets: Iterable[Target], failed: Iterable[Action], done: Iterable[Action]) -> None:
        """Add the looks at targets whose explores have failed, or are done."""
        for actions, has_failed in ((failed, True), (done, False)):
            explores = [action for action in actions if action.name is ActionName.EXPLORE]
            robots = {robot.name: robot for robot in self._world.robots()} if explores else {}
            for action in explores:
                robot = robots[action.robot]
                for target in targets:
                    if target.name == action.place:
                        self.add(target, robot, failed=has_failed)
                # a rover that was out of contact has come back from its targets, which later plans have left to it
                for target in self._sent.get(robot.name, ()):
                    if target.name == action.place:
                        self.add(target, robot, at=target.viewpoints[robot.type], failed=has_failed)

    def send(self, rover: str, targets: Iterable[Target]) -> None:
        """Note the targets to which a rover that is out of contact now was sent."""
        self._sent[rover] = tuple(targets)

    def add_stops(self, news: News) -> None:
        """Add the looks of rovers that were out of contact, at the targets to which they were sent."""
        stops = dict(news.stops)
        for robot in self._world.robots() if stops else ():
            for target in self._sent.get(robot.name, ()):
                if (viewpoint := target.viewpoints[robot.type]) in stops.get(robot.name, ()):
                    self.add(target, robot, at=viewpoint)

    def add(self, target: Target, robot: RobotReport, *, at: Cell | None = None, failed: bool = False) -> None:
        """Add the look of a robot that has explored a target, and stands there, or stood `at` another cell."""
        cell, viewpoint = at or robot.cell, target.viewpoints.get(robot.type)
        if cell is None or robot.lost or viewpoint is None or not len(target.cells):
            return
        grid, kind = self._world.grid, self._kinds[robot.type]
        own = np.array([target.cell.y * grid.width + target.cell.x])
        here = np.union1d(_unknown_beside(grid, own), _unknown_ahead(grid, kind, viewpoint))
        wanted = np.union1d(_unknown_beside(grid, target.cells), here)
        recent = (look.cells for look in self._looks if self._world.now_ms < look.t_ms + APART_MS)
        wanted = np.setdiff1d(wanted, np.concatenate([_NONE, *recent]))
        if not failed and len(wanted) and _is_partly_seen(grid, target.cells):
            wanted, self._partly_ms = here, self._world.now_ms
        if not len(wanted):
            return
        near = here if math.dist(cell, viewpoint) <= AS_NEAR_CELLS else _NONE
        seen = _NONE if failed else wanted[np.isin(wanted, np.union1d(near, _visible(grid, kind, cell)))]
        if not len(seen) and cell == viewpoint and not failed:
            return  # the rest of its target is out of sight here
        far_cells = float(_distances(cell, target.cells, grid.width).min())
        if not len(seen):
            way = self._way(robot.type, cell, viewpoint)
            far_cells = far_cells + len(way) if way is not None else float(grid.cells.size)
        look = VainLook(
            robot=robot.name,
            cell=cell,
            t_ms=self._world.now_ms,
            cells=seen if len(seen) else wanted,
            far_cells=far_cells,
            reached=bool(len(seen)),
            beside=bool(len(seen)) and far_cells <= _beside_cells(grid, kind),
            failed=failed,
        )
        self._looks.append(look)

    def update(self, cells: CellArray, changed: Iterable[Ints]) -> bool:
        """Find the cells that rest or are given up now; return whether others did before.

        `cells` is the map as reported, and `changed` (row-major) are known cells of it that have changed.
        """
        codes = cells.ravel()
        self._looks = [look for look in self._looks if (codes[look.cells] == UNKNOWN).all()]
        for indices in changed:
            self._take_up(indices, cells.shape[1])
        self._look_again()
        found: dict[str, list[int]] = {}
        for cell in np.unique(np.concatenate([_NONE, *(look.cells for look in self._looks)])).tolist():
            if reason := self._reason(cell):
                found.setdefault(reason, []).append(cell)
        before = self.left_out
        self.left_out = {reason: np.array(some, dtype=np.int64) for reason, some in sorted(found.items())}
        return before.keys() != self.left_out.keys() or any(
            not np.array_equal(before[reason], some) for reason, some in self.left_out.items()
        )

    def _look_again(self) -> None:
        """Add the looks of robots that still stand beside cells that have rested."""
        if RESTS not in self.left_out:
            return
        now_ms, stands = self._world.now_ms, {r.name: r.cell for r in self._world.robots() if not r.lost}
        for look in [look for look in self._looks if look.beside and now_ms >= look.t_ms + APART_MS]:
            later = (other.cells for other in self._looks if other.t_ms > look.t_ms)
            cells = np.setdiff1d(look.cells, np.concatenate([_NONE, *later]))
            if len(cells) and stands.get(look.robot) == look.cell:
                self._looks.append(replace(look, t_ms=now_ms, cells=cells))

    def _take_up(self, changed: Ints, width: int) -> None:
        """Drop looks at cells near which known ones have changed."""
        covered = np.unique(np.concatenate([_NONE, *(look.cells for look in self._looks)]))
        y, x = np.divmod(covered[:, None], width)
        v, u = np.divmod(changed, width)
        near = ((abs(x - u) <= NEAR_CELLS) & (abs(y - v) <= NEAR_CELLS)).any(axis=1)
        again = [cell for cell in covered[near].tolist() if self._changes[cell] < MOST_CHANGES]
        self._changes.update(again)
        if again:
            looks = (replace(look, cells=np.setdiff1d(look.cells, again)) for look in self._looks)
            self._looks = [look for look in looks if len(look.cells)]

    def _reason(self, cell: int) -> str | None:
        """Return why a cell is left out, or None if it isn't."""
        looks = [look for look in self._looks if cell in look.cells]
        rests = any(look.beside and self._world.now_ms < look.t_ms + APART_MS for look in looks)
        nearest = min(look.far_cells for look in looks)
        looks = [look for look in looks if look.far_cells <= nearest + AS_NEAR_CELLS]
        if len({look.robot for look in looks if look.failed}) < 2:
            looks = [look for look in looks if not look.failed]
        if len(looks) < MOST_LOOKS:
            return RESTS if rests else None
        return UNREVEALED if any(look.reached for look in looks) else UNREACHED


def _unknown_beside(grid: Grid, cells: Ints) -> Ints:
    """Return the unknown cells above, below or beside some cells (row-major)."""
    return _unknown(grid, (cells[:, None] % grid.width + _STEPS[:, 0], cells[:, None] // grid.width + _STEPS[:, 1]))


def _is_partly_seen(grid: Grid, cells: Ints) -> bool:
    """Return whether some of a target's frontier cells (row-major) are frontier cells no more, but others are."""
    left = sum(bool(len(_unknown_beside(grid, cells[i : i + 1]))) for i in range(len(cells)))
    return 0 < left < len(cells)


def _unknown_ahead(grid: Grid, kind: RobotType, viewpoint: Cell) -> Ints:
    """Return the unknown cells under a robot's body one step beyond a viewpoint, where nothing else bars it."""
    offsets, drivable, found = disc(kind.radius_m / grid.resolution_m), code_table(kind.terrains), [_NONE]
    drivable[UNKNOWN] = True
    for step in _STEPS:
        x, y = (np.array(viewpoint) + step + offsets).T
        inside = bool(((x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)).all())
        if inside and drivable[grid.cells[y, x]].all():
            found.append(_unknown(grid, (x, y)))
    return np.unique(np.concatenate(found))


def _unknown(grid: Grid, at: tuple[Ints, Ints]) -> Ints:
    """Return the unknown cells (row-major, ascending) among those in columns and rows, which may be off the map."""
    x, y = at
    inside = (x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)
    indices = (y * grid.width + x)[inside]
    return np.unique(indices[grid.cells.ravel()[indices] == UNKNOWN])


def _visible(grid: Grid, kind: RobotType, cell: Cell) -> Ints:
    """Return the cells (row-major) that a robot sees from a cell over known ground."""
    return Sight(grid.cells, grid.opaque_codes()).visible(cell, kind.sensor_range_m / grid.resolution_m)


def _beside_cells(grid: Grid, kind: RobotType) -> float:
    """Return how far from a target its viewpoints may be, in cells."""
    return 1.1 * kind.radius_m / grid.resolution_m + 3.5


def _distances(cell: Cell, cells: Ints, width: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the straight distances (n,) of cells (row-major) from a cell, in cells."""
    return np.hypot(cells % width - cell.x, cells // width - cell.y)

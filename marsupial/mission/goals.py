"""The order of a mission, and how much of its area is explored."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from marsupial.model import (
    UNKNOWN,
    Cell,
    DatedZone,
    FrameShift,
    Goal,
    Interference,
    Mask,
    News,
    RobotReport,
    RobotType,
    Role,
    World,
)
from marsupial.model.mission import KNOWN_PERCENT
from marsupial.model.scenario import MissionLimits, PlanningTime
from marsupial.model.zones import counting

_NEVER = np.iinfo(np.int32).max


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionOrder:
    """The goal and limits of a mission, and how it is measured."""

    goal: Goal
    limits: MissionLimits
    planning_time: PlanningTime = PlanningTime.INSTANT
    # cells (height, width) that count as the area to explore; None if the true map is not known
    reachable: Mask | None = None
    homes: Mapping[str, Cell] | None = None  # the cell that each carrier has to return to; None for its start
    # returns the interference between robots; None if they share cells
    interference: Callable[[], Interference] | None = None
    zones: Sequence[DatedZone] = ()  # further ones come as news
    # returns whether an operator has called the team back, to end the mission with rovers recovered as `goal` says
    called_back: Callable[[], bool] = lambda: False
    # whether the mission waits, instead of ending, while robots stand where the known map does not allow it: a map
    # built by other software may be late or wrong
    waits: bool = False
    plans_on_board: bool = True  # whether robots hold the plan, or else get one command at a time


class ExploredArea:
    """How much of the area to explore is explored, and since when.

    `world` has the zones that hold, `raw` the map as reported. A cell counts as known from the moment at which it was
    seen first. The mean of these moments over all reachable cells is the area above the curve of the known share:

    ::

        100 % |############_____     N % are known when the curve reaches that height
              |#####______/          # is the mean moment, times the number of cells
              |____/
            0 +-----------------> t
    """

    def __init__(self, raw: World, world: World, reachable: Mask | None) -> None:
        self._raw, self._world, self._reachable = raw, world, reachable
        known = raw.grid.cells != UNKNOWN
        self._since_ms = np.where(known, np.int32(raw.now_ms), _NEVER)  # when a cell was known first

    def move(self, shift: FrameShift) -> None:
        """Re-index cells after the frame grew."""
        self._since_ms = shift.laid_out(self._since_ms, fill=_NEVER)
        if self._reachable is not None:
            self._reachable = shift.laid_out(self._reachable, fill=False)

    def update(self, news: News) -> None:
        """Note what robots have seen."""
        for _, cells in news.revealed:
            self._since_ms.ravel()[cells] = np.minimum(self._since_ms.ravel()[cells], news.t_ms)

    def coverage(self) -> float:
        """Return the explored share of the reachable area; 0 if that area is not known."""
        known, reachable = (int(np.count_nonzero(cells)) for cells in self._cells())
        return 0.0 if self._reachable is None else known / max(1, reachable)

    def measures(self, end_ms: int) -> dict[str, Any]:
        """Return the measures of the explored area at the end, as fields of `MissionEnded`."""
        known, reachable = self._cells()
        area, count = self._raw.grid.cell_area_m2, int(np.count_nonzero(reachable))
        # when no cell was known, one, two, ...
        moments: list[int] = [0, *np.sort(np.minimum(self._since_ms[known], end_ms)).tolist()]
        explored = len(moments) - 1
        needed = {percent: -(-count * percent // 100) for percent in KNOWN_PERCENT}
        return {
            "explored_area_m2": round(explored * area, 6),
            "reachable_area_m2": round(count * area, 6),
            "known_ms": tuple((percent, moments[n] if n <= explored else None) for percent, n in needed.items()),
            "mean_known_ms": round((sum(moments) + (count - explored) * end_ms) / max(count, 1)),
        }

    def _cells(self) -> tuple[Mask, Mask]:
        """Return the explored and the reachable cells; if the latter are not known, all known cells count."""
        known = self._raw.grid.cells != UNKNOWN
        reachable = counting(known if self._reachable is None else self._reachable, self._world.grid)
        return known & reachable, reachable


def homes_of(robots: Iterable[RobotReport], kinds: Mapping[str, RobotType]) -> dict[str, Cell]:
    """Return the cell of each carrier, by name."""
    return {r.name: r.cell for r in robots if r.cell is not None and kinds[r.type].role is Role.CARRIER}

"""What is measured of a mission and told at its end: the area explored, what robots have driven and used."""

from collections import Counter
from typing import Any

import numpy as np

from marsupial.mission.belief.belief import Belief
from marsupial.mission.belief.zones import BARRED
from marsupial.mission.ending import absent, needed_lost
from marsupial.mission.executor import Executor
from marsupial.mission.goals import MissionOrder
from marsupial.mission.replanning import Replanning
from marsupial.model import OBSTACLE, UNKNOWN, FrameShift, Mask, MissionEnded, News, Status, World
from marsupial.model.mission import KNOWN_PERCENT
from marsupial.model.world import energy_j
from marsupial.model.zones import counting

_NEVER = np.iinfo(np.int32).max


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
        """Return the explored and the reachable cells; if the latter are not known, all known ground counts."""
        cells = self._raw.grid.cells
        known = cells != UNKNOWN
        area = known & (cells != OBSTACLE) if self._reachable is None else self._reachable
        reachable = counting(area, self._world.grid)
        return known & reachable, reachable


class Measures:
    """What is measured of a mission; `reachable` as in `MissionOrder`."""

    def __init__(self, belief: Belief, reachable: Mask | None) -> None:
        self.area = ExploredArea(belief.world, belief, reachable)
        self._belief = belief
        self._lost_ms: dict[str, int] = {}  # when the robots that are lost were, also those out of contact
        self._off_ms = Counter[str]()  # how long robots were lost before
        self.refused = 0  # number of plans that the checker refused

    def update(self, news: News) -> None:
        """Note what robots have seen, and which are lost."""
        for name, _ in self._belief.reported.lost:
            self._lost_ms.setdefault(name, news.t_ms)
        for name in self._belief.reported.returned:
            self._off_ms[name] += news.t_ms - self._lost_ms.pop(name, news.t_ms)
        self.area.update(news)

    def ended(
        self, status: Status, reason: str, policy: Replanning, executor: Executor, order: MissionOrder
    ) -> MissionEnded:
        """Return the last event of a mission, which ends for this reason."""
        belief, now_ms = self._belief, self._belief.now_ms
        robots, under_way = belief.robots(), executor.under_way
        remaining = policy.remaining(status, f"still open when the mission ended: {reason}") + belief.remaining()
        if status is Status.COMPLETE and any(left.reason == BARRED for left in remaining):
            reason = f"{reason}; {belief.no_go}"
        if status is not Status.FAILED:
            reason = "; ".join([reason, *absent(robots, belief.grid)])
        off_ms = self._off_ms + Counter({name: now_ms - lost_ms for name, lost_ms in self._lost_ms.items()})
        return MissionEnded(
            t_ms=now_ms,
            status=status,
            reason=reason,
            exploration_ms=None if needed_lost(belief, order.goal) else policy.exploration_ms,
            **self.area.measures(now_ms),
            distance_m=tuple((r.name, round(belief.distance_m(r.name), 3)) for r in robots),
            energy_j=energy_j(belief, belief.kinds, off_ms),
            deployments=executor.deployments.deployed,
            retrievals=executor.deployments.retrieved,
            replans=executor.revision,
            plans_valid=executor.revision,
            plans_invalid=self.refused,
            aboard=tuple(r.name for r in robots if r.carrier is not None and r.name not in under_way),
            remaining=remaining,
            lost=tuple(robot.name for robot in robots if robot.lost),
            interference=None if order.interference is None else order.interference(),
        )

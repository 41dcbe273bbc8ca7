"""The order of a mission, and how much of its area is explored."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.model import (
    UNKNOWN,
    Cell,
    DatedZone,
    FrameShift,
    Goal,
    Interference,
    Mask,
    RobotReport,
    RobotType,
    Role,
    World,
)
from marsupial.model.scenario import MissionLimits, PlanningTime
from marsupial.model.zones import counting


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
    """How much of the area to explore is explored; `world` has the zones that hold, `raw` the map as reported."""

    def __init__(self, raw: World, world: World, reachable: Mask | None) -> None:
        self._raw, self._world, self._reachable = raw, world, reachable

    def move(self, shift: FrameShift) -> None:
        """Re-index cells after the frame grew."""
        if self._reachable is not None:
            self._reachable = shift.laid_out(self._reachable, fill=False)

    def cells(self) -> tuple[int, int]:
        """Return the numbers of explored and of reachable cells; if the latter are not known, all known cells count."""
        known = self._raw.grid.cells != UNKNOWN
        reachable = counting(known if self._reachable is None else self._reachable, self._world.grid)
        return int(np.count_nonzero(known & reachable)), int(np.count_nonzero(reachable))

    def coverage(self) -> float:
        """Return the explored share of the reachable area; 0 if that area is not known."""
        explored, reachable = self.cells()
        return 0.0 if self._reachable is None else explored / max(1, reachable)


def homes_of(robots: Iterable[RobotReport], kinds: Mapping[str, RobotType]) -> dict[str, Cell]:
    """Return the cell of each carrier, by name."""
    return {r.name: r.cell for r in robots if r.cell is not None and kinds[r.type].role is Role.CARRIER}

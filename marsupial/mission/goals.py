"""The order of a mission: its goal and limits."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from marsupial.model import (
    Cell,
    DatedZone,
    Goal,
    Interference,
    Mask,
    RobotReport,
    RobotType,
    Role,
)
from marsupial.model.scenario import MissionLimits, PlanningTime


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


def homes_of(robots: Iterable[RobotReport], kinds: Mapping[str, RobotType]) -> dict[str, Cell]:
    """Return the cell of each carrier, by name."""
    return {r.name: r.cell for r in robots if r.cell is not None and kinds[r.type].role is Role.CARRIER}

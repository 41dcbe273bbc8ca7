"""The routes of a robot type and their lengths: shortest, or of least energy.

Planning and driving use the same search, so planned lengths hold for the routes driven. Only the heading of a robot at
a place it has not reached yet is unknown to planning, which then takes its first step without a turn.
"""

from marsupial.model import Mask, RobotType, Routes
from marsupial.model.feed import Feed
from marsupial.paths.energy import EnergySearch, costs_of
from marsupial.paths.fields import PathSearch, SearchMemory

Ways = PathSearch | EnergySearch
"""Finds routes on one mask (height, width), which may change between calls."""


def ways_of(
    kind: RobotType, passable: Mask, resolution_m: float, opened: Feed | None = None, memory: SearchMemory | None = None
) -> Ways:
    """Return the search for a robot type's routes (UsageError: least energy, but driving uses no energy)."""
    if kind.routes is Routes.ENERGY:
        return EnergySearch(passable, costs_of(kind, resolution_m), diagonal=kind.diagonal)
    return PathSearch(passable, kind.diagonal, opened, memory)

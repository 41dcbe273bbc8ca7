"""Rovers out of contact by the log so far: who can hear whom, and where rovers have been meanwhile."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from benchmarks.storm.ground import Document, dock_cells
from benchmarks.storm.logs import Cell
from benchmarks.storm.robots import Robot

MISSING = "is not where it was expected"


@dataclass
class LastContact:
    """A rover out of contact."""

    plan: int  # the last one that it knows
    visits: int  # how many cells it had visited
    cell: Cell | None


@dataclass
class Contacts:
    """Which rovers are out of contact, by the log so far."""

    away: dict[str, LastContact] = field(default_factory=dict)
    once_away: set[str] = field(default_factory=set)  # those that were at some time
    missing: set[str] = field(default_factory=set)  # those reported lost for that
    _ways: dict[str, tuple[int, list[Cell]]] = field(default_factory=dict)  # when they were heard again, and their way

    def lose(self, name: str, robot: Robot, plan: int) -> None:
        self.away[name] = LastContact(plan, len(robot.visits), robot.cell)
        self.once_away.add(name)

    def regain(self, name: str, robot: Robot, t_ms: int) -> None:
        last = self.away.pop(name, None)
        if last is not None:
            visited = [*robot.visits[max(0, last.visits - 1) :], *(at for at in robot.passed if at[0] <= t_ms + 1)]
            self._ways[name] = t_ms, [*(cell for _, cell in visited), *([last.cell] if last.cell else [])]

    def way(self, name: str, t_ms: int) -> list[Cell]:
        """Return the way of a rover that was out of contact until now; empty for others."""
        heard_ms, way = self._ways.get(name, (-1, []))
        return way if heard_ms == t_ms else []


def in_range(robots: Mapping[str, Robot], kinds: Iterable[Document], t_ms: int, slack: float) -> set[str]:
    """Return the robots that are in contact by their positions, if ranges are this much longer, in cells."""
    carriers = [kind for kind in kinds if kind["role"] == "carrier"]
    there, relays, apart = set(robots), [], {}
    for name, robot in robots.items():
        cell = next((at for ms, at in reversed(robot.passed) if ms <= t_ms), robot.cell)
        if cell is None:
            continue
        if "radio" in robot.kind and robot.carrier is None and robot.docks_since is None:
            docking = max(dock_cells(kind, robot.kind) for kind in carriers)
            apart[name] = cell, max(robot.kind["radio"], docking) + slack
        elif not robot.lost:
            relays.append(cell)
    while relays:
        here = relays.pop()
        for name in [name for name, (cell, limit) in apart.items() if math.dist(cell, here) <= limit]:
            relays.append(apart.pop(name)[0])
    return there - apart.keys()

"""What a storm's oracle knows of rovers out of contact: who can hear whom, and where rovers have been meanwhile."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from benchmarks.storm.account import Robot
from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell

MISSING = "is not where it was expected"

SLACK_CELLS = 1.5  # robots may be at either end of a step


def draw_ranges(rng: random.Random, document: Document) -> None:
    """Limit the radios of some rover types."""
    for kind in document["robot_types"]:
        if kind["role"] == "rover" and rng.random() < 0.8:
            kind["radio_range_m"] = round(document["map"]["resolution_m"] * rng.choice((0.1, 2, 4, 8, 16)), 6)


@dataclass
class Parting:
    """A rover out of contact."""

    told: int  # the last plan that it knows
    visits: int  # how many cells it had visited
    cell: Cell | None


@dataclass
class Contacts:
    """Which rovers are out of contact, by the log so far."""

    metre: float
    dock_cells: Callable[[Document, Document], float]
    away: dict[str, Parting] = field(default_factory=dict)
    parted: set[str] = field(default_factory=set)  # those that were at some time
    missing: set[str] = field(default_factory=set)  # those reported lost for that
    ways: dict[str, tuple[int, list[Cell]]] = field(default_factory=dict)  # when they were heard again, and their way

    def lose(self, name: str, robot: Robot, told: int) -> None:
        self.away[name] = Parting(told, len(robot.visits), robot.cell)
        self.parted.add(name)

    def regain(self, name: str, robot: Robot, t_ms: int) -> None:
        parting = self.away.pop(name)
        passed = [at for at, ms in zip(robot.drive, robot.passed_ms, strict=False) if ms <= t_ms + 1]
        way = [cell for _, cell in robot.visits[max(0, parting.visits - 1) :]] + passed
        self.ways[name] = t_ms, [*way, *([parting.cell] if parting.cell else [])]

    def way(self, name: str, t_ms: int) -> list[Cell]:
        """Return the way of a rover that was out of contact until now; empty for others."""
        heard_ms, way = self.ways.get(name, (-1, []))
        return way if heard_ms == t_ms else []

    def heard(self, robots: Mapping[str, Robot], kinds: Iterable[Document], t_ms: int, slack: float) -> set[str]:
        """Return the robots that are in contact by their positions, if ranges are this much longer."""
        carriers = [kind for kind in kinds if kind["role"] == "carrier"]
        there, relays, apart = set(robots), [], {}
        for name, robot in robots.items():
            cell = next((at for at, ms in _passed(robot) if ms <= t_ms), robot.cell)
            limited = "radio_range_m" in robot.kind and robot.carrier is None and robot.busy_until is None
            if limited and cell is not None:
                docking = max(self.dock_cells(kind, robot.kind) for kind in carriers)
                apart[name] = cell, max(robot.kind["radio_range_m"] * self.metre, docking) + slack
            elif cell is not None and not robot.lost:
                relays.append(cell)
        while relays:
            here = relays.pop()
            for name in [name for name, (cell, limit) in apart.items() if math.dist(cell, here) <= limit]:
                relays.append(apart.pop(name)[0])
        return there - apart.keys()


def _passed(robot: Robot) -> list[tuple[Cell, int]]:
    return list(zip(robot.drive, robot.passed_ms, strict=False))[::-1]

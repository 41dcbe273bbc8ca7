"""What the mission loop needs of a world, simulated or real: a map that grows, robots, and four commands.

Time is mission time in integer ms. A robot that drives may be told to stop; it then stands at the next cell of
its route a moment later. Commands are given to robots that are free only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from marsupial.model.frames import FrameShift
from marsupial.model.grid import Cell, Grid


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotReport:
    """Where a robot is.

    Parameters
    ----------
    cell
        Where it stands; while driving the next cell it passes; None while it is carried.
    carrier
        Who carries it. From the start of a docking the rover counts as aboard, with `free_at_ms` its end.
    free_at_ms
        Mission time from which it can be given a new command if it is told to stop now.
    heading
        Digit of the step to `cell` (0 is +x, 2 is +y; `marsupial.paths.routes`); None before its first step and after
        it was carried.
    """

    name: str
    type: str
    cell: Cell | None
    carrier: str | None
    free_at_ms: int
    lost: bool = False
    heading: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvres:
    """How often a robot has stopped on its way, and turned by 45, 90, 135 and 180 degrees."""

    stops: int
    turns: tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class News:
    """What happened at one moment.

    Parameters
    ----------
    revealed
        (robot, row-major indices of the cells it saw first), in order.
    changed
        (robot, row-major indices of the known cells that it found to be different, or to be unknown again), in order;
        only in worlds whose maps are made by others.
    moved
        How the frame of the map has grown, or None; the world's grid is another one then. All indices are of the frame
        as it is now.
    finished
        Robots whose command ended at that moment (both of a docking).
    failed
        (robot, reason) of the robots whose command ended without being carried out (both of a docking). After a
        docking that failed the rover stands where it was, after an undocking that failed it is still aboard.
    lost
        (robot, reason) of the robots that failed for good.
    """

    t_ms: int
    revealed: tuple[tuple[str, npt.NDArray[np.int64]], ...] = ()
    finished: tuple[str, ...] = ()
    failed: tuple[tuple[str, str], ...] = ()
    lost: tuple[tuple[str, str], ...] = ()
    changed: tuple[tuple[str, npt.NDArray[np.int64]], ...] = ()
    moved: FrameShift | None = None
    partial: bool = False


class World(Protocol):
    """A map being revealed and the robots in it."""

    @property
    def grid(self) -> Grid:
        """The known map; its cells change as robots see more. Another one where its frame has grown (`News.moved`)."""

    @property
    def now_ms(self) -> int:
        """Mission time."""

    def robots(self) -> tuple[RobotReport, ...]:
        """Return every robot of the team, in a fixed order."""

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        """Send a free robot along `route`, which starts at its cell."""

    def stop(self, robot: str) -> None:
        """Let a driving robot stop at the next cell of its route; no-op for one that does not drive."""

    def dock(self, rover: str, carrier: str) -> None:
        """Let a free rover dock on a free carrier beside it."""

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Let a free carrier set a rover down on `cell`."""

    def advance(self, until_ms: int) -> News:
        """Let time pass until something happens, at most until `until_ms`, and say what."""

    def distance_m(self, robot: str) -> float:
        """Return how far a robot has driven by itself."""

    def driving_ms(self, robot: str) -> int:
        """Return how long a robot has been driving."""

    def manoeuvres(self, robot: str) -> Manoeuvres:
        """Return how often a robot has stopped and turned."""

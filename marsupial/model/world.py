"""The interface of a world, simulated or real: a map that grows, robots that report, and four commands.

`World` is all that the mission loop knows of the simulator or of real robots. Times are mission time in integer ms.
A driving robot can be stopped; it then stands at the next cell of its route. Other commands need a free robot.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from marsupial.model.frames import FrameShift
from marsupial.model.grid import Cell, Grid
from marsupial.model.robots import RobotType
from marsupial.model.zones import ZoneChange


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotReport:
    """Where a robot is and when it is free."""

    name: str
    type: str
    cell: Cell | None  # its cell; the next cell of its route while it drives; None while it is carried
    # the carrier that carries it. A docking rover counts as aboard from the start, until `free_at_ms`.
    carrier: str | None
    free_at_ms: int  # mission time from which it can take a new command, if it stops now
    lost: bool = False
    returns: bool = False  # whether it is expected to act again, if it is lost
    # digit of the step to `cell` (0 is +x, 2 is +y; `marsupial.paths.routes`); None before its first step and after it
    # was carried
    heading: int | None = None
    speed: float = 1.0  # share of its type's speed at which it drives
    # share of its battery's capacity that it will have at `free_at_ms`; None: full, or it has no battery
    charge: float | None = None
    # The cells of the targets that a rover out of contact was sent to. The report then says where and when the rover is
    # expected to wait. None: in contact.
    away: tuple[Cell, ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvres:
    """Number of stops on the way, and of turns by 45, 90, 135 and 180 degrees."""

    stops: int
    turns: tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class News:
    """The events of one moment."""

    t_ms: int
    # (robot, row-major indices of the cells it saw first), in order
    revealed: tuple[tuple[str, npt.NDArray[np.int64]], ...] = ()
    finished: tuple[str, ...] = ()  # robots whose command ended at that moment (both of a docking)
    # (robot, reason) of the robots whose command failed (both of a docking). After a failed docking the rover stands
    # where it was; after a failed undocking it is still aboard.
    failed: tuple[tuple[str, str], ...] = ()
    declined: tuple[tuple[str, str], ...] = ()  # the same for commands that a robot refused when it got them
    lost: tuple[tuple[str, str], ...] = ()  # (robot, reason) of the robots that failed
    returned: tuple[str, ...] = ()  # lost robots that can act again
    slowed: tuple[tuple[str, float], ...] = ()  # (robot, its new `RobotReport.speed`), also of those that are faster
    drained: tuple[str, ...] = ()  # robots that report clearly less charge than was estimated
    out_of_contact: tuple[str, ...] = ()  # rovers that can no longer report and be told anything
    returning: tuple[str, ...] = ()  # those of them without a plan that drive back to where they were set down
    in_contact: tuple[str, ...] = ()  # rovers that can again
    stops: tuple[tuple[str, tuple[Cell, ...]], ...] = ()  # where these have stood in between, and looked round
    # (robot, row-major indices of known cells that now have another code, or are unknown again), in order; only in
    # worlds that change, or whose map other software builds
    changed: tuple[tuple[str, npt.NDArray[np.int64]], ...] = ()
    # how the frame of the map grew, or None. The world then has a new grid; all indices refer to the new frame.
    moved: FrameShift | None = None
    # (robot, cells) of robots that wait for others, with the cell where they stand, and that resume, make room or
    # change their speed, with their way from there, in order
    passages: tuple[tuple[str, tuple[Cell, ...]], ...] = ()
    zones: tuple[ZoneChange, ...] = ()  # by an operator, in order
    partial: bool = False  # whether more news of the same moment may follow, as robots report one by one


_OF_ROBOTS = ("finished", "failed", "declined", "lost", "returned", "slowed", "drained")  # fields with names in front


def apart(news: News, robots: Container[str]) -> tuple[News, News]:
    """Return news without what happens to some robots, as they can't report it, and what that is."""
    others: dict[str, Any] = {}
    own: dict[str, Any] = {}
    for key in _OF_ROBOTS:
        events = [(one if isinstance(one, str) else one[0], one) for one in getattr(news, key)]
        others[key] = tuple(one for name, one in events if name not in robots)
        own[key] = tuple(one for name, one in events if name in robots)
    return replace(news, **others), News(t_ms=news.t_ms, **own)


class HeldNews:
    """What has happened to robots out of contact: it is told once they are in contact again."""

    def __init__(self) -> None:
        self._held = News(t_ms=0)

    def told(self, news: News, away: Container[str]) -> News:
        """Return the news of robots that are not `away`, after what was held of them; hold the rest."""
        all_events = {key: getattr(self._held, key) + getattr(news, key) for key in _OF_ROBOTS}
        news, self._held = apart(replace(news, **all_events), away)
        return news


@dataclass(slots=True)
class MomentNews:
    """News that a world gathers; the fields are those of `News`."""

    revealed: list[tuple[str, npt.NDArray[np.int64]]] = field(default_factory=list)
    changed: list[tuple[str, npt.NDArray[np.int64]]] = field(default_factory=list)
    finished: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    declined: list[tuple[str, str]] = field(default_factory=list)
    lost: list[tuple[str, str]] = field(default_factory=list)
    returned: list[str] = field(default_factory=list)
    slowed: list[tuple[str, float]] = field(default_factory=list)
    drained: list[str] = field(default_factory=list)
    out_of_contact: list[str] = field(default_factory=list)
    returning: list[str] = field(default_factory=list)
    in_contact: list[str] = field(default_factory=list)
    passages: list[tuple[str, tuple[Cell, ...]]] = field(default_factory=list)
    zones: list[ZoneChange] = field(default_factory=list)

    def news(self, t_ms: int) -> News | None:
        """Return the news, None if there is none."""
        parts = self.parts()
        return News(t_ms=t_ms, **parts) if parts else None

    def parts(self) -> dict[str, Any]:
        """Return the fields that are not empty, as those of `News`."""
        return {name: tuple(events) for name in MomentNews.__slots__ if (events := getattr(self, name))}


class World(Protocol):
    """A partly known map and the robots in it."""

    @property
    def grid(self) -> Grid:
        """The known map. Its cells change as robots see more; a grown frame (`News.moved`) is a new grid."""

    @property
    def now_ms(self) -> int:
        """Mission time."""

    def robots(self) -> tuple[RobotReport, ...]:
        """Return every robot of the team, in a fixed order."""

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        """Send a free robot along `route`, which starts at its cell."""

    def stop(self, robot: str) -> None:
        """Stop a driving robot at the next cell of its route; do nothing if it does not drive."""

    def dock(self, rover: str, carrier: str) -> None:
        """Dock a free rover on a free carrier beside it."""

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        """Set a rover of a free carrier down on `cell`."""

    def advance(self, until_ms: int) -> News:
        """Let time pass until something happens, at most until `until_ms`; return the news."""

    def distance_m(self, robot: str) -> float:
        """Return how far a robot has driven itself, in metres."""

    def driving_ms(self, robot: str) -> int:
        """Return how long a robot has been driving."""

    def manoeuvres(self, robot: str) -> Manoeuvres:
        """Return how often a robot has stopped and turned."""


def energy_j(world: World, kinds: Mapping[str, RobotType], off_ms: Mapping[str, int]) -> tuple[tuple[str, float], ...]:
    """Return the energy in J that each robot has used so far, by name; `off_ms` is how long robots were off."""

    def used(robot: RobotReport) -> float:
        energy, made = kinds[robot.type].energy, world.manoeuvres(robot.name)
        idle_ms = world.now_ms - off_ms.get(robot.name, 0)
        timed = energy.idle_w * (idle_ms / 1000) + energy.drive_w * (world.driving_ms(robot.name) / 1000)
        driven = energy.metre_j * world.distance_m(robot.name) + energy.stop_j * made.stops
        turned = sum(joules * times for joules, times in zip(energy.turn_j, made.turns, strict=True))
        return round(timed + driven + turned, 3)

    return tuple((robot.name, used(robot)) for robot in world.robots())

"""What a mission of the service is made of: its brief, and all that is ever put into it."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from itertools import chain
from typing import Any, NamedTuple, Protocol

import numpy as np

from marsupial.model.grid import Cell, CellArray, Grid, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.planning import Budget, Outcome
from marsupial.model.robots import RobotType
from marsupial.model.runs import Runs
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.strategy import PlanningReport
from marsupial_service.missions.frames import MissionFrame
from marsupial_service.schemas.words import EventType


class SimulatedRobots(Protocol):
    """Robots that the process of their mission simulates.

    Attributes
    ----------
    paused
        Whether the mission is.
    """

    paused: bool

    def report(self, batch: Mapping[str, Any]) -> MissionReport | None:
        """Carry out the commands of an event `commands`; return the report that it asks for, if it does."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionBrief:
    """All that is fixed when a mission is created.

    Parameters
    ----------
    planner, engine
        What the client calls it, and the library.
    grid
        What is known of the map at first.
    reachable
        The cells that count as the area to explore, if the client knows.
    """

    name: str
    strategy: str
    planner: str
    engine: str
    budget: Budget
    seed: int
    grid: Grid
    kinds: tuple[RobotType, ...]
    robots: tuple[PlacedRobot, ...]
    goal: Goal
    limits: MissionLimits
    planning_time: PlanningTime
    reachable: Mask | None = None

    def simulation(self) -> Mapping[str, object] | None:
        """Return how the service simulates the robots, ready for JSON; None if they are the client's."""
        return None

    def simulated_robots(self) -> SimulatedRobots | None:
        """Return the robots that the service simulates."""
        return None

    def without_command(self, text: str) -> str:
        """Return what is said of the planner by the name the client has for it."""
        return text.replace(self.engine, self.planner)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotUpdate:
    """What a report says of a robot; None where it says nothing.

    Parameters
    ----------
    cell
        Where it is; of one that drives, where it would be if it were told to stop.
    free_at_ms
        When it would be there.
    distance_m, driving_ms
        How far and how long it has driven in all.
    """

    name: str
    cell: Cell | None = None
    free_at_ms: int | None = None
    distance_m: float | None = None
    driving_ms: int | None = None

    def __getstate__(self) -> list[object]:
        """Return what is stored: of each robot in each report, so it is spelt out."""
        return [self.name, self.cell, self.free_at_ms, self.distance_m, self.driving_ms]

    def __setstate__(self, state: Sequence[object]) -> None:
        """Take up what is stored."""
        for put, value in zip(_NOTED, state, strict=True):
            put(self, value)


_NOTED = tuple(getattr(RobotUpdate, one.name).__set__ for one in fields(RobotUpdate))
"""What sets each field: twice as fast as `object.__setattr__`, and robots are told of in every report."""


@dataclass(frozen=True, kw_only=True, eq=False)  # with slots early Pythons 3.11 put their own __getstate__ in
class MissionReport:
    """What a client reports of one moment.

    Parameters
    ----------
    n
        Counts the reports of a mission, or those of `robot`, from 1.
    revealed
        (robot, cells it has seen); code 255 for those that are not known any more.
    map
        A whole new map, shape (height, width), instead.
    finished, failed
        Commands by their ids; with the reason.
    robot
        Who reports by its own count; None if the team does.
    frame
        The frame that all cells of the report are of; None for the one that the mission was created with.
    """

    n: int
    t_ms: int
    revealed: tuple[tuple[str, Runs], ...] = ()
    map: CellArray | None = None
    robots: tuple[RobotUpdate, ...] = ()
    finished: tuple[int, ...] = ()
    failed: tuple[tuple[int, str], ...] = ()
    lost: tuple[tuple[str, str], ...] = ()
    robot: str | None = None
    frame: MissionFrame | None = None

    @property
    def runs(self) -> Runs:
        """The cells that were revealed, by whatever robots: of each in ascending order."""
        return tuple(chain.from_iterable(runs for _, runs in self.revealed))

    def __getstate__(self) -> list[object]:
        """Return what is stored; maps are long runs of few codes, and are stored as short as that makes them."""
        packed = None if self.map is None else (self.map.shape, zlib.compress(self.map.tobytes(), 1))
        return [packed if name == "map" else getattr(self, name) for name in _REPORTED]

    def __setstate__(self, state: Sequence[object]) -> None:
        """Restore what is stored."""
        for name, value in zip(_REPORTED, state, strict=True):
            if isinstance(value, tuple) and name == "map":
                value = np.frombuffer(zlib.decompress(value[1]), dtype=np.uint8).reshape(value[0])
            object.__setattr__(self, name, value)


_REPORTED = tuple(one.name for one in fields(MissionReport))


class Control(StrEnum):
    """What a client wants of the mission as a whole."""

    PAUSE = "pause"
    RESUME = "resume"
    CANCEL = "cancel"


Input = MissionReport | Control


@dataclass(frozen=True, slots=True)
class StoredEvent:
    """One event; `data` is JSON in one line."""

    type: EventType
    data: str


class StoredReport(NamedTuple):
    """A report as it is stored: with the digest of what was sent."""

    report: MissionReport
    digest: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionBatch:
    """What a mission makes of one input (the first one: of its brief); `over` if that was its end.

    Parameters
    ----------
    revision
        Of the plan that robots follow then.
    next
        What robots that are simulated report then, if they are not to report anything else before.
    """

    events: tuple[StoredEvent, ...]
    over: bool
    revision: int
    next: StoredReport | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingInput:
    """An input (None: the brief), or what the store keeps of it, and the decisions made when it had come.

    There are such decisions only if the input was answered before, by a process that is no more.
    """

    input: Input | bytes | None
    decisions: tuple[str, ...] = ()


class PendingInputs(NamedTuple):
    """What the process of a mission gets to answer, in this order."""

    inputs: tuple[PendingInput, ...]


class MissionBatches(NamedTuple):
    """What it makes of them: a batch for each, in one piece or several."""

    batches: tuple[MissionBatch, ...]


def planning_of(document: Mapping[str, Any]) -> PlanningReport:
    """Return how a decision was found, from its document."""
    report = {key: value for key, value in document.items() if key != "actions"}
    return PlanningReport(**{**report, "outcome": Outcome(document["outcome"])})


class WantsToPlan(NamedTuple):
    """The process of a mission wants to plan, and waits until it may."""


class MayPlan(NamedTuple):
    """It may."""


class HasPlanned(NamedTuple):
    """It has planned."""

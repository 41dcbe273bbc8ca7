"""What a mission of the service is made of: its brief, and all that is ever put into it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import chain
from typing import NamedTuple

from marsupial.model.grid import Cell, CellArray, Grid, Mask
from marsupial.model.mission import MissionStarted, PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType
from marsupial.model.runs import Runs
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial_service.missions.frames import MissionFrame
from marsupial_service.schemas.words import EventType


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotSimulation:
    """How the service simulates the robots of a mission.

    Parameters
    ----------
    truth
        The cells of the real map, shape (height, width).
    speed
        Seconds of mission time to a second on the clock; None: as fast as planning allows.
    warnings
        What is odd about the map.
    """

    truth: CellArray
    speed: float | None = None
    warnings: tuple[str, ...] = ()


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
    simulation
        None if the robots are the client's.
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
    simulation: RobotSimulation | None = None

    @property
    def started(self) -> MissionStarted:
        """The first event of the mission."""
        return MissionStarted.of(
            self.grid,
            scenario=self.name,
            strategy=self.strategy,
            planner=self.planner,
            seed=self.seed,
            types=self.kinds,
            robots=self.robots,
            goal=self.goal,
        )

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
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


class WantsToPlan(NamedTuple):
    """The process of a mission wants to plan, and waits until it may."""


class MayPlan(NamedTuple):
    """It may."""


class HasPlanned(NamedTuple):
    """It has planned."""

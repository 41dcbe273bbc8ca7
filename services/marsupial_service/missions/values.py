"""What a mission of the service consists of: its brief and its inputs."""

from dataclasses import dataclass
from enum import Enum, StrEnum, auto

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
    """How the service simulates the robots of a mission."""

    truth: CellArray  # the real map, shape (height, width)
    speed: float | None = None  # seconds of mission time to a second on the clock; None: as fast as planning allows
    warnings: tuple[str, ...] = ()  # what is odd about the map


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionBrief:
    """All that is fixed when a mission is created."""

    name: str
    strategy: str
    planner: str  # the client's name of it
    engine: str  # the library's name of it
    budget: Budget
    seed: int
    grid: Grid  # what is known of the map at first
    kinds: tuple[RobotType, ...]
    robots: tuple[PlacedRobot, ...]
    goal: Goal
    limits: MissionLimits
    planning_time: PlanningTime
    reachable: Mask | None = None  # the cells that count as the area to explore, if the client knows
    simulation: RobotSimulation | None = None  # None if the robots are the client's

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
    """What a report says of a robot; None where it says nothing."""

    name: str
    cell: Cell | None = None  # where it is; while it drives, where it would stop if commanded now
    free_at_ms: int | None = None  # when it would be there
    distance_m: float | None = None  # driven so far, in all; `driving_ms`: for how long
    driving_ms: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionReport:
    """What a client reports of one moment."""

    n: int  # counts the reports of a mission, or those of `robot`, from 1
    t_ms: int
    # (robot, cells it has seen); code 255 for those that are not known any more
    revealed: tuple[tuple[str, Runs], ...] = ()
    map: CellArray | None = None  # a whole new map instead, shape (height, width)
    robots: tuple[RobotUpdate, ...] = ()
    finished: tuple[int, ...] = ()  # commands by their ids
    failed: tuple[tuple[int, str], ...] = ()  # the same, with the reason
    lost: tuple[tuple[str, str], ...] = ()  # (robot, reason)
    robot: str | None = None  # who reports by its own count; None if the team does
    frame: MissionFrame | None = None  # of all cells of the report; None: the first frame of the mission


StoredReport = tuple[MissionReport, bytes]  # with the digest of what was sent


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


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionBatch:
    """What a mission makes of one input (the first one: of its brief); `over` if that was its end."""

    events: tuple[StoredEvent, ...]
    over: bool
    revision: int  # of the plan that robots follow then
    next: StoredReport | None = None  # what simulated robots report then, if nothing else is due before


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingInput:
    """An input (None: the brief), or what the store keeps of it."""

    input: Input | bytes | None
    decisions: tuple[str, ...] = ()  # made by an earlier process for this input


class PlanningTurn(Enum):
    """What a mission's process and its supervisor tell each other besides inputs and batches."""

    WANTED = auto()  # the process waits until it may plan
    ALLOWED = auto()
    DONE = auto()

"""The parts of a mission: its brief, its inputs and its outputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from typing import Any

from marsupial.model.grid import Grid, Mask
from marsupial.model.mission import MissionStarted, PlacedRobot
from marsupial.model.missionframe import MissionFrame
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType
from marsupial.model.runs import Runs
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.zones import DatedZone, ZoneChange
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.missions import ReportFields


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSimulation:
    """How the service simulates the robots of a mission."""

    truth: Runs  # of the real map
    speed: float | None = None  # seconds of mission time to a second on the clock; None: as fast as planning allows
    warnings: tuple[str, ...] = ()  # what is odd about the map
    faults: tuple[Mapping[str, Any], ...] = ()  # what goes wrong, as in a scenario file


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionBrief:
    """Everything that is fixed when a mission is created."""

    name: str
    strategy: str
    planner: str  # the client's name for it
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
    zones: tuple[DatedZone, ...] = ()
    map_may_grow: bool = False  # whether the world may go on beyond the frame of the map

    @property
    def margin(self) -> int:
        """How many unknown cells lie beyond each edge of the map: one makes ground at the edge a frontier."""
        return int(self.map_may_grow)

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

    @property
    def kind_of(self) -> dict[str, RobotType]:
        """The type of each robot, by name."""
        of = {kind.name: kind for kind in self.kinds}
        return {robot.name: of[robot.type] for robot in self.robots}


@dataclass(frozen=True, slots=True, eq=False)
class MissionTask:
    """What a process of a mission needs: its brief, and the library's name for its planner, which is not stored."""

    brief: MissionBrief
    engine: str

    def without_command(self, text: str) -> str:
        """Replace the planner's engine name in a text by the client's name for it."""
        return text.replace(self.engine, self.brief.planner)


class MissionReport(ReportFields):
    """A checked report. Robots have cells instead of poses."""

    frame: MissionFrame | None = None  # of all cells of the report; None: the first frame of the mission


StoredReport = tuple[MissionReport, bytes]  # with the digest of what was sent


class Control(StrEnum):
    """A client's request to the mission as a whole."""

    PAUSE = "pause"
    RESUME = "resume"
    WIND_DOWN = "wind-down"
    CANCEL = "cancel"
    NOTHING = "nothing"  # of a request that changed nothing: stored so that a late copy of it changes nothing either


Input = MissionReport | Control | ZoneChange


@dataclass(frozen=True, slots=True)
class StoredEvent:
    """One event; `data` is JSON in one line."""

    type: EventType
    data: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionBatch:
    """A mission's answer to one input (the first: to its brief); `over` if the mission has ended."""

    events: tuple[StoredEvent, ...]
    over: bool
    revision: int  # of the plan that robots then follow
    next: StoredReport | None = None  # the next report of simulated robots, if nothing else is due before


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingInput:
    """An input (None: the brief), or its stored form."""

    input: Input | bytes | None
    decisions: tuple[str, ...] = ()  # made by an earlier process for this input


class PlanningSignal(Enum):
    """The messages between a mission's process and its supervisor besides inputs and batches."""

    REQUESTED = auto()  # the process waits until it may plan
    ALLOWED = auto()
    DONE = auto()

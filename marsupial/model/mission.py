"""The events of a mission, from `MissionStarted` to `MissionEnded`.

They are the mission log (`marsupial.formats.missionlog` writes one JSON object per line) and contain all that a replay
needs: which cells were revealed when, who drove where, which plan was followed and why it was made. They contain no
wall-clock time, so the same scenario, seed and step budget give the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from marsupial.model.grid import Cell, Grid, Terrain
from marsupial.model.plan import Action
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.zones import Zone


class Status(StrEnum):
    """How a mission ended; `marsupial.mission.ending` says what each means."""

    COMPLETE = "complete"
    STALLED = "stalled"
    TIME_LIMIT = "time_limit"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedRobot:
    """A robot when the mission starts: at a cell, or aboard a carrier."""

    name: str
    type: str
    cell: Cell | None = None
    carrier: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionStarted:
    """First event: everything that is fixed for the mission."""

    t_ms: int
    scenario: str
    strategy: str
    planner: str
    seed: int
    width: int  # in cells, as the height
    height: int
    resolution_m: float
    origin_m: tuple[float, float, float]
    terrains: tuple[Terrain, ...]
    types: tuple[RobotType, ...]
    robots: tuple[PlacedRobot, ...]
    goal: Goal
    interference: bool = False  # whether robots keep out of each other's footprints
    chargers: tuple[Cell, ...] = ()  # charging places

    @classmethod
    def of(cls, grid: Grid, **others: Any) -> MissionStarted:
        """Return the event at time 0 for the frame and terrains of a map, with all `others` of its fields."""
        return cls(
            t_ms=0,
            width=grid.width,
            height=grid.height,
            resolution_m=grid.resolution_m,
            origin_m=grid.origin_m,
            terrains=grid.terrains,
            chargers=grid.chargers,
            **others,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Revealed:
    """Cells (row-major) seen for the first time by `robot`; for `runs` see `marsupial.model.runs`."""

    t_ms: int
    robot: str
    runs: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Changed:
    """Known cells that `robot` saw changed, encoded as in `Revealed`; code 255: unknown again."""

    t_ms: int
    robot: str
    runs: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameGrown:
    """The frame of the map grew to `width` x `height` cells with its lower left corner at `origin_m`.

    Cell (x, y) is cell (x, y) + `shift` from now on (`marsupial.model.frames`). Places keep their names.
    """

    t_ms: int
    width: int
    height: int
    origin_m: tuple[float, float, float]
    shift: Cell


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveStarted:
    """`robot` starts a drive from the centre of `cell` along `steps`.

    A step is a digit: 0 east (+x), 1 north-east, 2 north (+y), ... 7 south-east. The robot passes the centre of the
    k-th cell at ``t_ms + round(1000 * length_m / speed_mps)``; `RobotType` has the length of diagonal steps.
    """

    t_ms: int
    robot: str
    cell: Cell
    steps: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEnded:
    """`robot` stands at `cell`: it reached the end of its drive, or was stopped."""

    t_ms: int
    robot: str
    cell: Cell


@dataclass(frozen=True, slots=True, kw_only=True)
class MapTarget:
    """A target on the map: its representative frontier cell, its explorer types, the area it may reveal, its size."""

    name: str
    cell: Cell
    explorers: tuple[str, ...]
    reveal_m2: float
    frontier_cells: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MapMeeting:
    """A meeting point on the map: cells of the carrier and of the rover, and their types."""

    name: str
    carrier_cell: Cell
    rover_cell: Cell
    carrier_type: str
    rover_type: str


@dataclass(frozen=True, slots=True, kw_only=True)
class GuessedGround:
    """Unknown squares whose contents a strategy guesses, by column and row."""

    corner: Cell  # lower left cell of the square in column 0 and row 0; it may lie outside the map
    side: int  # of a square, in cells
    halls: tuple[Cell, ...]  # for carriers
    rooms: tuple[Cell, ...]  # for rovers alone


class Cause(StrEnum):
    """Why a new plan is needed."""

    START = "start"  # of the mission
    FAILED = "failed"  # commands of robots failed
    LOST = "lost"  # robots failed for good
    RETURNED = "returned"  # lost robots can act again, or absent ones joined
    SPEED = "speed changed"  # of robots
    DRAINED = "charge low"  # batteries have less charge than plans counted on
    CONTACT = "in contact"  # again: rovers that were out of contact
    PARTED = "out of contact"  # rovers that now carry out nothing but their last command
    ZONES = "zones changed"
    GONE = "gone"  # targets of the plan disappeared
    NEW = "new"  # targets that the plan does not know
    ROBOT_FREE = "robot free"  # a robot has no action left, and a target has no robot
    WAY_BLOCKED = "way blocked"  # robots have no route
    CARRIED_OUT = "plan carried out"
    OVERTAKEN = "plan overtaken"  # by events during planning
    EXPLORED = "explored"  # all reachable cells have been seen
    CALLED_BACK = "called back"  # the team has to return: for want of time, as enough is explored, or by an operator
    OTHER = "other"  # an unknown text in a log


@dataclass(frozen=True, slots=True)
class Trigger:
    """A reason for a new plan, and the robots or targets that it is about."""

    cause: Cause
    names: tuple[str, ...] = ()


Triggers = tuple[Trigger, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """The team follows a new plan; `trigger` has the reasons for it, and the actions' times are mission times."""

    t_ms: int
    revision: int
    trigger: Triggers
    targets: tuple[MapTarget, ...]
    meetings: tuple[MapMeeting, ...]
    actions: tuple[Action, ...]
    charges: tuple[tuple[str, float], ...] = ()  # the share of charge in the battery of each robot that has one
    # guess, compared, instead: the reasons of the strategy (`marsupial.model.strategy.Reasons`)
    guess: GuessedGround | None = None
    compared: tuple[tuple[str, int, int], ...] = ()
    instead: tuple[tuple[str, tuple[str, ...]], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionStarted:
    """An action of plan `revision` starts; `cell` is where its (first) robot will be at its end."""

    t_ms: int
    revision: int
    action: Action
    cell: Cell


class ActionEnd(StrEnum):
    """How an action ended."""

    DONE = "done"
    SUPERSEDED = "superseded"  # the next plan has another action
    BLOCKED = "blocked"  # it has no passable route
    FAILED = "failed"  # its command failed
    LOST = "lost"  # one of its robots was lost


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionEnded:
    """An action ended; a drive without a route ends without having started."""

    t_ms: int
    revision: int
    action: Action
    end: ActionEnd


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLost:
    """A robot failed, stays where it is, and does nothing unless it returns."""

    t_ms: int
    robot: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotReturned:
    """A lost robot can act again, where it is; also of a robot that joins the team."""

    t_ms: int
    robot: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactLost:
    """A rover is out of contact: it is expected to wait at `cell` from `wait_ms` on, and was sent to `targets`."""

    t_ms: int
    robot: str
    cell: Cell
    wait_ms: int
    targets: tuple[Cell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactRegained:
    """A rover is in contact again."""

    t_ms: int
    robot: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedChanged:
    """A robot drives at a `share` of its type's speed from its next cell on."""

    t_ms: int
    robot: str
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneChanged:
    """A zone holds from now on, in place of one of the same name; None: it holds no more."""

    t_ms: int
    name: str
    zone: Zone | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Remaining:
    """A frontier left at the end, and why it was not explored."""

    cell: Cell
    frontier_cells: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Interference:
    """How often robots waited for others, their total waiting time, and the number of deadlocks.

    A detour, or a robot that makes room, resolves a deadlock.
    """

    waits: int
    waited_s: float
    deadlocks: int


KNOWN_PERCENT = (50, 75, 90, 95, 99, 100)
"""The shares of the reachable area, in per cent, whose times a mission tells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionEnded:
    """Last event: the stop report and the metrics (docs/command-line.md defines them)."""

    t_ms: int
    status: Status
    reason: str
    exploration_ms: int | None  # when the last target disappeared, or None if targets are left
    explored_area_m2: float
    reachable_area_m2: float
    distance_m: tuple[tuple[str, float], ...]
    energy_j: tuple[tuple[str, float], ...]
    deployments: int
    retrievals: int
    replans: int
    plans_valid: int
    plans_invalid: int
    aboard: tuple[str, ...]
    remaining: tuple[Remaining, ...]
    lost: tuple[str, ...] = ()  # robots that are lost
    # (per cent of the reachable area, when so much was known, or None if it never was), for each of `KNOWN_PERCENT`
    known_ms: tuple[tuple[int, int | None], ...] = ()
    mean_known_ms: int | None = None  # when a reachable cell became known, on average; at the end if it never did
    interference: Interference | None = None  # None if robots share cells

    @property
    def coverage(self) -> float:
        """Explored share of the reachable area, 0 to 1."""
        # with nothing to explore, all of it is explored
        return 1.0 if self.reachable_area_m2 == 0 else self.explored_area_m2 / self.reachable_area_m2


MissionEvent = (
    MissionStarted
    | Revealed
    | Changed
    | FrameGrown
    | DriveStarted
    | DriveEnded
    | Planned
    | ActionStarted
    | ActionEnded
    | RobotLost
    | RobotReturned
    | ContactLost
    | ContactRegained
    | SpeedChanged
    | ZoneChanged
    | MissionEnded
)


def started(events: Sequence[MissionEvent]) -> MissionStarted:
    """Return the first event of a mission."""
    first = events[0]
    assert isinstance(first, MissionStarted), "a log begins with the start of its mission"
    return first

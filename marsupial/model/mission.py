"""What happens in a mission, as events on simulated time, and how it ends.

The events are the mission log (`marsupial.formats.missionlog` writes one JSON object a line) and hold all that a
replay needs: which cells were revealed when, who drove which way, which plan was followed and why it was made.
They hold no wall-clock time, so the same scenario, seed and step budget give the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from marsupial.model.grid import Cell, Terrain
from marsupial.model.plan import Action
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal


class Status(StrEnum):
    """How a mission ended."""

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
    """First event: everything fixed for the mission. `width` and `height` in cells."""

    t_ms: int
    scenario: str
    strategy: str
    planner: str
    seed: int
    width: int
    height: int
    resolution_m: float
    origin_m: tuple[float, float, float]
    terrains: tuple[Terrain, ...]
    types: tuple[RobotType, ...]
    robots: tuple[PlacedRobot, ...]
    goal: Goal


@dataclass(frozen=True, slots=True, kw_only=True)
class Revealed:
    """Cells seen for the first time by `robot`.

    `runs` is flat: (start, length, code) three by three, cells numbered row-major (y * width + x).
    """

    t_ms: int
    robot: str
    runs: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Changed:
    """Cells known before that `robot` has found to be different, as in `Revealed`; code 255: not known any more."""

    t_ms: int
    robot: str
    runs: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameGrown:
    """The frame of the map has grown to `width` x `height` cells with its lower left corner at `origin_m`.

    What was cell (x, y) is cell (x, y) + `shift` from now on, and targets and meeting points, which are called after
    their cells, have names to match (`marsupial.model.frames`).
    """

    t_ms: int
    width: int
    height: int
    origin_m: tuple[float, float, float]
    shift: Cell


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveStarted:
    """`robot` sets out from the centre of `cell` along `steps`.

    A step is a digit: 0 east (+x), 1 north-east, 2 north (+y), ... 7 south-east. The centre of the k-th cell is
    passed at ``t_ms + round(1000 * length_m / speed_mps)``, along the steps (diagonals: `RobotType`).
    """

    t_ms: int
    robot: str
    cell: Cell
    steps: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEnded:
    """`robot` stands at `cell`, at the end of its drive or where it was stopped."""

    t_ms: int
    robot: str
    cell: Cell


@dataclass(frozen=True, slots=True, kw_only=True)
class MapTarget:
    """A target on the map: representative frontier cell, who can explore it, the area it may reveal, its size."""

    name: str
    cell: Cell
    explorers: tuple[str, ...]
    reveal_m2: float
    frontier_cells: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MapMeeting:
    """A meeting point on the map: pose of the carrier and of the rover, the two types it was made for."""

    name: str
    carrier_cell: Cell
    rover_cell: Cell
    carrier_type: str
    rover_type: str


class Cause(StrEnum):
    """What can ask for a new plan."""

    START = "start"  # of the mission
    FAILED = "failed"  # robots could not do what they were told
    LOST = "lost"  # robots failed for good
    GONE = "gone"  # targets of the plan
    NEW = "new"  # targets that the plan does not know
    ROBOT_FREE = "robot free"  # it has nothing left to do while there is a target without a robot
    WAY_BLOCKED = "way blocked"  # of robots
    CARRIED_OUT = "plan carried out"
    OVERTAKEN = "plan overtaken"  # by what happened while it was being made
    EXPLORED = "explored"  # all there is to see has been seen
    CALLED_BACK = "called back"  # the time left is only just enough to get back
    OTHER = "other"  # a text in a log that is none of ours


@dataclass(frozen=True, slots=True)
class Trigger:
    """A piece of news that asked for a new plan, and the robots or targets that it is about."""

    cause: Cause
    names: tuple[str, ...] = ()


Triggers = tuple[Trigger, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """A new plan is followed from now on.

    `trigger` says which news asked for it; the actions' times are absolute mission times.
    """

    t_ms: int
    revision: int
    trigger: Triggers
    targets: tuple[MapTarget, ...]
    meetings: tuple[MapMeeting, ...]
    actions: tuple[Action, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionStarted:
    """An action of plan `revision` starts; `cell` is where its (first) robot has to be at its end."""

    t_ms: int
    revision: int
    action: Action
    cell: Cell


class ActionEnd(StrEnum):
    """Why an action is over."""

    DONE = "done"
    SUPERSEDED = "superseded"  # the next plan wants something else
    BLOCKED = "blocked"  # its route is no longer passable
    FAILED = "failed"  # its robots could not do it
    LOST = "lost"  # a robot in it was lost


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionEnded:
    """An action is over; one whose way is blocked from the beginning ends without having started."""

    t_ms: int
    revision: int
    action: Action
    end: ActionEnd


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLost:
    """A robot failed for good; it stays where it is."""

    t_ms: int
    robot: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Remaining:
    """One frontier left at the end and why it was not explored."""

    cell: Cell
    frontier_cells: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionEnded:
    """Last event: the stop report and the metrics (definitions: docs/command-line.md).

    `exploration_ms` is when the last target was gone, or None if that never happened.
    """

    t_ms: int
    status: Status
    reason: str
    exploration_ms: int | None
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

    @property
    def coverage(self) -> float:
        """Explored share of the reachable area, 0 to 1."""
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
    | MissionEnded
)

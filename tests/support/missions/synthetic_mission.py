"""A small synthetic mission with a known log, for tests of readers of mission logs.

The map has 60 x 40 cells of 0.25 m: a hall of floor on the left (x below 30) and, through a gap in the wall at
x = 30, y = 20, a yard of rough ground on the right where only rovers can drive. One carrier (1 m/s) drives up to the
gap, sets down the first of its two rovers (0.5 m/s), which looks around in the yard and is picked up again.

=========  ======================================================================
0.000 s    carrier1 stands at (6, 20), both rovers aboard; plan 1
0.000 s    carrier1 sets out for (26, 20), 20 cells of 0.25 m: there at 5.000 s
5.001 s    carrier1 sets down rover1_1 at (28, 20), until 10.001 s
10.002 s   rover1_1 explores: 10 cells east (38, 20), there at 15.002 s
12.502 s   it has come to (33, 20); plan 2 supersedes the exploration
12.503 s   it goes on to (38, 24) by 1 cell east and 4 cells north-east, blocked at 13.003 s at (34, 20)
13.004 s   it drives back to (28, 20), 6 cells west: there at 16.004 s
16.005 s   docks until 26.005 s
26.005 s   the mission ends, stalled, with two frontiers left
=========  ======================================================================
"""

import numpy as np

from marsupial.formats.loglines import read_triggers
from marsupial.model import ActionEnded, ActionStarted, DriveStarted, MissionEnded, MissionEvent, MissionStarted
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Cell, CellArray
from marsupial.model.mission import (
    ActionEnd,
    DriveEnded,
    MapMeeting,
    MapTarget,
    PlacedRobot,
    Planned,
    Remaining,
    Revealed,
    Status,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import default_types
from marsupial.model.scenario import Goal

WIDTH, HEIGHT, RESOLUTION_M = 60, 40, 0.25

T1 = MapTarget(name="t1", cell=Cell(42, 20), explorers=("rover",), reveal_m2=12.5, frontier_cells=9)
T2 = MapTarget(name="t2", cell=Cell(38, 24), explorers=("rover",), reveal_m2=4.0, frontier_cells=5)
M1 = MapMeeting(
    name="m1", carrier_cell=Cell(26, 20), rover_cell=Cell(28, 20), carrier_type="carrier", rover_type="rover"
)


def truth() -> CellArray:
    cells = np.full((HEIGHT, WIDTH), FLOOR, dtype=np.uint8)
    cells[:, 31:] = ROUGH
    cells[:, 30] = cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = OBSTACLE
    cells[19:22, 30] = FLOOR
    return cells


class Scribe:
    """Builds the events of a mission, call by call."""

    def __init__(self) -> None:
        self.events: list[MissionEvent] = []
        self._known = np.full((HEIGHT, WIDTH), UNKNOWN, dtype=np.uint8)

    def look(self, t_ms: int, robot: str, cell: Cell, reach: int) -> None:
        """Reveal the square of cells at most `reach` away."""
        fresh = np.zeros((HEIGHT, WIDTH), dtype=bool)
        fresh[max(cell.y - reach, 0) : cell.y + reach + 1, max(cell.x - reach, 0) : cell.x + reach + 1] = True
        fresh &= self._known == UNKNOWN
        self._known[fresh] = truth()[fresh]
        runs: list[int] = []
        for index in np.flatnonzero(fresh):
            code = int(self._known.flat[index])
            if runs and runs[-3] + runs[-2] == index and runs[-1] == code:
                runs[-2] += 1
            else:
                runs += [int(index), 1, code]
        if runs:
            self.events.append(Revealed(t_ms=t_ms, robot=robot, runs=tuple(runs)))

    def drive(self, t_ms: int, robot: str, cell: Cell, steps: str, end_ms: int, end: Cell) -> None:
        """Drive, looking around at every cell of a straight way."""
        self.events.append(DriveStarted(t_ms=t_ms, robot=robot, cell=cell, steps=steps))
        cells = max(abs(end.x - cell.x), abs(end.y - cell.y))
        for k in range(1, cells + 1):
            here = Cell(cell.x + (end.x - cell.x) * k // cells, cell.y + (end.y - cell.y) * k // cells)
            self.look(t_ms + (end_ms - t_ms) * k // cells, robot, here, 12 if robot.startswith("carrier") else 8)
        self.events.append(DriveEnded(t_ms=end_ms, robot=robot, cell=end))

    def start(self, revision: int, action: Action, cell: Cell) -> None:
        self.events.append(ActionStarted(t_ms=action.start_ms, revision=revision, action=action, cell=cell))

    def end(self, t_ms: int, revision: int, action: Action, end: ActionEnd = ActionEnd.DONE) -> None:
        self.events.append(ActionEnded(t_ms=t_ms, revision=revision, action=action, end=end))


def mission_started() -> MissionStarted:
    return MissionStarted(
        t_ms=0,
        scenario="two halves",
        strategy="temporal",
        planner="greedy",
        seed=1,
        width=WIDTH,
        height=HEIGHT,
        resolution_m=RESOLUTION_M,
        origin_m=(-1.5, 2.0, 0.0),
        terrains=TERRAINS,
        types=default_types(2),
        robots=(
            PlacedRobot(name="carrier1", type="carrier", cell=Cell(6, 20)),
            PlacedRobot(name="rover1_1", type="rover", carrier="carrier1"),
            PlacedRobot(name="rover1_2", type="rover", carrier="carrier1"),
        ),
        goal=Goal(),
    )


def _act(name: ActionName, start_ms: int, duration_ms: int, robot: str, place: str, **more: str) -> Action:
    return Action(name=name, start_ms=start_ms, duration_ms=duration_ms, robot=robot, place=place, **more)


MOVE = _act(ActionName.MOVE, 0, 5_000, "carrier1", "m1", origin="s_carrier1")
UNDOCK = _act(ActionName.UNDOCK, 5_001, 5_000, "rover1_1", "m1", carrier="carrier1")
EXPLORE = _act(ActionName.EXPLORE, 10_002, 7_000, "rover1_1", "t1", origin="m1")
EXPLORE_2 = _act(ActionName.EXPLORE, 12_503, 3_328, "rover1_1", "t2", origin="s_rover1_1")
RETURN = _act(ActionName.MOVE, 13_004, 3_000, "rover1_1", "m1", origin="t2")
DOCK = _act(ActionName.DOCK, 16_005, 10_000, "rover1_1", "m1", carrier="carrier1")


def mission_ended() -> MissionEnded:
    return MissionEnded(
        t_ms=26_005,
        status=Status.STALLED,
        reason="2 frontiers are left that nobody can reach",
        exploration_ms=None,
        explored_area_m2=90.25,
        reachable_area_m2=132.0,
        distance_m=(("carrier1", 5.0), ("rover1_1", 4.25), ("rover1_2", 0.0)),
        energy_j=(("carrier1", 820.1), ("rover1_1", 130.0), ("rover1_2", 104.0)),
        deployments=1,
        retrievals=1,
        replans=2,
        plans_valid=2,
        plans_invalid=0,
        aboard=("rover1_1", "rover1_2"),
        remaining=(
            Remaining(cell=Cell(42, 16), frontier_cells=17, reason="out of energy: <no way back> & none left"),
            Remaining(cell=Cell(5, 32), frontier_cells=4, reason="too narrow for every type"),
        ),
    )


def synthetic_mission() -> tuple[MissionEvent, ...]:
    scribe = Scribe()
    events = scribe.events
    events.append(mission_started())
    scribe.look(0, "carrier1", Cell(6, 20), 12)
    plan = (MOVE, UNDOCK, EXPLORE)
    events.append(
        Planned(t_ms=0, revision=1, trigger=read_triggers("start"), targets=(T1,), meetings=(M1,), actions=plan)
    )
    scribe.start(1, MOVE, Cell(26, 20))
    scribe.drive(0, "carrier1", Cell(6, 20), "0" * 20, 5_000, Cell(26, 20))
    scribe.end(5_000, 1, MOVE)
    scribe.start(1, UNDOCK, Cell(28, 20))
    scribe.end(10_001, 1, UNDOCK)
    scribe.look(10_001, "rover1_1", Cell(28, 20), 8)
    scribe.start(1, EXPLORE, Cell(42, 20))
    scribe.drive(10_002, "rover1_1", Cell(28, 20), "0" * 10, 12_502, Cell(33, 20))
    scribe.end(12_502, 1, EXPLORE, ActionEnd.SUPERSEDED)
    plan = (EXPLORE_2, RETURN, DOCK)
    events.append(
        Planned(t_ms=12_502, revision=2, trigger=read_triggers("t1 gone"), targets=(T2,), meetings=(M1,), actions=plan)
    )
    scribe.start(2, EXPLORE_2, Cell(38, 24))
    scribe.drive(12_503, "rover1_1", Cell(33, 20), "01111", 13_003, Cell(34, 20))
    scribe.end(13_003, 2, EXPLORE_2, ActionEnd.BLOCKED)
    scribe.start(2, RETURN, Cell(28, 20))
    scribe.drive(13_004, "rover1_1", Cell(34, 20), "444444", 16_004, Cell(28, 20))
    scribe.end(16_004, 2, RETURN)
    scribe.start(2, DOCK, Cell(28, 20))
    scribe.end(26_005, 2, DOCK)
    events.append(mission_ended())
    return tuple(events)

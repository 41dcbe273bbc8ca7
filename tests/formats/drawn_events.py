"""Draw events of a mission, for round trips through its log."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from support.missions.synthetic_mission import mission_started

from marsupial.arrays import Bytes
from marsupial.formats.loglines import read_triggers
from marsupial.model import mission as m
from marsupial.model.grid import UNKNOWN, Cell, Terrain
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import EnergyModel, RobotType, Role
from marsupial.model.runs import runs_of
from marsupial.model.scenario import Goal

START = mission_started()


def painted(seen: Mapping[int, int]) -> Bytes:
    """Return the cells of the map in one row, with these terrain codes by number and all others unknown."""
    cells = np.full(START.width * START.height, UNKNOWN, dtype=np.uint8)
    cells[list(seen)] = list(seen.values())
    return cells


cells = st.builds(Cell, st.integers(0, START.width - 1), st.integers(0, START.height - 1))
times = st.integers(0, 10**15)
numbers = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(max_size=8)
robots = st.sampled_from([robot.name for robot in START.robots])
rovers = st.sampled_from(["rover1_1", "rover1_2"])
driving = st.sampled_from([ActionName.MOVE, ActionName.EXPLORE])
docking = st.sampled_from([ActionName.DOCK, ActionName.UNDOCK])
action_times = {"start_ms": times, "duration_ms": times, "place": names}
actions = st.one_of(
    st.builds(Action, name=driving, robot=robots, origin=names, carrier=st.none(), **action_times),
    st.builds(Action, name=docking, robot=rovers, origin=st.none(), carrier=st.just("carrier1"), **action_times),
)
targets = st.builds(
    m.MapTarget,
    name=names,
    cell=cells,
    explorers=st.lists(names, max_size=2).map(tuple),
    reveal_m2=numbers,
    frontier_cells=times,
)
meetings = st.builds(
    m.MapMeeting, name=names, carrier_cell=cells, rover_cell=cells, carrier_type=names, rover_type=names
)
codes = st.sampled_from([terrain.code for terrain in START.terrains])
runs = st.dictionaries(st.integers(0, START.width * START.height - 1), codes, max_size=80).map(
    lambda seen: runs_of(np.array(sorted(seen), dtype=np.int64), painted(seen))
)
pairs = st.lists(st.tuples(names, numbers), max_size=3).map(tuple)
joules = st.floats(min_value=0, max_value=1e9)
metres = st.floats(min_value=-1e15, max_value=1e15)
types = st.builds(
    RobotType,
    name=st.just("carrier"),
    role=st.just(Role.CARRIER),
    speed_mps=st.floats(min_value=0.01, max_value=100),
    sensor_range_m=st.floats(min_value=0.01, max_value=10_000),
    radius_m=st.floats(min_value=0, max_value=100),
    terrains=st.frozensets(st.integers(0, 254), max_size=5),
    capacity=st.integers(0, 10**6),
    dock_ms=st.integers(0, 10**12),
    undock_ms=st.integers(0, 10**12),
    sensor_angle_deg=st.none() | st.floats(min_value=1, max_value=360),
    energy=st.builds(
        EnergyModel,
        idle_w=joules,
        drive_w=joules,
        metre_j=joules,
        stop_j=joules,
        turn_j=st.tuples(joules, joules, joules, joules),
    ),
)
starts = st.builds(
    lambda kind, terrains, goal, resolution_m, origin_m, name: replace(
        START,
        scenario=name,
        types=(kind,),
        terrains=terrains,
        goal=goal,
        resolution_m=resolution_m,
        origin_m=origin_m,
        robots=(m.PlacedRobot(name="carrier1", type="carrier", cell=Cell(0, 0)),),
    ),
    types,
    st.lists(st.builds(Terrain, code=st.integers(0, 254), name=names, blocks_sight=st.booleans())).map(tuple),
    st.builds(Goal, recover_rovers=st.booleans(), return_home=st.booleans()),
    st.floats(min_value=1e-3, max_value=1e3),
    st.tuples(metres, metres, metres),
    names,
)
later_events = st.one_of(
    st.builds(m.Revealed, t_ms=times, robot=robots, runs=runs),
    st.builds(
        m.DriveStarted, t_ms=times, robot=robots, cell=st.just(Cell(30, 20)), steps=st.text("01234567", max_size=15)
    ),
    st.builds(m.DriveEnded, t_ms=times, robot=robots, cell=cells),
    st.builds(
        m.Planned,
        t_ms=times,
        revision=times,
        trigger=names.map(read_triggers),
        targets=st.lists(targets, max_size=2).map(tuple),
        meetings=st.lists(meetings, max_size=2).map(tuple),
        actions=st.lists(actions, max_size=2).map(tuple),
        guess=st.none()
        | st.builds(
            m.GuessedGround, corner=cells, side=st.integers(1, 99), halls=st.just(()), rooms=st.tuples(cells, cells)
        ),
        compared=st.lists(st.tuples(names, times, times), max_size=2).map(tuple),
        instead=st.lists(st.tuples(robots, st.tuples(names, names)), max_size=2).map(tuple),
    ),
    st.builds(m.ActionStarted, t_ms=times, revision=times, action=actions, cell=cells),
    st.builds(m.ActionEnded, t_ms=times, revision=times, action=actions, end=st.sampled_from(m.ActionEnd)),
    st.builds(m.RobotLost, t_ms=times, robot=robots, reason=names),
    st.builds(
        m.MissionEnded,
        t_ms=times,
        status=st.sampled_from(m.Status),
        reason=names,
        exploration_ms=st.none() | times,
        explored_area_m2=numbers,
        reachable_area_m2=numbers,
        distance_m=pairs,
        energy_j=pairs,
        deployments=times,
        retrievals=times,
        replans=times,
        plans_valid=times,
        plans_invalid=times,
        aboard=st.lists(names, max_size=3).map(tuple),
        remaining=st.lists(st.builds(m.Remaining, cell=cells, frontier_cells=times, reason=names), max_size=3).map(
            tuple
        ),
    ),
)

"""A lower bound on the makespan: the target that takes longest even if all robots were there for it alone, or the work.

Each robot's earliest time at each place is computed without the other robots' actions: a rover finds a carrier of any
type at any meeting from the moment the first one could be there. Where rovers have to end aboard and carriers at home,
the way there from the target counts as well. No triangle inequality is assumed of the travel tables.
"""

import numpy as np

from marsupial.arrays import Ints
from marsupial.model.plan import EPSILON_MS
from marsupial.native import native
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.local_search.workload import work_bound_ms
from marsupial.planning.schedule.costs import NEVER


def makespan_bound_ms(data: ProblemData) -> int:
    """Return a time that no plan ends before; 0 where nothing has to be done. The situation has to have a plan."""
    carriers = {int(c): _alone(data, int(c)) for c in data.members(col.CARRIERS)}
    home = _to_home(data)
    where = {c: (int(data.robots[c, col.AT]), int(data.robots[c, col.HOME])) for c in carriers}
    ends = [int(carriers[c][end]) for c, (at, end) in where.items() if end >= 0 and at != end]
    reached = np.full(data.leg.shape[1], NEVER, dtype=np.int64)
    for c, times in carriers.items():
        np.minimum(reached, times + home[c], out=reached)
    boarding = _boarding(data, carriers)
    known: dict[tuple[int, ...], tuple[Ints, int]] = {}
    for v in map(int, data.members(col.ROVERS)):
        alike = tuple(int(value) for value in data.robots[v, : col.READY + 1])
        if alike not in known:
            known[alike] = _rover_ends(data, v, carriers, boarding, home)
            np.minimum(reached, known[alike][0], out=reached)
        ends.append(known[alike][1])
    ends += [int(reached[t]) for t in data.members(col.TARGETS)]
    return max(0, max(*ends, work_bound_ms(data), 0) - EPSILON_MS)


def _alone(data: ProblemData, robot: int) -> Ints:
    """Return per place when a robot could be ready there without help."""
    times = np.full(data.leg.shape[1], NEVER, dtype=np.int64)
    times[data.robots[robot, col.AT]] = data.robots[robot, col.READY]
    relax(times, data.leg[data.robots[robot, col.TYPE]])
    return times


def _to_home(data: ProblemData) -> dict[int, Ints]:
    """Return, per carrier, from each place the time to its home, 0 where it has none."""
    away: dict[tuple[int, int], Ints] = {}
    found = {}
    for c in data.members(col.CARRIERS):
        kind, end = int(data.robots[c, col.TYPE]), int(data.robots[c, col.HOME])
        if (kind, end) not in away:
            times = np.full(data.leg.shape[1], NEVER if end >= 0 else 0, dtype=np.int64)
            times[end] = 0
            relax(times, np.ascontiguousarray(data.leg[kind].T))
            away[kind, end] = times
        found[int(c)] = away[kind, end]
    return found


def _boarding(data: ProblemData, carriers: dict[int, Ints]) -> dict[int, Ints]:
    """Return, per type, when a carrier with places could first be at each meeting; elsewhere `NEVER`."""
    first: dict[int, Ints] = {}
    meetings = data.members(col.MEETINGS)
    for c in (c for c in carriers if data.robots[c, col.CAPACITY] > 0):
        times = first.setdefault(int(data.robots[c, col.TYPE]), np.full(data.leg.shape[1], NEVER, dtype=np.int64))
        times[meetings] = np.minimum(times[meetings], carriers[c][meetings])
    return first


def _rover_ends(
    data: ProblemData, rover: int, carriers: dict[int, Ints], boarding: dict[int, Ints], home: dict[int, Ints]
) -> tuple[Ints, int]:
    """Return per place when a rover that goes there would be done, and when it would be done if it goes nowhere."""
    ground = np.full(data.leg.shape[1], NEVER, dtype=np.int64)
    fitting = {c: data.fits(rover, c) for c in carriers}
    kinds = {int(data.robots[c, col.TYPE]) for c in carriers if fitting[c]}
    boarding = {kind: times for kind, times in boarding.items() if kind in kinds}
    carried = {kind: ground.copy() for kind in boarding}
    on = int(data.robots[rover, col.ABOARD])
    if on < 0:
        ground[data.robots[rover, col.AT]] = data.robots[rover, col.READY]
    else:
        carried[int(data.robots[on, col.TYPE])] = carriers[on].copy()
    _lower(data, rover, ground, carried, boarding)
    if not data.recover:
        return ground, 0
    legs_home = [home[c] for c in carriers if fitting[c]]
    leave, meetings = np.full(data.leg.shape[1], NEVER, dtype=np.int64), data.members(col.MEETINGS)
    if legs_home:
        leave[meetings] = np.min(legs_home, axis=0)[meetings] + data.robots[rover, col.DOCKING]
    done = (int((np.maximum(ground, first) + leave).min(initial=NEVER)) for first in boarding.values())
    stay = 0 if on >= 0 else min(done, default=0)
    relax(leave, np.ascontiguousarray(data.leg[data.robots[rover, col.TYPE]].T))
    return ground + leave, stay


def _lower(data: ProblemData, rover: int, ground: Ints, carried: dict[int, Ints], boarding: dict[int, Ints]) -> None:
    """Lower the times on the ground and aboard until they agree with each other."""
    meetings = data.members(col.MEETINGS)
    while True:
        before = ground.copy()
        for kind, times in carried.items():
            if kind in boarding:
                docked = np.maximum(ground, boarding[kind]) + data.robots[rover, col.DOCKING]
                np.minimum(times, docked, out=times)
            relax(times, data.leg[kind])
            ground[meetings] = np.minimum(ground[meetings], times[meetings] + data.robots[rover, col.UNDOCKING])
        relax(ground, data.leg[data.robots[rover, col.TYPE]])
        if np.array_equal(before, ground):
            return


@native
def relax(times: Ints, leg: Ints) -> None:
    """Lower int64 `times` (places,) to what driving on from any place allows."""
    better = True
    while better:
        better = False
        for i in range(len(times)):
            if times[i] >= NEVER:
                continue
            for j in range(len(times)):
                if times[i] + leg[i, j] < times[j]:
                    times[j] = times[i] + leg[i, j]
                    better = True

"""A lower bound on the makespan: the target that takes longest even if everybody were there for it alone.

Each robot's earliest time at each place is computed with what the others do left out: a rover finds a carrier of any
type at any meeting from the moment the first one could be there. Where rovers have to end aboard and carriers at home,
the way there from the target counts as well. No triangle inequality is assumed of the travel tables.
"""

from __future__ import annotations

import numpy as np

from marsupial.model.plan import EPSILON_MS
from marsupial.native import native
from marsupial.planning.local_search.encoding import (
    ABOARD,
    AT,
    CAPACITY,
    CARRIERS,
    DOCKING,
    HOME,
    MEETINGS,
    NEVER,
    READY,
    ROVERS,
    TARGETS,
    TYPE,
    UNDOCKING,
    Ints,
    Task,
)


def makespan_bound_ms(task: Task) -> int:
    """Return a time that no plan ends before; 0 where nothing has to be done. The situation has to have a plan."""
    carriers = {int(c): _alone(task, int(c)) for c in task.members(CARRIERS)}
    home = _to_home(task)
    ends = [
        int(carriers[c][task.robots[c, HOME]])
        for c in carriers
        if task.robots[c, HOME] >= 0 and task.robots[c, AT] != task.robots[c, HOME]
    ]
    reached = np.full(task.leg.shape[1], NEVER, dtype=np.int64)
    for c, times in carriers.items():
        np.minimum(reached, times + home[c], out=reached)
    boarding = _boarding(task, carriers)
    known: dict[tuple[int, ...], tuple[Ints, int]] = {}
    for v in map(int, task.members(ROVERS)):
        alike = tuple(int(value) for value in task.robots[v, : READY + 1])
        if alike not in known:
            known[alike] = _rover_ends(task, v, carriers, boarding, home)
            np.minimum(reached, known[alike][0], out=reached)
        ends.append(known[alike][1])
    ends += [int(reached[t]) for t in task.members(TARGETS)]
    return max(0, max(ends, default=0) - EPSILON_MS)


def _alone(task: Task, robot: int) -> Ints:
    """Return per place when a robot could be ready there without help."""
    times = np.full(task.leg.shape[1], NEVER, dtype=np.int64)
    times[task.robots[robot, AT]] = task.robots[robot, READY]
    relax(times, task.leg[task.robots[robot, TYPE]])
    return times


def _to_home(task: Task) -> dict[int, Ints]:
    """Return, per carrier, from each place the time to its home, 0 where it has none."""
    away: dict[tuple[int, int], Ints] = {}
    for c in task.members(CARRIERS):
        key = int(task.robots[c, TYPE]), int(task.robots[c, HOME])
        if key not in away:
            times = np.full(task.leg.shape[1], NEVER if key[1] >= 0 else 0, dtype=np.int64)
            times[key[1]] = 0
            relax(times, np.ascontiguousarray(task.leg[key[0]].T))
            away[key] = times
    return {int(c): away[int(task.robots[c, TYPE]), int(task.robots[c, HOME])] for c in task.members(CARRIERS)}


def _boarding(task: Task, carriers: dict[int, Ints]) -> dict[int, Ints]:
    """Return, per type of carrier, from when one that can carry could be at each meeting; elsewhere `NEVER`."""
    first: dict[int, Ints] = {}
    for c in (c for c in carriers if task.robots[c, CAPACITY] > 0):
        times = first.setdefault(int(task.robots[c, TYPE]), np.full(task.leg.shape[1], NEVER, dtype=np.int64))
        times[task.members(MEETINGS)] = np.minimum(times[task.members(MEETINGS)], carriers[c][task.members(MEETINGS)])
    return first


def _rover_ends(
    task: Task, rover: int, carriers: dict[int, Ints], boarding: dict[int, Ints], home: dict[int, Ints]
) -> tuple[Ints, int]:
    """Return per place when a rover that goes there would be done, and when it would be done if it goes nowhere."""
    ground = np.full(task.leg.shape[1], NEVER, dtype=np.int64)
    riding = {kind: ground.copy() for kind in boarding}
    on = int(task.robots[rover, ABOARD])
    if on < 0:
        ground[task.robots[rover, AT]] = task.robots[rover, READY]
    else:
        riding[int(task.robots[on, TYPE])] = carriers[on].copy()
    _ride(task, rover, ground, riding, boarding)
    if not task.recover:
        return ground, 0
    legs_home = [home[c] for c in carriers if task.robots[c, CAPACITY] > 0]
    leave = np.full(task.leg.shape[1], NEVER, dtype=np.int64)
    if legs_home:
        leave[task.members(MEETINGS)] = np.min(legs_home, axis=0)[task.members(MEETINGS)] + task.robots[rover, DOCKING]
    stay = 0 if on >= 0 else min((_least(np.maximum(ground, first) + leave) for first in boarding.values()), default=0)
    relax(leave, np.ascontiguousarray(task.leg[task.robots[rover, TYPE]].T))
    return ground + leave, stay


def _least(times: Ints) -> int:
    return int(times.min(initial=NEVER))


def _ride(task: Task, rover: int, ground: Ints, riding: dict[int, Ints], boarding: dict[int, Ints]) -> None:
    """Lower the times on the ground and aboard until they agree with each other."""
    while True:
        before = ground.copy()
        for kind, times in riding.items():
            if kind in boarding:
                docked = np.maximum(ground, boarding[kind]) + task.robots[rover, DOCKING]
                np.minimum(times, docked, out=times)
            relax(times, task.leg[kind])
            ground[task.members(MEETINGS)] = np.minimum(
                ground[task.members(MEETINGS)], times[task.members(MEETINGS)] + task.robots[rover, UNDOCKING]
            )
        relax(ground, task.leg[task.robots[rover, TYPE]])
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

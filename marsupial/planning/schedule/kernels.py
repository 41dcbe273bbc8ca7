"""The compiled part of list scheduling: transports of all rovers on all carriers, and the soonest insertions, in ms."""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Flags, Ints
from marsupial.native import native
from marsupial.planning.schedule.costs import NEVER


class RobotArrays(NamedTuple):
    """The properties of robots that do not change while a plan is made."""

    # carriers, rovers: the numbers of the robots of each role
    carriers: Ints
    rovers: Ints
    kinds: Ints  # (robots,): the number of each robot's type
    groups: Ints  # (robots,): the group of each rover that takes the same seats, as in `Arrivals`
    docking: Ints  # (robots,): ms from beginning to dock to being ready again
    set_down: Ints  # (robots, meetings): the same for an undock, `NEVER` where the robot can't stand


@native
def renew_landed(
    robots: RobotArrays, landed: Ints, stale: Flags, aboard: Ints, arrive: Ints, boarding: Ints, transport: Ints
) -> None:
    """Recompute (1 + carriers, rovers, meetings) `landed`, see `Insertions`, where robots are `stale` (robots,).

    `aboard`, `arrive` and `boarding` are those of `Arrivals`, `transport` is that of `Costs`.
    """
    n_meetings = arrive.shape[1]
    carriers, rovers = robots.carriers, robots.rovers
    for k in range(len(rovers)):
        v, on = rovers[k], aboard[k]
        if stale[v] or (on >= 0 and stale[carriers[on]]):
            for m in range(n_meetings):
                landed[0, k, m] = min(NEVER, arrive[carriers[on], m] + robots.set_down[v, m]) if on >= 0 else NEVER
    for c in range(len(carriers)):
        between = transport[robots.kinds[carriers[c]]]
        for k in range(len(rovers)):
            v = rovers[k]
            if not (stale[v] or stale[carriers[c]]):
                continue
            row = landed[1 + c, k]
            row[:] = NEVER
            if aboard[k] >= 0:
                continue
            group = robots.groups[v]
            for pickup in range(n_meetings):
                docked = max(boarding[c, group, pickup], arrive[v, pickup]) + robots.docking[v]
                if docked < NEVER:
                    for m in range(n_meetings):
                        row[m] = min(row[m], docked + between[pickup, m] + robots.set_down[v, m])


@native
def soonest(
    alone: Ints, landed: Ints, aboard: Ints, rover_kinds: Ints, sortie: Ints, left: Flags, done: Ints, insertions: Ints
) -> None:
    """Fill in the soonest time to explore each target left and its insertion, the first of equal ones.

    An insertion is a row of `alone`, or from there on a row of `landed`, slab after slab (`Insertions`). `aboard` and
    `rover_kinds` (rovers,) have the carrier that each rover is aboard, or -1, and the number of its type. `done` and
    `insertions` (targets,) receive `NEVER` and -1 where there is none.
    """
    done[:] = NEVER
    insertions[:] = -1
    for i in range(alone.shape[0]):
        for t in range(alone.shape[1]):
            if left[t] and alone[i, t] < done[t]:
                done[t], insertions[t] = alone[i, t], i
    slabs, rovers, meetings = landed.shape
    ready = np.full((sortie.shape[0], meetings), NEVER)
    first = np.full((sortie.shape[0], meetings), -1)
    for s in range(slabs):
        for k in range(rovers):
            if (s == 0) != (aboard[k] >= 0):
                continue
            kind = rover_kinds[k]
            # Rovers of one type are alike from the meeting on: only the soonest there counts.
            for m in range(meetings):
                if landed[s, k, m] < ready[kind, m]:
                    ready[kind, m], first[kind, m] = landed[s, k, m], len(alone) + s * rovers + k
    for kind in range(sortie.shape[0]):
        for m in range(meetings):
            if ready[kind, m] >= NEVER:
                continue
            for t in range(alone.shape[1]):
                end = ready[kind, m] + sortie[kind, m, t]
                if left[t] and (end < done[t] or (end == done[t] and first[kind, m] < insertions[t])):
                    done[t], insertions[t] = end, first[kind, m]


@native
def soonest_aboard(ready: Ints, carriers: Ints, docking: Ints, aboard: Ints) -> None:
    """Fill in when each rover could be aboard each carrier (rovers, carriers) at the soonest, `NEVER` if never.

    `ready` (rovers, meetings) and `carriers` (meetings, carriers) are when both are there, `docking` (rovers,) in ms.
    """
    aboard[:] = NEVER
    for v in range(ready.shape[0]):
        for m in range(ready.shape[1]):
            if ready[v, m] < NEVER:
                for c in range(aboard.shape[1]):
                    aboard[v, c] = min(aboard[v, c], max(ready[v, m], carriers[m, c]) + docking[v])

"""The compiled part of list scheduling: rides of every rover on every carrier, and what is soonest."""

from __future__ import annotations

from typing import Any

import numpy as np

from marsupial.native import native
from marsupial.planning.list_scheduling.costs import NEVER


@native
def mend_landed(
    landed: Any,
    stale: Any,
    carriers: Any,
    rovers: Any,
    aboard: Any,
    arrive: Any,
    boarding: Any,
    ride: Any,
    docking: Any,
    undocking: Any,
    kinds: Any,
) -> None:
    """Mend `landed` where robots are `stale`; arrays as in `Arrivals`, `Costs` and `Ways`."""
    n_meetings = arrive.shape[1]
    for k in range(len(rovers)):
        v, on = rovers[k], aboard[k]
        if stale[v] or (on >= 0 and stale[carriers[on]]):
            for m in range(n_meetings):
                landed[0, k, m] = min(NEVER, arrive[carriers[on], m] + undocking[v]) if on >= 0 else NEVER
    for c in range(len(carriers)):
        between = ride[kinds[carriers[c]]]
        for k in range(len(rovers)):
            v = rovers[k]
            if not (stale[v] or stale[carriers[c]]):
                continue
            row = landed[1 + c, k]
            row[:] = NEVER
            if aboard[k] >= 0:
                continue
            for pickup in range(n_meetings):
                docked = max(boarding[c, pickup], arrive[v, pickup]) + docking[v] + undocking[v]
                if docked < NEVER:
                    for m in range(n_meetings):
                        row[m] = min(row[m], docked + between[pickup, m])


@native
def soonest(
    alone: Any, landed: Any, aboard: Any, rover_kinds: Any, outing: Any, left: Any, done: Any, ways: Any
) -> None:
    """Enter in `done` when each target that is `left` would be explored soonest, and in `ways` how.

    A way is a row of `alone`, or from there on a row of `landed`, slab after slab; among equals the first.
    """
    done[:] = NEVER
    ways[:] = -1
    for i in range(alone.shape[0]):
        for t in range(alone.shape[1]):
            if left[t] and alone[i, t] < done[t]:
                done[t], ways[t] = alone[i, t], i
    slabs, rovers, meetings = landed.shape
    ready = np.full((outing.shape[0], meetings), NEVER)
    first = np.full((outing.shape[0], meetings), -1)
    for s in range(slabs):
        for k in range(rovers):
            if (s == 0) != (aboard[k] >= 0):
                continue
            kind = rover_kinds[k]
            for m in range(meetings):
                if landed[s, k, m] < ready[kind, m]:
                    ready[kind, m], first[kind, m] = landed[s, k, m], len(alone) + s * rovers + k
    for kind in range(outing.shape[0]):
        for m in range(meetings):
            if ready[kind, m] >= NEVER:
                continue
            for t in range(alone.shape[1]):
                end = ready[kind, m] + outing[kind, m, t]
                if left[t] and (end < done[t] or (end == done[t] and first[kind, m] < ways[t])):
                    done[t], ways[t] = end, first[kind, m]


@native
def soonest_aboard(ready: Any, carriers: Any, docking: Any, aboard: Any) -> None:
    """Enter in `aboard` (rovers, carriers) when each rover could be aboard each carrier soonest, `NEVER` if not.

    `ready` (rovers, meetings) and `carriers` (meetings, carriers) say when they are ready for that, `docking` (rovers,)
    how long it takes.
    """
    aboard[:] = NEVER
    for v in range(ready.shape[0]):
        for m in range(ready.shape[1]):
            if ready[v, m] < NEVER:
                for c in range(aboard.shape[1]):
                    aboard[v, c] = min(aboard[v, c], max(ready[v, m], carriers[m, c]) + docking[v])

"""Put actions on the clock: as early as their robots allow, in integer milliseconds.

Engines leave gaps (Aries) or let actions touch (Tamer) and have clocks of their own. What counts of their plans is the
order in which each robot does its actions; given that, starting each action as soon as all its robots are free gives
the shortest plan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from marsupial.model.plan import EPSILON_MS, Action, Plan
from marsupial.model.situation import Situation
from marsupial.planning.list_scheduling.timeline import duration_ms, free_at_ms


def retime(situation: Situation, actions: Iterable[Action]) -> Plan:
    """Return the plan that does `actions` in this order per robot, each as early as possible.

    Only their names and places are used. An action without a path keeps its duration, for the checker to refuse.
    """
    ready = {robot.name: free_at_ms(situation, robot) for robot in situation.robots}
    timed: list[Action] = []
    for action in actions:
        start = max(ready[robot] for robot in action.robots)
        took = duration_ms(situation, action.name, action.robot, action.place, action.origin)
        action = replace(action, start_ms=start, duration_ms=action.duration_ms if took is None else took)
        timed.append(action)
        ready.update(dict.fromkeys(action.robots, action.end_ms + EPSILON_MS))
    return Plan.of(timed)

"""Plans from what a search has found: docks and undocks, and the sets of targets explored before and after them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import Plan, Situation
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.tables import Tables
from marsupial.planning.branch_and_bound.tours import shortest_tours
from marsupial.planning.list_scheduling.costs import NEVER
from marsupial.planning.list_scheduling.recovery import go_home
from marsupial.planning.list_scheduling.timeline import Timeline
from marsupial.planning.local_search.encoding import ProblemData


def plan_found(situation: Situation, data: ProblemData, tables: Tables, events: Ints, shares: Ints) -> Plan:
    """Return the plan of docks and undocks (n, 7) and of the sets that the robots explore after them."""
    tour = _TourTimeline(situation, data, tables)
    for event in events:
        rover, carrier = int(event[col.ROVER]), int(event[col.CARRIER])
        meeting = int(tables.bases[tables.meetings[event[col.AT]]])
        tour.go(carrier, int(event[col.OWN]), meeting)
        name = situation.places[meeting]
        if event[col.DOWN]:
            tour.timeline.undock(tour.name(rover), name)
        else:
            tour.go(rover, int(event[col.BROUGHT]), meeting)
            tour.timeline.dock(tour.name(rover), tour.name(carrier), name)
    for robot, share in enumerate(shares):
        home = situation.robots[tables.robots[robot]].home
        goes_home = situation.goal.return_home and robot < tables.carriers and home is not None
        if share or goes_home:
            tour.go(robot, int(share), situation.place_index[home or ""] if goes_home else None)
    if situation.goal.return_home:
        go_home(tour.timeline)
    return tour.timeline.plan


class _TourTimeline:
    """A timeline on which robots tour sets of targets, by way of other places where that is shorter."""

    def __init__(self, situation: Situation, data: ProblemData, tables: Tables) -> None:
        self.timeline = Timeline.of(situation)
        self._situation, self._data, self._tables = situation, data, tables

    def name(self, robot: int) -> str:
        return self._situation.robots[self._tables.robots[robot]].name

    def go(self, robot: int, share: int, end: int | None) -> None:
        """Add the shortest tour of a robot over a set of targets to a place, or to any."""
        kind = int(self._tables.traits[robot, col.KIND])
        place = self._situation.place_index[self.timeline.at[self.name(robot)] or ""]
        for stop in _shortest_order(self._tables.closure[kind], self._tables.targets, place, share, end):
            for step in _shortest_way(self._data.leg[kind], self._tables.closure[kind], place, stop):
                self._step(robot, step)
            place = stop

    def _step(self, robot: int, place: int) -> None:
        if place in self._tables.targets:
            self.timeline.explore(self.name(robot), self._situation.places[place])
        else:
            self.timeline.move(self.name(robot), self._situation.places[place])


def _shortest_order(closure: Ints, targets: Ints, place: int, share: int, end: int | None) -> list[int]:
    """Return the stops of the shortest tour over a set of targets and to an end."""
    chosen = np.array([t for j, t in enumerate(targets) if share >> j & 1], dtype=np.int64)
    stops = [] if end is None else [end]
    if not len(chosen):
        return stops
    between = np.ascontiguousarray(closure[np.ix_(chosen, chosen)])
    # Times only are kept in the tables, so the order is found again backwards from the last stop.
    tours = shortest_tours(closure[place][chosen], between)
    left = len(tours) - 1
    last = int(np.argmin(tours[left] + (0 if end is None else closure[chosen, end])))
    while True:
        stops.insert(0, int(chosen[last]))
        left &= ~(1 << last)
        if not left:
            return stops
        last = int(np.argmin(np.minimum(tours[left] + between[:, last], 2 * NEVER)))


def _shortest_way(leg: Ints, closure: Ints, place: int, end: int) -> Iterator[int]:
    """Yield the places of the shortest way, the end last; none if the robot is there."""
    while place != end:
        rest = np.where(np.arange(len(leg)) == place, 2 * NEVER, leg[place] + closure[:, end])
        rest[closure[place] >= NEVER] = 2 * NEVER
        place = int(np.argmin(np.where(closure[place] == leg[place], rest, 2 * NEVER)))
        yield place

"""Closing the gap between the best plan and the lower bound by two searches: one from above, one from below.

    bound ----- below_ms ------------------------ best plan
      |------------->|                                |
      from below: any plan in here?                   |
      |<----------------------------------------------|
      from above: any shorter plan at all?

The search from above is the quickest proof if the best plan is optimal. If the best plan is far from optimal, that
search wastes time on many slightly better plans. So after a while it alternates with a search from below: for plans
that end before a time slightly above the bound. Few plans are that short, so this search soon either ends, which raises
the bound, and the next search has a higher limit; or it finds a plan. The search that finds the optimal plan costs
hardly more than its proof. Each search uses the other's result as its limit.

`plan_found` turns what a search has found into a plan: docks and undocks, and the sets explored before and after them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import EPSILON_MS, Finished, Outcome, Plan, Situation
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.memory import entry_size
from marsupial.planning.branch_and_bound.search import advance, root_bound_ms, search_of
from marsupial.planning.branch_and_bound.tables import Tables, tables_of, timeless
from marsupial.planning.branch_and_bound.tours import shortest_tours
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import ProblemData, encode
from marsupial.planning.schedule.costs import NEVER
from marsupial.planning.schedule.recovery import go_home
from marsupial.planning.schedule.timeline import Timeline

STEP = 2000  # states that a search enters in one step
MEMORY_BYTES = 1 << 26  # memory of states per search; there are two searches at most
STEPS_ALONE = 20  # steps of the search from above before one from below joins
STRIDES = 16  # the first search from below covers one part in this many of the gap

# effort of a search from below relative to the one before
SLOW = 4  # above this effort the next stride is halved
QUICK = 2  # below this effort it is doubled


class OptimalityProof:
    """The `best` plan, the lower bound, and the searches that improve them; `latest` is other engines' best plan."""

    def __init__(self, situation: Situation, best: Plan | None, latest: Callable[[], Plan | None]) -> None:
        self._situation, self._latest = situation, latest
        self._data = encode(situation)
        self._tables = tables_of(self._data)
        self._best, self._bound_ms = best, 0
        self._states, self._without_plan = 0, Outcome.TIMEOUT

    def plans(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        """Yield improving plans until the last one is proven optimal or `goes_on` returns False."""
        if self._best is None:
            yield from self._first_plan(goes_on)
        if self._best is None:
            return
        root = root_bound_ms(self._tables, self._best.makespan_ms + EPSILON_MS) - EPSILON_MS
        self._bound_ms = max(makespan_bound_ms(self._data), root)
        yield from self._better_plans(goes_on)

    @property
    def _gap_ms(self) -> int:
        return 0 if self._best is None else self._best.makespan_ms - self._bound_ms

    def _first_plan(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        """Yield a plan, if there is one, found as if nothing took time."""
        search = _BoundedSearch(timeless(self._tables), 0, keyed=False)
        while search.goes_on and goes_on():
            self._states += search.advance()
            yield from self._new_plan(search)
        if not search.goes_on:
            self._without_plan = Outcome.NO_PLAN if search.incomplete else Outcome.UNSOLVABLE

    def _better_plans(self, goes_on: Callable[[], bool]) -> Iterator[Plan]:
        assert self._best is not None
        above, below = _BoundedSearch(self._tables, self._best.makespan_ms), _SearchesFromBelow(self._tables)
        steps = 0
        while self._gap_ms > 0 and not above.incomplete and goes_on():
            steps += 1
            other = below.search(self._bound_ms, self._gap_ms) if steps > STEPS_ALONE else None
            for search in (above, other):
                if search is not None:
                    self._states += search.advance()
                    yield from self._new_plan(search)
                    yield from self._plan_of_others()
                    self._update(search)

    def _new_plan(self, search: _BoundedSearch) -> Iterator[Plan]:
        """Yield the last plan of a search if it is better than the best one."""
        if self._best is not None and search.limit_ms >= self._best.makespan_ms:
            return
        if found := search.state.counters[col.FOUND]:
            events, shares = search.state.best[1:found], search.state.shares
            self._best = plan_found(self._situation, self._data, self._tables, events, shares)
            yield self._best

    def _plan_of_others(self) -> Iterator[Plan]:
        plan = self._latest()
        if plan is not None and self._best is not None and plan.makespan_ms < self._best.makespan_ms:
            self._best = plan
            yield plan

    def _update(self, search: _BoundedSearch) -> None:
        """Raise the bound if a search has ended; lower its limit to the best plan otherwise."""
        assert self._best is not None
        if search.goes_on:
            search.lower_limit(self._best.makespan_ms)
        elif not search.incomplete:
            self._bound_ms = max(self._bound_ms, min(search.below_ms, self._best.makespan_ms))

    def finished(self, elapsed_s: float) -> Finished:
        """Return the result so far."""
        states = f"{self._states} states"
        if self._best is None:
            detail = _WITHOUT_PLAN[self._without_plan] + states
            return Finished(outcome=self._without_plan, detail=detail, elapsed_s=elapsed_s)
        outcome = Outcome.SATISFICING if self._gap_ms > 0 else Outcome.OPTIMAL
        proven = f"no plan ends before {self._bound_ms / 1000:.3f} s" if self._gap_ms > 0 else "the makespan is optimal"
        detail = f"{proven}, proven with {states}"
        return Finished(outcome=outcome, detail=detail, elapsed_s=elapsed_s, lower_bound_ms=self._bound_ms)


_WITHOUT_PLAN = {
    Outcome.UNSOLVABLE: "every way of setting down and picking up rovers has been tried: ",
    Outcome.NO_PLAN: "no plan found with a moderate number of docks and undocks: ",
    Outcome.TIMEOUT: "no plan found so far: ",
}


class _BoundedSearch:
    """A search in steps for plans that end before `below_ms`; when it ends, none is shorter than the last one found."""

    def __init__(self, tables: Tables, below_ms: int, *, keyed: bool = True) -> None:
        entries = MEMORY_BYTES // (8 * entry_size(len(tables.traits), tables.carriers))
        self._tables, self.state = tables, search_of(tables, below_ms + EPSILON_MS, entries, keyed=keyed)
        self.below_ms = below_ms
        self.goes_on = True

    def advance(self) -> int:
        """Enter some states; return how many."""
        before = self.states
        self.goes_on = self.goes_on and advance(self._tables, self.state, STEP)
        return self.states - before

    def lower_limit(self, below_ms: int) -> None:
        counters = self.state.counters
        counters[col.LIMIT] = min(counters[col.LIMIT], below_ms + EPSILON_MS)

    @property
    def limit_ms(self) -> int:
        """The time that plans have to end before: `below_ms`, the last plan's makespan, or a lower limit set."""
        return int(self.state.counters[col.LIMIT]) - EPSILON_MS

    @property
    def incomplete(self) -> bool:
        """Whether the search skipped something for lack of space, so that its end proves nothing."""
        return bool(self.state.counters[col.INCOMPLETE])

    @property
    def states(self) -> int:
        return int(self.state.counters[col.NODES])


class _SearchesFromBelow:
    """The searches from below, one after another, with strides that adapt to their effort."""

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._current: _BoundedSearch | None = None
        self._stride_ms, self._previous_states = 0, STEP

    def search(self, bound_ms: int, gap_ms: int) -> _BoundedSearch | None:
        """Return the current search, or the next one; None if it would equal the search from above."""
        if self._current is None:
            self._stride_ms = max(1, gap_ms // STRIDES)
        elif self._current.goes_on:
            return self._current
        elif self._current.incomplete:
            return None
        else:
            self._adapt(max(STEP, self._current.states))
        # It would equal the search from above.
        if self._stride_ms >= gap_ms:
            return None
        self._current = _BoundedSearch(self._tables, bound_ms + self._stride_ms)
        return self._current

    def _adapt(self, states: int) -> None:
        if states > SLOW * self._previous_states:
            self._stride_ms = max(1, self._stride_ms // 2)
        elif states < QUICK * self._previous_states:
            self._stride_ms *= 2
        self._previous_states = states


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
    """A timeline on which robots tour sets of targets, via other places where that is shorter."""

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
                drive = self.timeline.explore if step in self._tables.targets else self.timeline.move
                drive(self.name(robot), self._situation.places[step])
            place = stop


def _shortest_order(closure: Ints, targets: Ints, place: int, share: int, end: int | None) -> list[int]:
    """Return the stops of the shortest tour over a set of targets and to an end."""
    chosen = np.array([t for j, t in enumerate(targets) if share >> j & 1], dtype=np.int64)
    stops = [] if end is None else [end]
    if not len(chosen):
        return stops
    between = np.ascontiguousarray(closure[np.ix_(chosen, chosen)])
    # The tables store times only, so the order is reconstructed backwards from the last stop.
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

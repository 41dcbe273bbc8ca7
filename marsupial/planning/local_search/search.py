r"""Simulated annealing over linked schedules.

Theory of operation
-------------------
One step of the search draws a move, changes a few links, retimes what follows them and accepts or undoes the change:

    begin -> move changes links -> retime -> cost <= limit? -- yes -> accept (maybe a new incumbent)
                 |                    |                     \- no --> undo from the log
                 \- nothing changed -> undo                 (both may stop early)

**Cost.** A weighted sum of three parts: lateness (how much each event ends after the due date, summed over all events),
the mean time at which targets are reached, and driving. The makespan itself would be a poor guide: most moves leave it
as it is, and a search sees no slope. Summed lateness rewards every event that gets closer to the due date. That date
is slightly below the incumbent's makespan (`DUE_MARGIN`), so there is always something late, and never below the lower
bound. It only moves down, when a new incumbent is found; then the cost of the current schedule is computed again.

**Acceptance.** Metropolis: a change that costs `d` more is accepted with probability exp(-d / temperature). That is the
same as drawing u from (0, 1] first and accepting where the new cost is at most `limit = cost - temperature * ln(u)`.
Since the limit is known before the schedule is timed, timing stops as soon as the cost is sure to be above it
(`timing`). The decision is the one that complete timing would have led to, so this early rejection is exact; `timing`
describes a quicker test that is nearly exact.

**Incumbent.** Decided apart from the cost, by the parts of the objective's value in turn (makespan, then arrivals, then
driving), or by their weighted sum for priced arrival. Every accepted schedule is compared to it.

**Temperatures.** Geometric cooling from a start to an end temperature, both shares of the first plan's makespan, as
costs grow with it. The start is lower for many targets (a move changes a smaller part of the schedule then) and for
short budgets (there is no time to cool down).

**Restarts.** The budget is split into runs, each cooled from start to end:

    used budget   0 ............ EARLY_RUNS_SHARE ... 1
    temperature   |\_ |\_ |\_ |\_ |\______________
                   run 0  1   2   3   last run

The early runs begin with the given plans in turn. The last run begins with the best schedule known, at a lower
temperature (`REHEAT`): it improves that schedule without leaving its surroundings. With many transfers one long run
is better than several short ones. What was tried: docs/planners.md.
"""

import math
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Floats, Ints, Ints32
from marsupial.model.objective import MAKESPAN, Objective, PricedArrival, Value
from marsupial.native import inlined, native, outlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.local_search.linked_schedule import LinkedSchedule, accept, begin, draw, undo
from marsupial.planning.local_search.loading import empty_schedule, events_in, load
from marsupial.planning.local_search.moves import BUSY, apply_move, cumulative_rates
from marsupial.planning.local_search.timing import LATEST, cost_of, makespan_of, propagate, set_due

STEP = 1000  # moves that each search tries in one step of a budget

# shares of the first plan's makespan
START_TEMPERATURE = 0.16  # at most this at the start
CROWDED_TEMPERATURE = 2.0  # and at most this, divided by the number of targets
END_TEMPERATURE = 0.0002

FULL_HEAT_CHANGES = 15_000  # changes per target from which on a run starts at the full temperature, else in proportion
LEAST_HEAT = 0.15  # least share of it

REHEAT = 0.4  # start temperature of the last run, as a share of that of the others

MOST_RUNS = 6  # early runs, unless each would get more than the maximum of changes per target
MIN_RUN_CHANGES, MAX_RUN_CHANGES = 1500, 9000
EARLY_RUNS_SHARE = 0.7  # of the budget, for all of them

BUSY_RUN_CHANGES = 100_000  # changes per target of an early run where there are many transfers

# weights where lateness has 1
ARRIVAL_WEIGHT = 0.2  # of the mean time at which targets are reached
CROWDED_ARRIVAL_WEIGHT = 0.02  # the same per target, where there are many
DRIVING_WEIGHT = 1e-4

DUE_MARGIN = 0.05  # how far the due date is below the incumbent's makespan, as a share of it
MAKESPAN_WEIGHT = 3  # index of the weight of the incumbent's makespan, after those of lateness, arrivals and driving
LOWER_BOUND = 3  # column of the incumbent's numbers, after the parts of its value

SEED, SEEDS = 0x9E3779B97F4A7C15, 0xD1B54A32D192ED03


class AnnealingMemory(NamedTuple):
    """The state of a search besides its schedule."""

    best: Ints  # (4,): the value of the incumbent and a lower bound on the makespan in ms
    best_nodes: Ints  # (nodes, `WIDTH`): the rows of the incumbent
    rates: Ints  # (moves,): see `cumulative_rates`
    # (4,): of lateness, arrivals and driving, and of the incumbent's makespan, or -1 if incumbents are compared by the
    # parts of their values in turn
    weights: Floats


@native
def start(sched: LinkedSchedule, memory: AnnealingMemory, events: Ints32) -> bool:
    """Load a list of events as the current schedule; return whether it is feasible."""
    sched.work[0, col.DUE] = LATEST
    if not load(sched, events) or propagate(sched, np.inf, memory.weights) == np.inf:
        return False
    if _improves(sched, memory):
        _copy(sched, memory.best_nodes)
    set_due(sched, _due_date(memory.best))
    return True


@native
def anneal(sched: LinkedSchedule, memory: AnnealingMemory, temperature: float, changes: int) -> None:
    """Try `changes` moves at a temperature in ms, as costs."""
    cost = cost_of(sched, memory.weights)
    for _ in range(changes):
        cost = _try_move(sched, memory, temperature, cost)


@outlined
def _try_move(sched: LinkedSchedule, memory: AnnealingMemory, temperature: float, cost: float) -> float:
    drawn, move = draw(sched, memory.rates[-1]), 0
    while drawn >= memory.rates[move]:
        move += 1
    begin(sched)
    if not apply_move(sched, move):
        undo(sched)
        return cost
    # Draw before timing: the limit lets `propagate` stop as soon as rejection is certain.
    limit = cost - temperature * math.log((draw(sched, 1 << 30) + 1) / (1 << 30))
    found = propagate(sched, limit, memory.weights)
    if found > limit:
        undo(sched)
        return cost
    accept(sched)
    if _improves(sched, memory):
        _copy(sched, memory.best_nodes)
        due = _due_date(memory.best)
        # Costs before and after a new due date are not comparable, so the cost is computed again.
        if due < sched.work[0, col.DUE]:
            set_due(sched, due)
            return cost_of(sched, memory.weights)
    return found


@inlined
def _copy(sched: LinkedSchedule, best_nodes: Ints) -> None:
    for node in range(len(best_nodes)):
        for column in range(best_nodes.shape[1]):
            best_nodes[node, column] = sched.nodes[node, column]


@inlined
def _due_date(best: Ints) -> int:
    return max(best[LOWER_BOUND], np.int64(best[0] * (1 - DUE_MARGIN)))


@inlined
def _improves(sched: LinkedSchedule, memory: AnnealingMemory) -> bool:
    """Return whether the schedule is better than the incumbent; if so, store its value."""
    best, weights = memory.best, memory.weights
    makespan, reaching, driving = makespan_of(sched), sched.work[0, col.REACHING], sched.work[0, col.DRIVING]
    if weights[MAKESPAN_WEIGHT] >= 0:
        former = weighted_sum(weights, best[0], best[1], best[2])
        better = best[0] == LATEST or weighted_sum(weights, makespan, reaching, driving) < former
    elif makespan != best[0]:
        better = makespan < best[0]
    elif reaching != best[1]:
        better = reaching < best[1]
    else:
        better = driving < best[2]
    if better:
        best[0], best[1], best[2] = makespan, reaching, driving
    return better


@inlined
def weighted_sum(weights: Floats, makespan: int, reaching: int, driving: int) -> float:
    """Return the weighted sum of the parts of a value, for priced arrival."""
    return weights[MAKESPAN_WEIGHT] * makespan + weights[1] * reaching + weights[2] * driving


class Annealing:
    """Simulated annealing in a few runs from given plans, and a last one from the best plan so far.

    The runs begin with the feasible lists `beginnings` in turn. `bound_ms` is a lower bound on the time when all robots
    are ready. Searches with another `number` draw other moves; `objective` is the one that `data` was encoded for.
    """

    def __init__(
        self,
        data: ProblemData,
        beginnings: list[Ints32],
        bound_ms: int,
        number: int = 0,
        objective: Objective = MAKESPAN,
    ) -> None:
        self._data, self._given, self._beginnings = data, beginnings, beginnings
        transfers = max(int(np.isin(events[:, 0], (col.DOCK, col.UNDOCK)).sum()) for events in beginnings)
        self._sched = empty_schedule(data, transfers, SEED + number * SEEDS & (1 << 64) - 1)
        self._many_transfers = transfers >= max(BUSY, int(data.groups[col.TARGETS, 0]))
        self._objective = objective
        self._memory = AnnealingMemory(
            best=np.array([LATEST, 0, 0, bound_ms], dtype=np.int64),
            best_nodes=self._sched.nodes.copy(),
            rates=cumulative_rates(busy=self._many_transfers),
            weights=_weights_of(data, objective),
        )
        self._begin_at(beginnings[0])
        # without targets, or if they are worth nothing, only driving has a price
        price = objective.total_worth or objective.driving if isinstance(objective, PricedArrival) else 0.0
        self._scale_ms = float(self._memory.best[0]) * (price or 1.0)
        self._heat = self._start_temperature(0.0)
        self._runs, self._run = 1, 0

    @property
    def score(self) -> Value:
        """Return the value of the best list by the objective; worths are rounded to thousandths."""
        makespan, reaching, driving = self._memory.best[:LOWER_BOUND].tolist()
        if isinstance(self._objective, PricedArrival):
            return (weighted_sum(self._memory.weights, makespan, reaching, driving),)
        return makespan, reaching, driving

    @property
    def events(self) -> Ints32:
        """Return the best list of events so far."""
        return events_in(self._memory.best_nodes, self._sched.robots)

    def expect(self, steps: float) -> None:
        """Choose the number of runs and their start temperature for about `steps` steps."""
        self._heat = self._start_temperature(steps)
        changes = EARLY_RUNS_SHARE * steps * STEP / max(1, int(self._data.groups[col.TARGETS, 0]))
        if self._many_transfers:
            runs = int(changes / BUSY_RUN_CHANGES)
        else:
            runs = int(max(min(float(MOST_RUNS), changes / MIN_RUN_CHANGES), changes / MAX_RUN_CHANGES))
        self._runs = runs + 1 if runs > 1 else 1

    def begin_round(self, events: Ints32, steps: float) -> None:
        """Restart with a list of events for about `steps` steps."""
        self._run = 0
        self._beginnings = [events, *self._given]
        self.expect(steps)
        self._begin_at(events)

    def is_last_run(self, used: float) -> bool:
        """Return whether the last of several runs is due at that share of the budget and has not begun."""
        return self._run_at(used)[0] == self._runs - 1 > self._run

    def begin_last(self, events: Ints32) -> None:
        """Begin the last run with a list of events."""
        self._run = self._runs - 1
        self._begin_at(events)

    def step(self, used: float, steps: int) -> None:
        """Take `steps` steps; `used` is the used share of the budget, from 0 to 1."""
        run, cooled, heat = self._run_at(used)
        if run != self._run:
            self._run = run
            self._begin_at(self._beginnings[run % len(self._beginnings)] if run < self._runs - 1 else self.events)
        temperature = self._scale_ms * heat * (END_TEMPERATURE / heat) ** cooled
        anneal(self._sched, self._memory, temperature, STEP * steps)

    def _start_temperature(self, steps: float) -> float:
        targets = max(1, int(self._data.groups[col.TARGETS, 0]))
        heat = min(1.0, max(LEAST_HEAT, steps * STEP / targets / FULL_HEAT_CHANGES))
        return max(END_TEMPERATURE, heat * min(START_TEMPERATURE, CROWDED_TEMPERATURE / targets))

    def _run_at(self, used: float) -> tuple[int, float, float]:
        """Return the run at a moment, how far it has cooled (0 to 1), and its start temperature."""
        first = self._runs - 1
        if not first:
            return 0, used, self._heat
        if used >= EARLY_RUNS_SHARE:
            return first, (used - EARLY_RUNS_SHARE) / (1 - EARLY_RUNS_SHARE), max(END_TEMPERATURE, REHEAT * self._heat)
        position = used / EARLY_RUNS_SHARE * first
        run = min(int(position), first - 1)
        return run, position - run, self._heat

    def _begin_at(self, events: Ints32) -> None:
        start(self._sched, self._memory, events)


def _weights_of(data: ProblemData, objective: Objective) -> Floats:
    if isinstance(objective, PricedArrival):
        late = objective.makespan * objective.total_worth
        return np.array([late, 1e-3, objective.driving, late], dtype=np.float64)
    targets = int(data.groups[col.TARGETS, 0])
    reaching = max(ARRIVAL_WEIGHT, CROWDED_ARRIVAL_WEIGHT * targets) / max(1, int(data.worth.sum()))
    return np.array([1.0, reaching, DRIVING_WEIGHT, -1.0], dtype=np.float64)


def is_feasible(data: ProblemData, events: Ints32) -> bool:
    return Annealing(data, [events], 0).score[0] < LATEST

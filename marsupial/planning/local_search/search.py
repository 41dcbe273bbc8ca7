"""Simulated annealing over nets: a change that the Metropolis criterion does not accept is undone.

What steers a search is a blend: how much of the plan is later than is hoped for, summed over what is done; the mean
time at which targets are reached; the driving. What is hoped for is a little less than the makespan of the incumbent.
Which plan is the incumbent is decided by the parts of a score in turn. What was tried: docs/planners.md.
"""

from __future__ import annotations

import math

import numpy as np

from marsupial.arrays import Floats, Ints, Ints32
from marsupial.model.objective import MAKESPAN, Objective, PricedArrival, Value
from marsupial.native import inlined, native, outlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.local_search.loading import events_in, load, net_of
from marsupial.planning.local_search.moves import BUSY, change, lots
from marsupial.planning.local_search.net import Net, accept, begin, draw, undo
from marsupial.planning.local_search.timing import LATEST, cost_of, makespan_of, propagate, set_due

STEP = 1000
"""Changes that each search tries in one step of a budget."""

HOT, CROWDED, COLD = 0.16, 2.0, 0.0002
"""Temperature at the beginning, that times the number of targets where there are many, and at the end: as shares of the
first plan's makespan."""

CALM, HURRY = 15_000, 0.15
"""How many changes per target it takes to begin that hot; with fewer it is cooler in proportion, down to a share."""

AGAIN = 0.4
"""With what share of the first temperature the last run begins."""

RUNS, RUN_CHANGES, RUN_ENOUGH, RUNS_SHARE = 6, 1500, 9000, 0.7
"""How many runs there are where each has that many changes per target, and more where each would have more than is
enough; the share of the budget of all but the last."""

BUSY_RUN_CHANGES = 100_000
"""The same where there are many transfers: one long run is better there than several short ones."""

REACHING_SHARE, REACHING_CROWDED, DRIVING_SHARE = 0.2, 0.02, 1e-4
"""What a ms of the mean time at which targets are reached costs beside one of being late, or per target where there
are many, and a ms of driving."""

AMBITION = 0.05
"""By what share of the shortest makespan less is hoped for."""

MAKESPAN_PRICE = 3
"""Index in a blend."""

BOUND = 3
"""Column of the incumbent's numbers after the parts of a score."""

SEED, SEEDS = 0x9E3779B97F4A7C15, 0xD1B54A32D192ED03


@native
def start(net: Net, events: Ints32, best: Ints, best_nodes: Ints, blend: Floats, ambition: float) -> bool:
    """Make a list of events current; False if it can't be carried out. The parameters are those of `anneal`."""
    net.work[0, col.DUE] = LATEST
    if not load(net, events) or propagate(net, np.inf, blend) == np.inf:
        return False
    if _improves(net, best, blend):
        _keep(net, best_nodes)
    set_due(net, _hoped_for(best, ambition))
    return True


@native
def anneal(
    net: Net,
    best: Ints,
    best_nodes: Ints,
    lots: Ints,
    blend: Floats,
    temperature: float,
    ambition: float,
    changes: int,
) -> None:
    """Try that many changes.

    Parameters
    ----------
    best, best_nodes
        The incumbent: (4,), its score and the least makespan that is possible, in ms, and (nodes, `WIDTH`).
    lots
        (moves,): up to which number drawn each move is made.
    blend
        (4,): what a ms late, of reaching and of driving cost, and one of the incumbent's makespan, or -1 if the
        incumbent goes by the parts of a score in turn.
    temperature
        In ms, as costs.
    ambition
        By what share of the incumbent's makespan less is hoped for.
    """
    cost = cost_of(net, blend)
    for _ in range(changes):
        cost = _tried(net, best, best_nodes, lots, blend, temperature, ambition, cost)


@outlined
def _tried(
    net: Net,
    best: Ints,
    best_nodes: Ints,
    lots: Ints,
    blend: Floats,
    temperature: float,
    ambition: float,
    cost: float,
) -> float:
    lot, move = draw(net, lots[-1]), 0
    while lot >= lots[move]:
        move += 1
    begin(net)
    if not change(net, move):
        undo(net)
        return cost
    limit = cost - temperature * math.log((draw(net, 1 << 30) + 1) / (1 << 30))
    found = propagate(net, limit, blend)
    if found > limit:
        undo(net)
        return cost
    accept(net)
    if _improves(net, best, blend):
        _keep(net, best_nodes)
        due = _hoped_for(best, ambition)
        if due < net.work[0, col.DUE]:
            set_due(net, due)
            return cost_of(net, blend)
    return found


@inlined
def _keep(net: Net, best_nodes: Ints) -> None:
    for node in range(len(best_nodes)):
        for column in range(best_nodes.shape[1]):
            best_nodes[node, column] = net.nodes[node, column]


@inlined
def _hoped_for(best: Ints, ambition: float) -> int:
    return max(best[BOUND], np.int64(best[0] * (1 - ambition)))


@inlined
def _improves(net: Net, best: Ints, blend: Floats) -> bool:
    """Say whether the net is better than the incumbent, and if so enter its score."""
    makespan, reaching, driving = makespan_of(net), net.work[0, col.REACHING], net.work[0, col.DRIVING]
    if blend[MAKESPAN_PRICE] >= 0:
        former = total(blend, best[0], best[1], best[2])
        better = best[0] == LATEST or total(blend, makespan, reaching, driving) < former
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
def total(blend: Floats, makespan: int, reaching: int, driving: int) -> float:
    """Return what parts of a score cost together, by the blend of priced arrival."""
    return blend[MAKESPAN_PRICE] * makespan + blend[1] * reaching + blend[2] * driving


class Annealing:
    """A search in a few runs from given beginnings and a last one from the best list that is known then.

    Parameters
    ----------
    beginnings
        Lists of events that can be carried out; the runs begin with them in turn, the first with the first.
    bound_ms
        From when all robots may be ready at the earliest.
    number
        Searches with other numbers try other changes.
    objective
        The one that `data` was made for.
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
        self._net = net_of(data, transfers, SEED + number * SEEDS & (1 << 64) - 1)
        self._best_nodes = self._net.nodes.copy()
        self._best = np.array([LATEST, 0, 0, bound_ms], dtype=np.int64)
        targets = int(data.groups[col.TARGETS, 0])
        self._busy = transfers >= max(BUSY, targets)
        self._lots = lots(busy=self._busy)
        self._objective, self._blend = objective, _blend_of(data, objective)
        self._begin_at(beginnings[0])
        self._scale_ms = float(self._best[0]) * (objective.total_worth if isinstance(objective, PricedArrival) else 1.0)
        self._hot = self._heat(0.0)
        self._runs, self._run = 1, 0

    @property
    def score(self) -> Value:
        """The value of the best list by the objective; worths are rounded to thousandths."""
        makespan, reaching, driving = (int(part) for part in self._best[:BOUND])
        if isinstance(self._objective, PricedArrival):
            return (total(self._blend, makespan, reaching, driving),)
        return makespan, reaching, driving

    @property
    def events(self) -> Ints32:
        """The best list so far."""
        return events_in(self._best_nodes, self._net.robots)

    def expect(self, steps: float) -> None:
        """Choose the number of runs and how hot they begin for a budget of about that many steps."""
        self._hot = self._heat(steps)
        changes = RUNS_SHARE * steps * STEP / max(1, int(self._data.groups[col.TARGETS, 0]))
        if self._busy:
            runs = int(changes / BUSY_RUN_CHANGES)
        else:
            runs = int(max(min(float(RUNS), changes / RUN_CHANGES), changes / RUN_ENOUGH))
        self._runs = runs + 1 if runs > 1 else 1

    def begin_round(self, events: Ints32, steps: float) -> None:
        """Begin anew, at first from a list of events, for about that many steps."""
        self._run = 0
        self._beginnings = [events, *self._given]
        self.expect(steps)
        self._begin_at(events)

    def is_last_run(self, used: float) -> bool:
        """Say whether the last of several runs is due at that share of the budget, and has not begun."""
        return self._moment(used)[0] == self._runs - 1 > self._run

    def begin_last(self, events: Ints32) -> None:
        """Begin the last run from a list of events."""
        self._run = self._runs - 1
        self._begin_at(events)

    def step(self, used: float, steps: int) -> None:
        """Take that many steps; `used` is the share of the budget used so far, from 0 to 1."""
        run, fallen, hot = self._moment(used)
        if run != self._run:
            self._run = run
            self._begin_at(self._beginnings[run % len(self._beginnings)] if run < self._runs - 1 else self.events)
        temperature = self._scale_ms * hot * (COLD / hot) ** fallen
        anneal(self._net, self._best, self._best_nodes, self._lots, self._blend, temperature, AMBITION, STEP * steps)

    def _heat(self, steps: float) -> float:
        targets = max(1, int(self._data.groups[col.TARGETS, 0]))
        calm = min(1.0, max(HURRY, steps * STEP / targets / CALM))
        return max(COLD, calm * min(HOT, CROWDED / targets))

    def _moment(self, used: float) -> tuple[int, float, float]:
        """Return which run it is, how far its temperature has fallen (0 to 1), and from where."""
        first = self._runs - 1
        if not first:
            return 0, used, self._hot
        if used >= RUNS_SHARE:
            return first, (used - RUNS_SHARE) / (1 - RUNS_SHARE), max(COLD, AGAIN * self._hot)
        turn = used / RUNS_SHARE * first
        run = min(int(turn), first - 1)
        return run, turn - run, self._hot

    def _begin_at(self, events: Ints32) -> None:
        start(self._net, events, self._best, self._best_nodes, self._blend, AMBITION)


def _blend_of(data: ProblemData, objective: Objective) -> Floats:
    """Return what things cost: see `anneal`."""
    if isinstance(objective, PricedArrival):
        late = objective.makespan * objective.total_worth
        return np.array([late, 1e-3, objective.driving, late], dtype=np.float64)
    targets = int(data.groups[col.TARGETS, 0])
    reaching = max(REACHING_SHARE, REACHING_CROWDED * targets) / max(1, int(data.worth.sum()))
    return np.array([1.0, reaching, DRIVING_SHARE, -1.0], dtype=np.float64)


def can_be_carried_out(data: ProblemData, events: Ints32) -> bool:
    """Say whether a list of events can be."""
    search = Annealing(data, [events], 0)
    return search.score[0] < LATEST

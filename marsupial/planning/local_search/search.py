"""Simulated annealing over nets: a change that is not accepted, by Metropolis' rule, is undone.

What steers a search is a blend: how much of the plan is later than is hoped for, summed over what is done; the mean
time at which targets are reached; the driving. What is hoped for is a little less than the shortest makespan so far.
What is kept as the best is decided by the parts of a score in turn.

What was tried, with budgets in steps, on eight to sixteen situations of the suite and of generated rooms with 6 to 136
robots, two or three seeds each. One search varies by 5 % between seeds, so only large differences mean much. In all:

- Hoping for 2 to 6 % less than the best makespan so far made plans 2.5 % shorter than hoping for 0.1 % less, which
  leaves little of a slope; for 15 % was worse. Late times squared were worse, too.
- Beginning two to four times as hot, if there is time to cool down: 1 to 2 %; eight times, or ending hotter: worse.
- Rides put in at the least detour half of the time, and rovers taken from near by (as carriers are now): 1.5 %.
- Six runs and one from the best of them are better than two, by 1.5 %; with 9000 changes per target and run, twelve or
  24 shorter ones are worse again; with four times as many changes, 24 runs are better than six by 2 %.
- Chains of outings, so that a ride may go from one carrier to another and nothing else has to change, instead of chains
  of rovers, with moves made for each: where rovers have to be used again 11 % with 136 robots and 6 % with 48, where 24
  have to come home 4 %, and 0.6 % in the mean of the 36 situations of the suite, two thirds of which both solve to the
  best plan known. Where chance decides on which of two plans a search ends, as in missions with few rides, three
  seeds were up to 3 % worse, and ten seeds by 0.5 to 0.7 %.
- Half of the moves chosen from what a late robot waited for gained nothing that can be told from noise by itself.
- `deploy` that has a rover fetched whenever nobody aboard could be set down: one mission with a single rover, that
  stopped 1 to 5 % short, is solved with every seed.
- `turn_round`: 2 % with 48 robots; in one mission 3 to 8 %, by chance, and nothing in others.
- Other shares where there are many rides, `BUSY_SHARES`: `shift`, `cross`, `reorder` and `rehost` more often. Some runs
  in a cave without rides stay at 81.3 s for 74.8 s whatever the shares are.
- A cooler beginning (half of `HOT` and `CROWDED`) with 48 and 136 robots: 2 to 3 % where rovers have to be used again,
  6 % worse where they have not.
- Taking out two to five targets and putting each back in the best of sixteen ways, now and then, gained what it cost in
  time and no more.
"""

from __future__ import annotations

import math

import numpy as np

from marsupial.model.objective import MAKESPAN, Objective, PricedArrival, Value
from marsupial.native import native
from marsupial.planning.local_search.encoding import DOCK, TARGETS, UNDOCK, Ints, Task
from marsupial.planning.local_search.moves import NEEDING_TARGETS, change
from marsupial.planning.local_search.net import (
    DRIVING,
    DUE,
    REACHING,
    Net,
    begin,
    compiled,
    draw,
    events_in,
    keep,
    load,
    net_of,
    undo,
)
from marsupial.planning.local_search.timing import LATEST, cost_of, makespan_of, set_due, settle

SHARES = 20, 20, 8, 6, 5, 16, 10, 3, 6, 10, 10, 8, 4, 6, 6
BUSY_SHARES, BUSY = (10, 12, 4, 3, 2, 24, 24, 2, 12, 12, 12, 12, 4, 1, 10), 60
"""How often each move is tried, beside the others; the second where a plan to begin with has at least so many rides,
and one for every target."""

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

REACHING_SHARE, REACHING_CROWDED, DRIVING_SHARE = 0.2, 0.02, 1e-4
"""What a ms of the mean time at which targets are reached costs beside one of being late, or per target where there
are many, and a ms of driving."""

AMBITION = 0.05
"""By what share of the shortest makespan less is hoped for."""

MAKESPAN_PRICE = 3
"""Index in a blend."""

BOUND = 3
"""Column of `best` after the parts of a score."""

SEED, SEEDS = 0x9E3779B97F4A7C15, 0xD1B54A32D192ED03


@native
def start(net: Net, events: Ints, best: Ints, best_nodes: Ints, blend: Ints, ambition: float) -> bool:
    """Make a list of events current; False if it can't be carried out."""
    net.work[0, DUE] = LATEST
    if not load(net, events) or settle(net, np.inf, blend) == np.inf:
        return False
    if _improves(net, best, blend):
        best_nodes[:] = net.nodes
    set_due(net, _hoped_for(best, ambition))
    return True


@native
def anneal(
    net: Net, best: Ints, best_nodes: Ints, shares: Ints, blend: Ints, temperature: float, ambition: float, changes: int
) -> None:
    """Try that many changes.

    `shares` is int64 (moves,): how often a move or one of those before it is tried, beside the last of them. `best` is
    int64 (4,): the score of `best_nodes` and the least makespan that is possible. `blend` is float64 (4,):
    what a ms late, of reaching and of driving cost, and one of the makespan of what is kept as the best, or -1 if that
    goes by the parts of a score in turn. Costs and `temperature` are in ms.
    """
    cost, targets = cost_of(net, blend), net.groups[TARGETS, 0]
    for _ in range(changes):
        lot, move = draw(net, shares[-1]), 0
        while lot >= shares[move]:
            move += 1
        if move < NEEDING_TARGETS and not targets:
            continue
        begin(net)
        if not change(net, move):
            undo(net)
            continue
        limit = cost - temperature * math.log((draw(net, 1 << 30) + 1) / (1 << 30))
        found = settle(net, limit, blend)
        if found > limit:
            undo(net)
            continue
        keep(net)
        cost = found
        if _improves(net, best, blend):
            best_nodes[:] = net.nodes
            due = _hoped_for(best, ambition)
            if due < net.work[0, DUE]:
                set_due(net, due)
                cost = cost_of(net, blend)


@compiled
def _hoped_for(best: Ints, ambition: float) -> int:
    return max(best[BOUND], np.int64(best[0] * (1 - ambition)))


@compiled
def _improves(net: Net, best: Ints, blend: Ints) -> bool:
    """Say whether the net is better than the best so far, and if so enter its score."""
    makespan, reaching, driving = makespan_of(net), net.work[0, REACHING], net.work[0, DRIVING]
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


@compiled
def total(blend: Ints, makespan: int, reaching: int, driving: int) -> float:
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
        The one that `task` was made for.
    """

    def __init__(
        self, task: Task, beginnings: list[Ints], bound_ms: int, number: int = 0, objective: Objective = MAKESPAN
    ) -> None:
        self._task, self._beginnings = task, beginnings
        rides = max(int(np.isin(events[:, 0], (DOCK, UNDOCK)).sum()) for events in beginnings)
        self._net = net_of(task, rides, SEED + number * SEEDS & (1 << 64) - 1)
        self._best_nodes = self._net.nodes.copy()
        self._best = np.array([LATEST, 0, 0, bound_ms], dtype=np.int64)
        targets = int(task.groups[TARGETS, 0])
        self._shares = np.cumsum(BUSY_SHARES if rides >= max(BUSY, targets) else SHARES, dtype=np.int64)
        self._objective, self._blend = objective, _blend_of(task, objective)
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
    def events(self) -> Ints:
        """The best list so far."""
        return events_in(self._best_nodes, self._net.robots)

    def expect(self, steps: float) -> None:
        """Choose the number of runs and how hot they begin for a budget of about that many steps."""
        self._hot = self._heat(steps)
        changes = RUNS_SHARE * steps * STEP / max(1, int(self._task.groups[TARGETS, 0]))
        runs = int(max(min(float(RUNS), changes / RUN_CHANGES), changes / RUN_ENOUGH))
        self._runs = runs + 1 if runs > 1 else 1

    def is_last_run(self, used: float) -> bool:
        """Say whether the last of several runs is due at that share of the budget, and has not begun."""
        return self._moment(used)[0] == self._runs - 1 > self._run

    def begin_last(self, events: Ints) -> None:
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
        anneal(self._net, self._best, self._best_nodes, self._shares, self._blend, temperature, AMBITION, STEP * steps)

    def _heat(self, steps: float) -> float:
        targets = max(1, int(self._task.groups[TARGETS, 0]))
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

    def _begin_at(self, events: Ints) -> None:
        start(self._net, events, self._best, self._best_nodes, self._blend, AMBITION)


def _blend_of(task: Task, objective: Objective) -> Ints:
    """Return what things cost: see `anneal`."""
    if isinstance(objective, PricedArrival):
        late = objective.makespan * objective.total_worth
        return np.array([late, 1e-3, objective.driving, late], dtype=np.float64)
    targets = int(task.groups[TARGETS, 0])
    reaching = max(REACHING_SHARE, REACHING_CROWDED * targets) / max(1, int(task.worth.sum()))
    return np.array([1.0, reaching, DRIVING_SHARE, -1.0], dtype=np.float64)


def can_be_carried_out(task: Task, events: Ints) -> bool:
    """Say whether a list of events can be."""
    search = Annealing(task, [events], 0)
    return search.score[0] < LATEST

"""The search for a fast plan: planned again and again, with a part of the stops taken out and put back elsewhere.

A round takes some stops out (those seen last above all, and their neighbours), puts others where they cost least until
all is seen again, lets the anytime engine's annealing find a better order, and shortens the tours. What is better, or
hardly worse, is what the next round begins with. Where nothing better is found for long, the search begins again with
other viewpoints.

Why it begins again: on the office with 1x1 and 3x2 robots, the only ones tried, searches with different seeds ended up
to 10 % apart without that and up to 3 % with it. How far the plans are from the best there are is not known.

References
----------
P. Shaw, Using constraint programming and local search methods to solve vehicle routing problems, CP 1998.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle, islice

import numpy as np

from marsupial.model.plan import EPSILON_MS, ActionName
from marsupial.model.robots import Role
from marsupial.planning.list_scheduling.greedy import serve
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import encode, events_of, plan_of
from marsupial.planning.local_search.search import Annealing
from marsupial.strategies.clairvoyant.cover import cover
from marsupial.strategies.clairvoyant.doors import doors
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.repair import repaired
from marsupial.strategies.clairvoyant.shorten import shortened

CARRIER_WORTH = (1.0, 3.0, 0.5)
"""What a cell seen from a carrier counts in the covers to begin with, in turn; from a rover 1."""

PATIENCE = 12
"""After how many rounds that find nothing better the search begins again."""

LATEST = 0.6
"""From which share of the effort on it then goes back to the best so far instead."""

COVERS = 2
"""Of how many covers the best is begun with."""

COVER_NOISE = 0.3
"""By what share sites may seem to see more than they do."""

BEGIN_STEPS, ROUND_STEPS, TURN = 200, 30, 10
"""Steps of annealing for each cover, for each round, and at a time."""

MOST_TAKEN = 8
"""How many stops a round takes out, at most."""

AMBITION = 0.05
"""By what share robots should be done sooner than all is seen so far."""

TOLERANCE = 0.02
"""By what share the next round may begin with something worse than the best, at the beginning; none at the end."""

DRIVING_SHARE = 0.002
"""What a ms of driving costs beside one until all is seen."""

Rate = tuple[int, float]


def best_outline(ground: Ground, used: Callable[[int], float], seed: int) -> Outline:
    """Return the best outline found.

    Parameters
    ----------
    used
        Says, after so many rounds, which share of the effort is used: the search ends at 1.
    seed
        Of the search.
    """
    rng = np.random.default_rng(seed)
    begun = (_begun(ground, worth, rng) for worth in cycle(CARRIER_WORTH))
    best = top = current = min(islice(begun, COVERS + 1), key=rate)
    done = futile = 0
    while (share := used(done)) < 1:
        if futile == PATIENCE:
            top = current = min(islice(begun, COVERS), key=rate) if share < LATEST else best
            futile = 0
        found = _round(current, round((1 - AMBITION) * top.complete_ms), rng, number=done)
        futile += 1
        if rate(found) < rate(top):
            top, futile = found, 0
        if rate(found) <= _tolerated(rate(top), share):
            current = found
        best = min(best, top, key=rate)
        done += 1
    return best


def fitted(outline: Outline, used: Callable[[int], float], seed: int) -> Outline:
    """Return an outline made for other ground changed so that all is seen again, and then as the search improves it.

    The parameters are those of `best_outline`.
    """
    rng = np.random.default_rng(seed)
    best = shortened(repaired(shortened(outline), rng, max(1, outline.complete_ms)))
    done = 0
    while best.stops and used(done) < 1:
        found = _round(best, round((1 - AMBITION) * best.complete_ms), rng, done)
        best = min(best, found, key=rate)
        done += 1
    return best


def _tolerated(top: Rate, share: float) -> Rate:
    return top[0], top[1] * (1 + TOLERANCE * (1 - share))


def rate(outline: Outline) -> Rate:
    """Return how good an outline is: what is not seen, then when the rest is, and a little of the driving."""
    driving = sum(action.duration_ms for action in outline.plan.actions if action.origin is not None)
    return outline.missed.bit_count(), outline.complete_ms + DRIVING_SHARE * driving


def _begun(ground: Ground, carrier_worth: float, rng: np.random.Generator) -> Outline:
    worth = {name: carrier_worth if kind.role is Role.CARRIER else 1.0 for name, kind in ground.kinds.items()}
    stops = tuple(cover(ground, worth, COVER_NOISE, rng))
    outline = Outline(ground=ground, stops=stops, meetings=doors(ground, stops))
    plan, unserved = serve(outline.situation)
    outline = outline.with_plan(plan).without(unserved)
    outline = shortened(annealed(outline, BEGIN_STEPS, 0))
    return repaired(outline, rng, outline.complete_ms)


def _round(outline: Outline, limit_ms: int, rng: np.random.Generator, number: int) -> Outline:
    outline = repaired(_ruined(outline, rng), rng, limit_ms)
    outline = annealed(outline, ROUND_STEPS, number)
    if outline.missed:
        outline = repaired(outline, rng, limit_ms)
    return shortened(outline)


def _ruined(outline: Outline, rng: np.random.Generator) -> Outline:
    """Return the outline without a stop, one of the last with preference, and some of its neighbours."""
    names = [
        name for _, name in sorted((a.end_ms, a.place) for a in outline.plan.actions if a.name is ActionName.EXPLORE)
    ]
    if not names:
        return outline
    chosen = len(names) - 1 - int(len(names) * rng.random() ** 3)
    where = np.array([next(iter(outline.poses[name].values())) for name in names], dtype=np.float64)
    apart = np.hypot(*(where - where[chosen]).T)
    count = int(rng.integers(1, 1 + min(MOST_TAKEN, len(names))))
    near = np.argsort(apart, kind="stable")[:count]
    return outline.without(names[n] for n in near.tolist())


def annealed(outline: Outline, steps: int, number: int) -> Outline:
    """Return the outline with its errands in a better order, as far as that many steps find one."""
    if not outline.stops or not outline.errands:
        return outline
    task = encode(outline.situation)
    bound_ms = makespan_bound_ms(task) + EPSILON_MS
    search = Annealing(task, [events_of(outline.situation, outline.plan)], bound_ms, number)
    search.expect(steps)
    for done in range(0, steps, TURN):
        search.step(done / steps, TURN)
    return outline.with_plan(plan_of(outline.situation, search.events))

"""The clairvoyant's search for a fast plan: large neighbourhood search (ruin and repair) with restarts.

A round removes some stops (preferably those seen last, with their neighbours), inserts others at the least cost until
every cell is seen again, improves the order by the anytime engine's annealing, and shortens the tours. The next round
starts from the result if it is better or hardly worse. After `PATIENCE` rounds without improvement, the search restarts
from new viewpoints.

Restarts make the result less dependent on the seed: on the office with 1x1 and 3x2 robots, the only teams tried,
searches with different seeds ended up to 10 % apart without restarts and up to 3 % with them. The distance to the
optimum is unknown.

References
----------
P. Shaw, Using constraint programming and local search methods to solve vehicle routing problems, CP 1998.
"""

from collections.abc import Callable
from itertools import cycle, islice

import numpy as np

from marsupial.model import EPSILON_MS, ActionName, Role
from marsupial.planning.greedy import serve
from marsupial.planning.local_search.bounds import makespan_bound_ms
from marsupial.planning.local_search.encoding import encode, events_of, plan_of
from marsupial.planning.local_search.search import Annealing
from marsupial.strategies.clairvoyant.cover import cover, doors
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.tours import repaired, shortened

CARRIER_WORTH = (1.0, 3.0, 0.5)  # weight of a cell seen from a carrier in the initial covers, in turn; from a rover 1

PATIENCE = 12  # rounds without improvement before a restart
LATEST = 0.6  # share of the budget after which it returns to the best outline instead of restarting
COVERS = 2  # number of covers from which a restart takes the best
COVER_NOISE = 0.3  # greatest random increase of a site's value in a cover, as a share
BEGIN_STEPS, ROUND_STEPS, BATCH = 200, 30, 10  # annealing steps for each cover, for each round, and per batch
MOST_REMOVED = 8  # most stops that a round removes

AMBITION = 0.05  # repairs aim to be faster than the best by this share

TOLERANCE = 0.02  # a result worse than the best by this share may be the next start; it shrinks to 0

DRIVING_SHARE = 0.002  # cost of a ms of driving, relative to a ms until all is seen

Rate = tuple[int, float]


def best_outline(ground: Ground, used: Callable[[int], float], seed: int) -> Outline:
    """Return the best outline found; `used` returns the used share of the budget after a number of rounds."""
    rng = np.random.default_rng(seed)
    initial = (_initial(ground, worth, rng) for worth in cycle(CARRIER_WORTH))
    best = top = current = min(islice(initial, COVERS + 1), key=rate)
    done = futile = 0
    while (share := used(done)) < 1:
        if futile == PATIENCE:
            top = current = min(islice(initial, COVERS), key=rate) if share < LATEST else best
            futile = 0
        found = _round(current, round((1 - AMBITION) * top.complete_ms), rng, number=done)
        futile += 1
        if rate(found) < rate(top):
            top, futile = found, 0
        missed, cost = rate(top)
        if rate(found) <= (missed, cost * (1 + TOLERANCE * (1 - share))):
            current = found
        best = min(best, top, key=rate)
        done += 1
    return best


def fitted(outline: Outline, used: Callable[[int], float], seed: int) -> Outline:
    """Return an outline made for other ground, repaired to see every cell, then improved by the search."""
    rng = np.random.default_rng(seed)
    best = shortened(repaired(shortened(outline), rng, max(1, outline.complete_ms)))
    done = 0
    while best.stops and used(done) < 1:
        found = _round(best, round((1 - AMBITION) * best.complete_ms), rng, done)
        best = min(best, found, key=rate)
        done += 1
    return best


def rate(outline: Outline) -> Rate:
    """Return the cost of an outline: missed cells first, then completion time plus a little of the driving."""
    driving = sum(action.duration_ms for action in outline.plan.actions if action.origin is not None)
    return outline.missed.bit_count(), outline.complete_ms + DRIVING_SHARE * driving


def _initial(ground: Ground, carrier_worth: float, rng: np.random.Generator) -> Outline:
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
    """Return the outline without a random stop, preferably a late one, and some of its neighbours."""
    names = [
        name for _, name in sorted((a.end_ms, a.place) for a in outline.plan.actions if a.name is ActionName.EXPLORE)
    ]
    if not names:
        return outline
    # the cube of a uniform number is mostly near 0: late stops are chosen most often
    chosen = len(names) - 1 - int(len(names) * rng.random() ** 3)
    where = np.array([next(iter(outline.poses[name].values())) for name in names], dtype=np.float64)
    apart = np.hypot(*(where - where[chosen]).T)
    count = int(rng.integers(1, 1 + min(MOST_REMOVED, len(names))))
    near = np.argsort(apart, kind="stable")[:count]
    return outline.without(names[n] for n in near.tolist())


def annealed(outline: Outline, steps: int, number: int) -> Outline:
    """Return the outline with its errands in the best order that `steps` annealing steps find."""
    if not outline.stops or not outline.errands:
        return outline
    task = encode(outline.situation)
    bound_ms = makespan_bound_ms(task) + EPSILON_MS
    search = Annealing(task, [events_of(outline.situation, outline.plan)], bound_ms, number)
    search.expect(steps)
    for done in range(0, steps, BATCH):
        search.step(done / steps, BATCH)
    return outline.with_plan(plan_of(outline.situation, search.events))

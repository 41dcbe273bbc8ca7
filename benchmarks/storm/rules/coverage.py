"""Coverage: the areas of the end are those of the map, and "complete" means that nothing reachable is left."""

import re
from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import Account
from benchmarks.storm.ground import RIM, UNKNOWN, Document, TeamGround, beside


def is_enough(account: Account, event: Document) -> bool:
    """Return whether the scenario asks for no more than is explored."""
    enough = account.scenario["limits"].get("coverage", 1)
    then = re.match(r"([0-9.]+) % of the reachable area were explored when", event["reason"])
    if then is not None and account.zones.dated:  # zones have changed since what counts
        return float(then[1]) >= 100 * enough - 0.05
    return enough < 1 and event["explored_area_m2"] >= enough * event["reachable_area_m2"] - 1e-6


def areas_are_those_of_the_map(account: Account, event: Document) -> Iterator[str]:
    """Check the explored and the reachable area of the end."""
    if event["event"] != "ended":
        return
    team, lasting = [(robot.kind, robot.home) for robot in account.robots.values()], account.zones.lasting
    on_true = TeamGround(team, account.drawn, account.drawn, lasting)
    # ground for setting down a rover that no robot ever sees counts as out of reach
    on_known = TeamGround(team, account.known, account.truth, lasting)
    counts = ~account.zones.barred & account.zones.to_explore
    area, known = 1 / account.metre**2, account.known != UNKNOWN
    # parts no larger than a rover are left out where robots would have to search for them
    pockets = TeamGround(team, account.truth, account.truth, lasting).pockets() * area
    logged = event["explored_area_m2"], event["reachable_area_m2"]
    for reached in (ground.reach(slack) & counts for ground in (on_true, on_known) for slack in (0.0, RIM)):
        mine = (np.count_nonzero(known & reached) * area, np.count_nonzero(reached) * area)
        if all(-1e-5 <= ours - theirs <= pockets + 1e-5 for ours, theirs in zip(mine, logged, strict=True)):
            return
    yield f"explored and reachable area are {logged}, by the map {mine[0]:.4f}, {mine[1]:.4f}"


def all_that_is_reachable_is_known(account: Account, event: Document) -> Iterator[str]:
    """Check a complete mission: if the ground changed or robots were lost, by what robots could reach now."""
    if event["event"] != "ended" or event["status"] != "complete" or is_enough(account, event):
        return
    changed = account.zones.dated or "ground" in account.faults.what
    if not changed and not account.lost:
        if event["explored_area_m2"] != event["reachable_area_m2"]:
            yield f"is complete at {event['explored_area_m2'] / event['reachable_area_m2']:.1%} coverage"
        return
    ground = account.known_ground()
    unknown = (account.known == UNKNOWN) & ~account.zones.barred & account.zones.to_explore
    left = ground.reach(0.0) & ground.reach(RIM) & beside(unknown)
    flickers = any(frontier["reason"].startswith("flickers") for frontier in event["remaining"])
    if np.count_nonzero(left) > ground.pockets() and not flickers:
        y, x = np.argwhere(left)[0].tolist()
        yield f"is complete, but robots can still reach {(x, y)}, beside a cell that is not known"

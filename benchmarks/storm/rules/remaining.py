"""What a stop report says is left: frontiers are frontiers, and given up only if nobody could see what is behind."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.account import Account
from benchmarks.storm.ground import RIM, UNKNOWN, Document, around, beside, standable
from benchmarks.storm.logs import Cell
from benchmarks.storm.rules.motion import FLICKER_CELLS

GIVEN_UP = ("three looks", "three drives")

NAMED_CELLS = 4
"""How near to a frontier that is left the cell is by which the report names it, besides the robot's body."""


def remaining_frontiers_are_frontiers(account: Account, event: Document) -> Iterator[str]:
    """Check the frontiers that are left in the simulator, and that a reason is given for each."""
    if event["event"] != "ended":
        return
    drivable = set().union(*(kind["terrains"] for kind in account.kinds.values()))
    wide = 1 + math.floor(max(kind["radius"] for kind in account.kinds.values()))
    for frontier in event["remaining"]:
        x, y = frontier["cell"]  # unknown cells may keep the footprint from the cells beside it
        if account.known[y, x] not in drivable or not (account.known[around((x, y), wide)] == UNKNOWN).any():
            yield f"{(x, y)} is called a frontier that is left, but is none"
        if not frontier["reason"]:
            yield f"does not say why the frontier at {(x, y)} is left"


def what_is_left_is_named(account: Account, event: Document) -> Iterator[str]:
    """Check that a complete mission leaves nothing on a reported map except for what its report names."""
    enough = account.scenario["limits"].get("coverage", 1) < 1
    if event["event"] != "ended" or event["status"] != "complete" or enough:
        return
    left = _frontier(account) & ~_near(account.changes > 0, FLICKER_CELLS)
    if np.count_nonzero(left) <= account.known_ground().pockets():
        return
    named = np.zeros(left.shape, dtype=bool)
    for x, y in (frontier["cell"] for frontier in event["remaining"]):
        named[y, x] = True
    named = _near(named, math.ceil(NAMED_CELLS + max(kind["radius"] for kind in account.kinds.values())))
    for cluster in _clusters(left):
        if not any(named[y, x] for x, y in cluster):
            yield f"is complete, but robots can still reach {cluster[0]}, beside a cell that is not known"
            return


def what_is_given_up_was_not_seen(account: Account, event: Document) -> Iterator[str]:
    """Check that what is given up on a reported map could not be seen: only a late report is no reason."""
    if event["event"] != "ended" or account.reported is None:
        return
    wide = NAMED_CELLS + math.ceil(max(kind["radius"] for kind in account.kinds.values()))
    distortion, seen = account.reported.distortion, account.reported.known != UNKNOWN
    excused = distortion.hidden | (distortion.flickers & (distortion.wrong > 0)) | (account.changes > 0)
    for frontier in event["remaining"]:
        x, y = frontier["cell"]
        if not account.holds((x, y)):
            yield f"the frontier at {(x, y)} is not in the frame"
            continue
        corners = ((x + u, y + v) for u in (-wide, wide) for v in (-wide, wide))
        beyond = account.reported.open_edges and not all(map(account.holds, corners))  # unknown cells are there
        if beyond or not frontier["reason"].startswith(GIVEN_UP):
            continue
        window = around((x, y), wide)
        unknown = account.known[window] == UNKNOWN
        if not unknown.any():
            yield f"the frontier at {(x, y)} is given up, but all cells there are known"
        elif not (unknown & ~(seen & ~excused)[window]).any():
            yield f"the frontier at {(x, y)} is given up, but robots have seen all cells there"


def _frontier(account: Account) -> NDArray[np.bool_]:
    """Return the reachable cells from which only unknown ones to be explored keep a robot from going on by one."""
    barred, wanted = account.zones.barred, (account.known == UNKNOWN) & account.zones.to_explore
    # unknown cells to be explored count as floor that all can drive on
    hoped = np.where(barred, np.uint8(0), np.where(wanted, np.uint8(1), account.known))
    found, ground = np.zeros(hoped.shape, dtype=bool), account.known_ground()
    for (kind, exact), (_, slack) in zip(ground.reaches(0.0), ground.reaches(RIM), strict=True):
        could = standable(kind | {"terrains": [*kind["terrains"], 1]}, hoped, 0.0)
        found |= exact & slack & beside(could & ~standable(kind, account.known))
    return found


def _near(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Return the cells within some columns and rows of those of a mask."""
    found = np.zeros_like(mask)
    for y, x in np.argwhere(mask).tolist():
        found[around((x, y), reach)] = True
    return found


def _clusters(mask: NDArray[np.bool_]) -> Iterator[list[Cell]]:
    """Yield the cells of a mask in groups, no more than two columns and rows apart."""
    left = {(x, y) for y, x in np.argwhere(mask).tolist()}
    while left:
        cluster = [left.pop()]
        for x, y in cluster:
            near = {(x + u, y + v) for u in range(-2, 3) for v in range(-2, 3)} & left
            left -= near
            cluster += sorted(near)
        yield cluster

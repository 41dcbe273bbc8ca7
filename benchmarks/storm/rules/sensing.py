"""Sensing: what is seen is true, new, and in range of a robot that was there; cells in plain view are seen."""

import math
from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import Account
from benchmarks.storm.ground import BLOCKS_SIGHT, UNKNOWN, Document, around, inside
from benchmarks.storm.logs import Cell


def what_is_seen_is_true(account: Account, event: Document) -> Iterator[str]:
    """Check what is seen for the first time, and what has changed."""
    if event["event"] not in ("reveal", "change"):
        return
    name, new, again = event["robot"], event["event"] == "reveal", set[Cell]()
    for (x, y), code in event["seen"]:
        if not account.holds((x, y)):
            yield f"{name} sees {(x, y)}, which is not on the map"
            continue
        before, truth = account.known[y, x], account.truth[y, x]
        # what is revealed and changes in one moment is written twice, as it is after the change
        is_same = before == code and account.seen_ms[y, x] != event["t_ms"]
        if (before == UNKNOWN) != new or is_same or (new and (x, y) in again):
            yield f"{name} sees {code} at {(x, y)}, which was {before}"
        if code not in (UNKNOWN, truth) and not _may_be_seen(account, event["t_ms"], (x, y), code):
            yield f"{name} sees {code} at {(x, y)}, where {truth} is"
        if account.reported is not None and account.reported.distortion.hidden[y, x] and code != UNKNOWN:
            yield f"{name} sees {(x, y)}, which is never reported"
        again.add((x, y))


def _may_be_seen(account: Account, t_ms: int, cell: Cell, code: int) -> bool:
    """Return whether a cell may be seen as what it was not so far: it may have changed, or be reported wrongly."""
    if account.reported is None:
        return account.faults.may_become(t_ms, cell, code)
    distortion = account.reported.distortion
    wrong = distortion.wrong > 0 and distortion.flickers[cell[1], cell[0]]
    return bool(wrong or distortion.shifts > 0 or "ground" in account.faults.what)


def what_is_seen_is_in_range(account: Account, event: Document) -> Iterator[str]:
    """Check where the robots were that saw something, and how far off it was."""
    if event["event"] != "reveal":
        return
    name, t_ms = event["robot"], event["t_ms"]
    robot = account.robots[name]
    if robot.carrier is not None:
        yield f"{name} sees aboard {robot.carrier}"
        return
    if name in account.contacts.away:
        yield f"what {name} sees out of contact is known"
    if robot.drive and account.is_inexact(name):
        return
    places = account.contacts.way(name, t_ms) + [at for ms, at in robot.passed if abs(ms - t_ms) <= 1]
    if not robot.drive and robot.cell is not None:
        places.append(robot.cell)
    # at least its body's reach one cell further on
    reach = max(robot.kind["range"], robot.kind["radius"] + math.sqrt(2)) + 1e-6
    far = [at for at, _ in event["seen"] if all(math.dist(at, place) > reach for place in places)]
    if far:
        yield f"{name} at {places or 'no cell of its drive'} sees {far[0]}, out of its range of {reach:.2f} cells"


def what_is_in_plain_view_is_seen(account: Account, event: Document) -> Iterator[str]:
    """Check at the end that nothing stays unknown near which no straight line of sight was blocked."""
    if event["event"] != "ended" or account.faults.what & {"missed_cells", "ground", "joins"}:
        return
    for name, robot in account.robots.items():
        if "sensor_angle_deg" in robot.kind:
            continue
        away = account.contacts.away.get(name)  # nobody knows what it has seen since
        for cell in dict.fromkeys(at for _, at in robot.visits[: None if away is None else away.visits]):
            missed = _missed(account, cell, robot.kind["range"])
            if missed is not None:
                yield f"{name} was at {cell} and did not see {missed}, in plain view"
                break


def _missed(account: Account, cell: Cell, radius: float) -> Cell | None:
    rows, columns = around(cell, math.floor(radius))
    for v, u in np.argwhere(account.known[rows, columns] == UNKNOWN).tolist():
        there = (columns.start + u, rows.start + v)
        if math.dist(cell, there) <= radius - 1e-6 and _is_plain(account, cell, there):
            return there
    return None


def _is_plain(account: Account, here: Cell, there: Cell) -> bool:
    """Return whether no cell within one cell of the line between two cells, except `there`, blocks sight."""
    steps = max(abs(there[0] - here[0]), abs(there[1] - here[1])) * 2
    for k in range(steps + 1):
        x = here[0] + (there[0] - here[0]) * k / max(1, steps)
        y = here[1] + (there[1] - here[1]) * k / max(1, steps)
        for v in range(math.floor(y - 0.5), math.ceil(y + 0.5) + 1):
            for u in range(math.floor(x - 0.5), math.ceil(x + 0.5) + 1):
                beside = (u, v) != there and inside(account.truth, (u, v))
                if beside and account.truth[v, u] in BLOCKS_SIGHT and math.dist((u, v), (x, y)) < 1.0:
                    return False
    return True

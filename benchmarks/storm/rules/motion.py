"""Motion: step by step, no cutting of corners, where the footprint fits, over known cells, at the speed of the type."""

from collections.abc import Iterator
from itertools import pairwise

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document, around, footprint, moves, standable
from benchmarks.storm.logs import Cell

FLICKER_CELLS = 3
"""Cells this near to one that has changed may keep a value in plans that is not the reported one."""


def drives_begin_rightly(account: Account, event: Document) -> Iterator[str]:
    """Check that robots that set out may drive, and do so from where they stand."""
    if event["event"] != "drive":
        return
    name, robot, away = event["robot"], account.robots[event["robot"]], account.contacts
    if robot.carrier is not None or robot.lost:
        yield f"{name} drives {'aboard ' + robot.carrier if robot.carrier else 'but is lost'}"
    if robot.stuck_until > event["t_ms"]:
        yield f"{name} drives, but is stuck until {robot.stuck_until} ms"
    if account.started.get(name, {"name": "move"})["name"] in ("dock", "undock"):
        yield f"{name} drives while it docks or undocks"
    late = account.reported is not None and name in away.once_away  # its last drives may never be reported
    if robot.cell != event["cell"] and not robot.drive and not late:
        yield f"{name} sets out from {event['cell']}, but stands at {robot.cell}"
    entered = account.zones.entered(footprint(robot.kind), event["way"])
    if entered is not None and name not in away.away:
        yield f"{name} is to drive to {entered}, in a no-go zone"


def drives_are_true(account: Account, event: Document) -> Iterator[str]:
    """Check drives on the true map: each step is possible, and the robot is where it brings it by then."""
    if event["event"] == "drive":
        yield from _steps(account, event)
    if event["event"] == "drive" and account.robots[event["robot"]].drive:
        if account.faults.of(event["robot"], "slows"):
            yield from _stands(account, event)  # it goes on at another speed
        else:
            yield f"{event['robot']} sets out while it drives"
    if event["event"] == "stand":
        yield from _stands(account, event)


def robots_stand_where_they_fit(account: Account, event: Document) -> Iterator[str]:
    """Check that the footprints of robots that stand, or are being set down, are on ground that they can drive on."""
    stand: dict[str, Cell | None] = {}
    if event is account.first:
        stand = {name: robot.cell for name, robot in account.robots.items()}
    elif event["event"] == "stand":
        stand = {event["robot"]: event["cell"]}
    elif event["event"] == "start" and event["action"]["name"] == "undock":
        stand = {event["action"]["robot"]: event["cell"]}
    for name, cell in stand.items():
        if cell is not None and not account.fits(account.robots[name].kind)[cell[1], cell[0]]:
            yield f"{name} stands at {cell}, where its footprint does not fit"


def _steps(account: Account, event: Document) -> Iterator[str]:
    name, kind, way = event["robot"], account.robots[event["robot"]].kind, event["way"]
    known, unknown = standable(kind, account.known), list[Cell]()
    for k, (before, after) in enumerate(pairwise(way)):
        if after not in moves(account.fits(kind), before):
            yield f"{name} can't step from {before} to {after}"
        if not account.foresees and after not in moves(known, before):
            unknown = unknown or way[k:]
    if unknown and not _is_drift(account, name, unknown):
        yield f"{name} steps from {unknown[0]} to {unknown[1]} over cells that are not known yet"


def _is_drift(account: Account, name: str, cells: list[Cell]) -> bool:
    """Return whether noise can drive a robot on along cells: diagonally, then straight on, once for each fault."""
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(cells)]
    turns = sum(a != b for a, b in pairwise(steps))
    return turns < 2 * len(account.faults.of(name, "position_noise"))


def _stands(account: Account, event: Document) -> Iterator[str]:
    name, cell = event["robot"], event["cell"]
    if not account.is_inexact(name) and account.steps_made(name, cell, event["t_ms"]) is None:
        yield f"{name} stands at {cell}, where its drive does not bring it at that time"


def drives_are_over_known_cells(account: Account, event: Document) -> Iterator[str]:
    """Check drives on a reported map: each step is over ground that is known, or was before it changed."""
    if event["event"] != "drive":
        return
    name, kind, way = event["robot"], account.robots[event["robot"]].kind, event["way"]
    here = {(way[0][0] + u, way[0][1] + v) for u, v in footprint(kind)}
    for before, after in pairwise(way):
        passed = (after, (before[0], after[1]), (after[0], before[1]))
        for x, y in sorted({(at[0] + u, at[1] + v) for at in passed for u, v in footprint(kind)} - here):
            if not account.holds((x, y)):
                yield f"{name} is to drive to {after}, over {(x, y)}, which is not in the frame"
                return
            if account.known[y, x] not in kind["terrains"] and not _may_flicker(account, (x, y)):
                yield f"{name} is to drive to {after}, over {(x, y)}, which is {account.known[y, x]}"
                return


def _may_flicker(account: Account, cell: Cell) -> bool:
    """Return whether plans may take a cell for what it was: it has changed, or one near it has."""
    return bool(account.ever[cell[1], cell[0]] and account.changes[around(cell, FLICKER_CELLS)].any())

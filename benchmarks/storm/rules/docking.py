"""Docking: near enough, both robots at rest for the whole time, within capacity and seats; the carried don't act."""

from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import Account, robots_of
from benchmarks.storm.ground import BLOCKS_SIGHT, Document, dock_cells, footprint, has_places, near


def actions_begin_rightly(account: Account, event: Document) -> Iterator[str]:
    """Check that a robot does one thing at a time, and that docking robots stand near each other."""
    if event["event"] != "start":
        return
    action = event["action"]
    what, name, carrier = action["name"], action["robot"], action["carrier"]
    robot, spot = account.robots[name], event["cell"]
    for one in robots_of(action):
        if account.robots[one].lost:
            yield f"{one} starts to {what}, but is lost"
        if one in account.started:
            yield f"{one} starts to {what} before it ended what it did"
    if robot.carrier != (carrier if what == "undock" else None):
        yield f"{name} is to {what}, but is aboard {robot.carrier}"
    if carrier is None:
        return
    bearer = account.robots[carrier]
    if bearer.drive or robot.drive:
        yield f"{name} and {carrier} {what} while one of them drives"
    for kind, at in ((robot.kind, spot), (bearer.kind, bearer.cell)):
        if at is not None and account.zones.entered(footprint(kind), [(-99, -99), at]) is not None:
            yield f"{name} and {carrier} {what} in a no-go zone"
    if account.is_noisy(name) or account.is_noisy(carrier):
        return
    clear = ~account.zones.barred
    if account.reported is None:  # what is reported may be no wall
        clear &= ~np.isin(account.truth, BLOCKS_SIGHT)
    if bearer.cell is None or spot not in near(clear, [bearer.cell], dock_cells(bearer.kind, robot.kind)):
        yield f"{name} at {spot} and {carrier} at {bearer.cell} are too far apart"
    if what == "dock" and robot.cell != spot:
        yield f"{name} docks at {spot}, but is at {robot.cell}"


def rovers_have_places(account: Account, event: Document) -> Iterator[str]:
    """Check at each start and at the end that carriers have places for all rovers aboard."""
    if event["event"] not in ("mission", "start", "ended"):
        return
    for name, robot in account.robots.items():
        if not has_places(robot.kind, aboard := account.aboard(name)):
            yield f"{name} carries {[kind['name'] for kind in aboard]}"


def actions_end_rightly(account: Account, event: Document) -> Iterator[str]:
    """Check that robots end what they have started, and that dockings take their time."""
    if event["event"] != "end":
        return
    action, end = event["action"], event["end"]
    what, name, carrier = action["name"], action["robot"], action["carrier"]
    for one in robots_of(action):
        # A plan that continues an action gives it new times, and a target that moved has another name.
        started = account.started.get(one, {"name": None})["name"]
        without_route = end == "blocked" and carrier is None and started is None
        if started != what and not without_route:
            yield f"{one} ends a {what} that it did not start"
    robot = account.robots[name]
    if carrier is None or end != "done":
        return
    took = 0 if robot.docks_since is None else event["t_ms"] - robot.docks_since
    if took != (takes := robot.kind[f"{what}_ms"]):
        yield f"{name} took {took} ms to {what}, not {takes}"
    if what == "undock" and robot.cell != (at := account.meetings.get(action["place"], {}).get("rover_cell")):
        yield f"{name} is set down at {robot.cell}, not at {at}"

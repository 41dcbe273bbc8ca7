"""Plans: no robot does two things at once or acts aboard; targets and meeting points are those of the plan."""

from collections.abc import Iterator

from benchmarks.storm.account import Account, robots_of
from benchmarks.storm.ground import Document, has_places


def plans_are_valid(account: Account, event: Document) -> Iterator[str]:
    """Check the number and the places of a plan, and what robots are to do."""
    if event["event"] != "plan":
        return
    if event["revision"] != account.plans + 1:
        yield f"plan {account.plans + 1} is called {event['revision']}"
    for key, before in (("targets", account.targets), ("meetings", account.meetings)):
        unknown = (one for one in event[key] if isinstance(one, str) and one not in before)
        yield from (f"{one} did not stand in the plan before" for one in unknown)
    cells = {name: one["cell"] for name, one in account.listed("targets", event["targets"]).items() if one}
    for name, (x, y) in cells.items():
        if not account.holds((x, y)):
            yield f"target {name} is not in the frame"
        elif not account.ever[y, x] and not account.foresees:
            yield f"target {name} is at a cell that was never known"
        elif account.zones.barred[y, x]:
            yield f"target {name} is in a no-go zone"
    yield from _wrong_actions(account, event)


def _wrong_actions(account: Account, event: Document) -> Iterator[str]:
    """Yield where robots do two things at once, carried or lost ones act, or a carrier exceeds its capacity."""
    robots, lost = account.robots, account.lost
    targets = account.listed("targets", event["targets"])
    meetings = account.meetings | account.listed("meetings", event["meetings"])
    free_ms = dict.fromkeys(robots, 0)
    aboard = {name: robot.carrier for name, robot in robots.items()}
    for name, action in account.started.items():  # a docking in progress ends before the plan's actions
        if action["name"] == "dock" and action["robot"] == name:
            aboard[name] = action["carrier"]
    for action in sorted(event["actions"], key=lambda a: (a["start_ms"], a["start_ms"] + a["duration_ms"])):
        what, name, carrier, start = (action[key] for key in ("name", "robot", "carrier", "start_ms"))
        for one in robots_of(action):
            if one in lost:
                yield f"in the plan {one} is to {what}, but is lost"
            if free_ms[one] > start:
                yield f"in the plan {one} is to {what} at {start} ms, but is busy"
            free_ms[one] = start + action["duration_ms"]
        if carrier is None:
            if aboard[name] is not None:
                yield f"in the plan {name} is to {what} aboard {aboard[name]}"
            if what == "explore" and action["place"] not in targets:
                yield f"in the plan {name} explores {action['place']}, which is no target"
            continue
        if action["place"] not in meetings:
            yield f"in the plan {name} is to {what} at {action['place']}, no meeting point"
        if (aboard[name] == carrier) != (what == "undock"):
            yield f"in the plan {name} is to {what} while it is aboard {aboard[name]}"
        aboard[name] = carrier if what == "dock" else None
        held = [one for one, bearer in aboard.items() if bearer == carrier and not robots[one].lost]
        if not has_places(robots[carrier].kind, [robots[one].kind for one in held]):
            yield f"in the plan {carrier} carries {held}"

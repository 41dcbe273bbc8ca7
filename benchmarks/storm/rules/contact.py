"""Contact: rovers out of contact follow no later plan, and exactly those in range are in contact."""

from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.contact import in_range
from benchmarks.storm.ground import Document

SLACK_CELLS = 1.5  # robots may be at either end of a step


def contact_is_by_range(account: Account, event: Document) -> Iterator[str]:
    """Check who loses contact and regains it, and at each plan who is in contact."""
    name, away = event.get("robot", ""), account.contacts.away
    match event["event"]:
        case "away":
            if name in away or "radio" not in account.robots[name].kind:
                yield f"{name} can't lose contact"
            yield from _misjudged(account, event, {name: False})
        case "contact":
            if name not in away:
                yield f"{name} was in contact"
            yield from _misjudged(account, event, {name: True})
        case "plan" if not account.faults.what:  # a robot that was lost may not be known to be
            yield from _misjudged(account, event, {name: name not in away for name in account.robots})
        case "start":
            action = event["action"]
            last = away.get(action["robot"])
            if last is not None and (action["carrier"] is not None or event["revision"] > last.plan):
                yield f"{action['robot']} starts to {action['name']} by plan {event['revision']}, out of contact"


def _misjudged(account: Account, event: Document, in_contact: dict[str, bool]) -> Iterator[str]:
    """Yield the robots that are not in contact by their positions, or should be out of it."""
    if any(map(account.is_inexact, account.robots)) or account.lost:
        return
    kinds, t_ms = account.kinds.values(), event["t_ms"]
    near, far = (in_range(account.robots, kinds, t_ms, slack) for slack in (-SLACK_CELLS, SLACK_CELLS))
    for name, hears in in_contact.items():
        if name not in far if hears else name in near:
            yield f"{name} is {'in' if hears else 'out of'} contact"

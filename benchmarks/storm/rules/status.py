"""The status of the end: it follows from the goal of the mission, and the reason names who is left."""

import re
from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document
from benchmarks.storm.rules.coverage import is_enough


def status_is_true(account: Account, event: Document) -> Iterator[str]:
    """Check how the mission ends, and when."""
    if event["event"] != "ended":
        return
    status, reason = event["status"], event["reason"]
    limit_ms = round(account.scenario["limits"]["time_s"] * 1000)
    none_left = account.lost == account.robots.keys()
    called_back = account.reported is not None and account.reported.called_back
    # one that waits for a lost robot may reach its time limit
    known = ("complete", "stalled", "time_limit", "failed", *(["cancelled"] if called_back else []))
    if status not in known or ((status == "failed") != none_left and status not in ("time_limit", "cancelled")):
        yield f"ends {status}: {reason}"
    early = reason.startswith("called back before the time limit")
    if event["t_ms"] > limit_ms or (status == "time_limit" and event["t_ms"] != limit_ms and not early):
        yield f"ends {status}, the time limit is {limit_ms} ms"
    if not reason:
        yield "gives no reason"
    explained = account.reported is not None or account.faults.what or ", as batteries allow no more" in reason
    if reason.startswith("no progress after") and not explained:
        yield f"ends because plans led nowhere: {reason}"
    yield from _wrong_goal(account, event)


def _wrong_goal(account: Account, event: Document) -> Iterator[str]:
    """Yield where status and reason contradict the goal: to explore, and to bring robots back."""
    status, reason, explored_ms = event["status"], event["reason"], event["exploration_ms"]
    if explored_ms is not None and explored_ms > event["t_ms"]:
        yield f"exploration ends at {explored_ms} ms, after the mission"
    if status == "complete" and explored_ms is None and not is_enough(account, event):
        yield "is complete, but targets were left"
    left, unsure = _who_is_left(account, event)
    if status == "complete" and left:
        yield f"is complete, but {sorted(left)}: {reason}"
    named = set(re.findall(r"\S+ is not (?:aboard|home)", reason))
    if status in ("time_limit", "cancelled") and not left - unsure <= named <= left | unsure:
        yield f"by the log {sorted(left) or 'nobody is left'}: {reason}"
    lost = account.lost if account.reported is not None else set()  # they may have kept the others waiting
    if status == "stalled" and explored_ms is not None and not (left or lost) and " can't stand at " not in reason:
        yield f"stalls with nothing left to do: {reason}"


def _who_is_left(account: Account, event: Document) -> tuple[set[str], set[str]]:
    """Return who is not where the goal wants it, in the words of a reason, and for whom that is not known."""
    goal, left, unsure = account.scenario["goal"], set[str](), set[str]()
    for name, robot in account.robots.items():
        if robot.kind["role"] == "carrier":
            if goal["return_home"] and (robot.drive or robot.cell != robot.home):
                left.add(f"{name} is not home")
        elif (goal["return_home"] or goal["recover_rovers"]) and name not in event["aboard"]:
            left.add(f"{name} is not aboard")
        unheard = account.reported is not None and (robot.drive or name in account.contacts.away)
        if name in account.lost or unheard:  # its place may be unknown
            unsure |= {f"{name} is not aboard", f"{name} is not home"}
    return left, unsure

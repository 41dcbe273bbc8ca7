"""Failures: commands fail, and speeds change, only by a fault; a failed docking or undocking is undone."""

from collections.abc import Iterator

from benchmarks.storm.account import Account, robots_of
from benchmarks.storm.ground import Document


def failures_have_causes(account: Account, event: Document) -> Iterator[str]:
    """Check that a command failed, or a robot drives at another speed, by a fault."""
    if event["event"] == "speed":
        yield from _speed(account, event)
    if event["event"] != "end":
        return
    action, end = event["action"], event["end"]
    carrier, what = action["carrier"], f"{action['name']} of {action['robot']}"
    of_two = ("declines", "docking_fails", "lost", "position_noise", "ground")
    causes = ("stuck", "declines", "ground") if carrier is None else of_two
    if end == "failed" and not any(account.faults.of(name, *causes) for name in robots_of(action)):
        yield f"{what} failed, though no fault was asked for"
    if carrier is not None and end != "done" and (not account.faults.what or end not in ("failed", "lost")):
        yield f"{what} ended as {end}"


def _speed(account: Account, event: Document) -> Iterator[str]:
    name, share, faults = event["robot"], event["share"], account.faults
    # a lost robot says what speed it has when it, or its carrier, returns, and one out of contact when it is heard
    both = [name, *([] if account.robots[name].carrier is None else [str(account.robots[name].carrier)])]
    back = any(faults.happen(event["t_ms"], one, "returns", "joins") for one in both)
    known = name in account.contacts.once_away or faults.happen(event["t_ms"], name, "slows") or back
    asked = known and share in [fault["speed_share"] for fault in faults.of(name, "slows")]
    if not asked and not faults.understate(name):
        yield f"{name} changes its speed to {share}, though no fault was asked for"

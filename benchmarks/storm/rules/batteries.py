"""Batteries: the charges that a plan begins with are those of the drives, waits and charging before."""

from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document


def charges_are_true(account: Account, event: Document) -> Iterator[str]:
    """Compare the charges of robots without a command with the account's own."""
    if event["event"] != "plan" or any(map(account.is_inexact, account.robots)):
        return
    for name, share in event.get("charges", ()):
        robot = account.robots[name]
        unsure = robot.lost or robot.drive or name in account.started or name in account.contacts.away
        if unsure or account.faults.of(name, "stuck"):
            continue  # a robot that is stuck reports the charge that it will have when it is free
        mine = max(0.0, account.charges.level_j(name, robot)) / robot.kind["battery"]["capacity_j"]
        if abs(mine - share) > 0.002:
            yield f"{name} has a charge of {share}, not {mine:.4f}"

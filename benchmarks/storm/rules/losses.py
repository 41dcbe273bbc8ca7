"""Losses: robots are lost and return only by a fault, an empty battery, failures, or with their carrier."""

from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.contact import MISSING
from benchmarks.storm.ground import Document


def losses_have_causes(account: Account, event: Document) -> Iterator[str]:
    """Check who is lost, and who returns, in the simulator."""
    if event["event"] not in ("lost", "returned"):
        return
    name, t_ms, faults, contacts = event["robot"], event["t_ms"], account.faults, account.contacts
    robot = account.robots[name]
    names = [name, *([] if robot.carrier is None else [robot.carrier])]
    happens = ("lost",) if event["event"] == "lost" else ("returns", "joins")
    late = name in contacts.once_away and bool(faults.of(name, happens[0]))  # it is known once the robot is heard of
    caused = any(faults.happen(t_ms, one, *happens) for one in names)
    if event["event"] == "returned":
        if name not in contacts.missing and not late and not (robot.lost and caused):
            yield f"{name} returns, though no fault was asked for"
        return
    if event["reason"] == MISSING and name in contacts.away:
        return
    caused |= late or (t_ms == 0 and any(faults.of(one, "joins") for one in names))
    if event["reason"].endswith("empty battery") and names[-1] not in contacts.once_away:
        yield from _not_empty(account, names[-1])
        caused |= _may_run_empty(account, names[-1])
    elif event["reason"].endswith("empty battery"):
        caused = True  # nobody knows when it is picked up
    if not caused:
        yield f"{name} is lost, though no fault was asked for: {event['reason']}"


def _not_empty(account: Account, name: str) -> Iterator[str]:
    robot, exact = account.robots[name], not any(map(account.is_inexact, account.robots))
    level_j = account.charges.level_j(name, robot)
    if exact and level_j > 0.02 * robot.kind["battery"]["capacity_j"]:
        yield f"{name} is lost with a charge of {level_j:.1f} J"


def _may_run_empty(account: Account, name: str) -> bool:
    """Return whether something went wrong for a robot with a battery: plans keep rovers charged."""
    asked, robots = account.scenario, account.robots.values()
    changes = account.faults.what or asked.get("zones") or asked["planning_time"] == "charged"
    on_ground = any(robot.kind["role"] == "rover" and robot.home is not None for robot in robots)
    return bool(changes) or on_ground or account.robots[name].kind["role"] == "carrier"


def losses_on_reported_maps_have_causes(account: Account, event: Document) -> Iterator[str]:
    """Check who is lost, where robots report their own map."""
    if event["event"] != "lost" or account.reported is None:
        return
    name, reason, distortion = event["robot"], event["reason"], account.reported.distortion
    fails = distortion.wrong or distortion.shifts or account.faults.what or account.scenario.get("zones")
    empty = any("battery" in kind for kind in account.kinds.values()) and "empty battery" in reason
    missing = reason == MISSING and name in account.contacts.once_away
    failed = reason.startswith("failed 3 times in a row") and fails
    carrier = account.robots[name].carrier
    with_carrier = carrier in account.lost and reason == f"aboard {carrier}, which is lost"
    if not (account.faults.what & {"lost", "joins"} or empty or missing or failed or with_carrier):
        yield f"{name} is lost, though nothing went wrong: {reason}"

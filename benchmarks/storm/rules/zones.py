"""Zones: they begin and end when they should, nobody enters a no-go zone that holds, targets lead into the area."""

from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import UNKNOWN, Document, TeamGround, disc, footprint


def zones_hold(account: Account, event: Document) -> Iterator[str]:
    """Check that zones come and go, and at the end that nobody went on in one."""
    if event["event"] == "zone":
        yield from account.zones.wrong(event)
    if event["event"] != "ended":
        return
    yield from account.zones.missing(event["t_ms"])
    for name, robot in account.robots.items():
        # who misses its goals may end in a zone, and who is out of contact does not hear of it in time
        if account.is_noisy(name) or name in account.contacts.once_away:
            continue
        visits = [*robot.visits, *(one for one in robot.passed if one[0] <= event["t_ms"])]
        if account.reported is not None:
            visits = [(t_ms, cell) for t_ms, one, cell in account.reported.stood if one == name]
        wrong = account.zones.trespass(footprint(robot.kind), visits, event["t_ms"])
        yield from (f"{name} {what}" for what in wrong)


def targets_lead_into_the_area(account: Account, event: Document) -> Iterator[str]:
    """Check that no target leads out of the area to explore, once one leads into it.

    Before, robots look for a way there; afterwards, for ground to set rovers down on.
    """
    area, leads = account.zones.to_explore, {}
    rovers = any(robot.kind["role"] == "rover" for robot in account.robots.values())
    if event["event"] != "plan" or not rovers or area.all():
        return
    for name, target in account.listed("targets", event["targets"]).items():
        if not target:
            continue
        # the cells that a robot touches there, and those beside them
        (x, y), widest = target["cell"], max(account.kinds[kind]["radius"] for kind in target["explorers"])
        beside = filter(account.holds, ((x + u, y + v) for u, v in disc(widest + 1 + 1e-6)))
        unknown = [(u, v) for u, v in beside if account.known[v, u] == UNKNOWN and not account.zones.barred[v, u]]
        leads[name] = not unknown or any(area[v, u] for u, v in unknown)
    if all(leads.values()) or not any(leads.values()):
        return
    team = [(robot.kind, robot.cell) for robot in account.robots.values()]
    there = TeamGround(team, account.known, account.truth, account.zones.barred).reach(0.0)
    if (there & area).any():
        yield from (f"target {name} leads out of the area to explore" for name, into in leads.items() if not into)

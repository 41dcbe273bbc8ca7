"""Totals: counts, robots, distances and energy of the end are those of the events; the summary says the same."""

import re
from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document

SUMMARY = ("status", "reason", "deployments", "retrievals", "replans", "explored_area_m2", "reachable_area_m2")
"""The fields that the end of a log and the summary of its mission share."""


def counts_are_those_of_the_log(account: Account, event: Document) -> Iterator[str]:
    """Check counts, who is aboard, that lost robots are named, and the summary."""
    if event["event"] != "ended":
        return
    for key, mine in (
        ("deployments", account.deployed),
        ("retrievals", account.retrieved),
        ("replans", account.plans),
    ):
        if event[key] != mine:
            yield f"{key} is {event[key]}, by the log {mine}"
    there = account.robots.keys() - account.lost  # the place of a rover lost while it was set down is unknown
    aboard = sorted(name for name in there if account.robots[name].carrier is not None)
    if sorted(there.intersection(event["aboard"])) != aboard:
        yield f"aboard are {event['aboard']}, by the log {aboard}"
    lost = [name for name in account.robots if name not in there]
    names_all = set(lost) <= set(re.findall(r"[\w.-]+", event["reason"]))
    if event.get("lost", []) != lost or (event["status"] != "failed" and not names_all):
        yield f"lost are {event.get('lost', [])}, by the log {lost}: {event['reason']}"
    for key in SUMMARY:
        if account.summary is not None and account.summary[key] != event[key]:
            yield f"the summary's {key} is {account.summary[key]}"


def metres_and_energy_are_true(account: Account, event: Document) -> Iterator[str]:
    """Check how far robots have driven, and the energy that they used."""
    if event["event"] != "ended":
        return
    logged_m, logged_j = dict(map(tuple, event["distance_m"])), dict(map(tuple, event["energy_j"]))
    for name, robot in account.robots.items():
        once_away = name in account.contacts.once_away
        if account.reported is None:
            metres, driving_ms = robot.distance_cells / account.metre, robot.driving_ms
            # the log lacks the distance of a drive that the end cut short
            unsure = bool(robot.drive) or account.is_inexact(name)
        else:
            metres, driving_ms = account.reported.driven[name]
            unsure = once_away or robot.lost_once
        if unsure:
            continue
        if abs(logged_m[name] - metres) > 0.002 + 1e-6 * metres:
            yield f"{name} drove {logged_m[name]} m, in truth {metres:.3f}"
        energy = robot.kind["energy"]
        used_j = energy["idle_w"] * (event["t_ms"] - robot.lost_ms) / 1000 + energy["drive_w"] * driving_ms / 1000
        used_j += energy["metre_j"] * metres
        late = once_away and account.faults.of(name, "lost")  # when it was lost is not in the log
        if abs(logged_j[name] - used_j) > 0.01 + 1e-3 * used_j and not late:
            yield f"{name} used {logged_j[name]} J, in truth {used_j:.3f}"

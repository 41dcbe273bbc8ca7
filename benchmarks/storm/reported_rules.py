"""What must hold at every event of a mission whose robots report their own map, however wrong that map is.

A rule is a function of the log so far and the next event; it yields a sentence for all that is wrong with that event.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from benchmarks.storm.contact import MISSING
from benchmarks.storm.distortion import Distortion
from benchmarks.storm.ground import UNKNOWN, Document
from benchmarks.storm.logs import Cell, route
from benchmarks.storm.plans import has_places, wrong_in_plan
from benchmarks.storm.reported_log import ReportedLog
from marsupial.model.grid import CellArray

ReportedRule = Callable[[ReportedLog, Document], Iterator[str]]

MOST_EXPLORES = 15
"""How often a robot may explore one target without news: three looks, and three more each time that it changes."""

MOST_PLANS = 60
"""How many plans may follow each other without any news, and without an action that is done."""

FLICKER_CELLS = 3
"""Cells this near to one that has changed may keep a value in plans that is not the reported one."""


def time_goes_on(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that time does not go back."""
    if event["t_ms"] < log.t_ms:
        yield "time goes back"


class ReportedSight:
    """Checks that the log has what is reported: cells once, and truly where nothing distorts them."""

    def __init__(self, truth: CellArray, distortion: Distortion, *, changing: bool) -> None:
        self._truth, self._hidden = truth, distortion.hidden
        wrong = distortion.flickers if distortion.wrong else np.zeros(truth.shape, dtype=bool)
        self._untrue = wrong | (changing or distortion.shifts > 0)

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        if event["event"] not in ("reveal", "change"):
            return
        for name, (x, y), code in log.looks(event):
            if not log.holds((x, y)):
                yield f"{name} sees {(x, y)}, which is not in the frame"
                return
            before = log.known[y, x]
            if (before == UNKNOWN) != (event["event"] == "reveal") or before == code:
                yield f"{name} sees {code} at {(x, y)}, which was {before}"
            if code != UNKNOWN and self._hidden[y, x]:
                yield f"{name} sees {(x, y)}, which is never reported"
            if code not in (UNKNOWN, self._truth[y, x]) and not self._untrue[y, x]:
                yield f"{name} sees {code} at {(x, y)}, where {self._truth[y, x]} is"


def plans_are_valid(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that robots do one thing at a time, and that lost and carried ones do nothing."""
    if event["event"] != "plan":
        return
    if event["revision"] != log.plans + 1:
        yield f"plan {log.plans + 1} is called {event['revision']}"
    places = []
    for key, before in (("targets", log.targets), ("meetings", log.meetings)):
        names = {one if isinstance(one, str) else one["name"] for one in event[key]}
        kept = {one for one in event[key] if isinstance(one, str)}
        yield from (f"{one} did not stand in the plan before" for one in sorted(kept - before.keys()))
        places.append(names | (log.meetings.keys() if key == "meetings" else set()))
    yield from wrong_in_plan(event, log.robots, log.started, (places[0], places[1]), log.missing)
    for target in (one for one in event["targets"] if isinstance(one, dict)):
        x, y = log.true_cell(target["cell"])
        if not log.holds((x, y)):
            yield f"target {target['name']} is not in the frame"
        elif not log.ever[y, x]:
            yield f"target {target['name']} is at a cell that was never known"
        elif log.zones.barred[y, x]:
            yield f"target {target['name']} is in a no-go zone"


def drives_are_possible(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that robots drive step by step over ground that is known, or was before it changed."""
    if event["event"] != "drive":
        return
    name, robot = event["robot"], log.robots[event["robot"]]
    if robot.carrier is not None or robot.lost:
        yield f"{name} drives {'aboard ' + robot.carrier if robot.carrier else 'but is lost'}"
    action = log.started.get(name, {"name": "move"})
    if action["name"] in ("dock", "undock"):
        yield f"{name} drives while it is to {action['name']}"
    way = route(log.true_cell(event["cell"]), event["steps"])
    if robot.cell != way[0] and not robot.drive and name not in log.parted:
        yield f"{name} sets out from {way[0]}, but stands at {robot.cell}"
    if name not in log.away:
        offsets = log.under(robot.kind, (0, 0))
        if (entered := log.zones.entered(offsets, way)) is not None:
            yield f"{name} is to drive to {entered}, in a no-go zone"
    here = set(log.under(robot.kind, way[0]))
    for before, after in pairwise(way):
        beside = [(before[0], after[1]), (after[0], before[1])]
        cells = {at for cell in (after, *beside) for at in log.under(robot.kind, cell)} - here
        for x, y in sorted(cells):
            if not log.holds((x, y)):
                yield f"{name} is to drive to {after}, over {(x, y)}, which is not in the frame"
                return
            if log.known[y, x] not in robot.kind["terrains"] and not may_flicker(log, (x, y)):
                yield f"{name} is to drive to {after}, over {(x, y)}, which is {log.known[y, x]}"
                return


def may_flicker(log: ReportedLog, cell: Cell) -> bool:
    """Return whether plans may take a cell for what it was: it has changed, or one near it has."""
    x, y = cell
    reach = FLICKER_CELLS
    near = log.changes[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
    return bool(log.ever[y, x]) and bool(near.any())


def dockings_are_possible(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that robots dock near each other, at rest, and that carried ones do nothing else."""
    if event["event"] != "start":
        return
    action = event["action"]
    name, carrier, robot = action["robot"], action["carrier"], log.robots[action["robot"]]
    for one in filter(None, (name, carrier)):
        if log.robots[one].lost:
            yield f"{one} starts to {action['name']}, but is lost"
        if one in log.started:
            yield f"{one} starts to {action['name']} before it ended what it did"
    if carrier is None:
        if robot.carrier is not None:
            yield f"{name} is to {action['name']} aboard {robot.carrier}"
        return
    bearer = log.robots[carrier]
    if bearer.drive or robot.drive:
        yield f"{name} and {carrier} {action['name']} while one of them drives"
    if (robot.carrier == carrier) != (action["name"] == "undock"):
        yield f"{name} is to {action['name']} with {carrier}, but is aboard {robot.carrier}"
    at = log.true_cell(event["cell"])
    far = (bearer.kind["radius_m"] + robot.kind["radius_m"]) * log.metre + math.sqrt(2) + 1e-6
    noisy = any(fault["fault"] == "position_noise" for fault in log.scenario.get("faults", []))
    if bearer.cell is None or (math.dist(bearer.cell, at) > far and not noisy):
        yield f"{name} at {at} and {carrier} at {bearer.cell} are too far apart"
    if action["name"] == "dock":
        held = [one.kind for one in log.robots.values() if one.carrier == carrier and not one.lost]
        if not has_places(bearer.kind, [*held, robot.kind]):
            yield f"{carrier} has no place for {name}"


class Losses:
    """Checks that robots are lost only by a fault, an empty battery, three failures in a row, or with their carrier."""

    def __init__(self, scenario: Document, *, fails: bool) -> None:
        self._faults = {fault["fault"] for fault in scenario.get("faults", [])}
        self._batteries = any("battery" in kind for kind in scenario["robot_types"])
        self._fails = fails or bool(self._faults) or bool(scenario.get("zones"))

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        if event["event"] != "lost":
            return
        name, reason = event["robot"], event["reason"]
        by_fault = self._faults & {"lost", "joins"}
        empty = self._batteries and "empty battery" in reason
        missing = reason == MISSING and name in log.parted
        failed = reason.startswith("failed 3 times in a row") and self._fails
        carrier = log.robots[name].carrier
        aboard = carrier is not None and log.robots[carrier].lost and reason == f"aboard {carrier}, which is lost"
        if not (by_fault or empty or missing or failed or aboard):
            yield f"{name} is lost, though nothing went wrong: {reason}"


def zones_come_and_go(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that zones begin and end when they should, and at the end that nobody has entered one."""
    if event["event"] == "zone":
        yield from log.zones.change(event)
    if event["event"] != "ended":
        return
    yield from log.zones.missing(event["t_ms"])
    noisy = any(fault["fault"] == "position_noise" for fault in log.scenario.get("faults", []))
    for name, robot in log.robots.items():
        if noisy or name in log.parted:
            continue
        visits = [(t_ms, cell) for t_ms, one, cell in log.told.stood if one == name]
        under = log.under(robot.kind, (0, 0))
        yield from (f"{name} {fault}" for fault in log.zones.trespass(under, visits, event["t_ms"]))


class StormProgress:
    """Checks that robots do not explore the same for ever, and that plans lead somewhere."""

    def __init__(self) -> None:
        self._explores = Counter[tuple[str, Cell]]()
        self._plans = 0

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        match event["event"]:
            case "reveal":
                new = [cell for _, cell, _ in log.looks(event) if log.holds(cell) and not log.ever[cell[1], cell[0]]]
                if new:
                    self._explores.clear()
                    self._plans = 0
            case "lost" | "returned" | "zone" | "contact" | "away" | "speed" | "frame" | "change":
                self._plans = 0
            case "plan":
                self._plans += 1
                if self._plans == MOST_PLANS:
                    yield f"{MOST_PLANS} plans follow each other without any news"
            case "end" if event["end"] == "done":
                self._plans = 0
                action = event["action"]
                target = log.targets.get(action["place"], {}).get("cell")
                if action["name"] != "explore" or target is None:
                    return
                self._explores[action["robot"], target] += 1
                if self._explores[action["robot"], target] == MOST_EXPLORES:
                    yield f"{action['robot']} explores {target} {MOST_EXPLORES} times without any news"

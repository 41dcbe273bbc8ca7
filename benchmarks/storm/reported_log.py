"""The log of a mission whose robots report their own map, event by event; it knows no true map.

The frame of such a map grows, known cells change, and get lost. All cells are given as those of the true map: the
lower left cell of the first frame is known, and each `frame` event says how the next one lies to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.storm.account import Robot
from benchmarks.storm.contact import MISSING
from benchmarks.storm.ground import UNKNOWN, Document
from benchmarks.storm.logs import Cell, looked_at, route
from benchmarks.storm.reporting import Told
from benchmarks.storm.zones import ScenarioZones


class ReportedLog:
    """The known map, the robots and the plan after the events so far."""

    def __init__(self, scenario: Document, told: Told) -> None:
        shape = told.known.shape
        self.scenario, self.told = scenario, told
        self.metre = 1 / scenario["map"]["resolution_m"]
        self.corner = told.corner
        self.size = (0, 0)  # of the frame: columns, rows
        self.known = np.full(shape, UNKNOWN, dtype=np.uint8)
        self.ever = np.zeros(shape, dtype=bool)  # cells that were known at some time
        self.changes = np.zeros(shape, dtype=np.int64)  # how often known cells have changed or got lost
        self.kinds: dict[str, Document] = {}
        self.robots: dict[str, Robot] = {}
        self.homes: dict[str, Cell | None] = {}
        self.targets: dict[str, Document] = {}
        self.meetings: dict[str, Document] = {}
        self.started: dict[str, Document] = {}  # the action that each robot does
        self.parted: set[str] = set()  # rovers that were out of contact at some time
        self.away: set[str] = set()
        self.missing: set[str] = set()
        self.lost_once: set[str] = set()
        self.zones = ScenarioZones(scenario.get("zones", []), shape, self.metre)
        self.plans = self.deployed = self.retrieved = self.t_ms = 0

    def true_cell(self, cell: Sequence[int]) -> Cell:
        """Return a cell of the log as that of the true map."""
        return (cell[0] + self.corner[0], cell[1] + self.corner[1])

    def holds(self, cell: Cell) -> bool:
        """Return whether a cell of the true map is in the frame."""
        x, y = cell[0] - self.corner[0], cell[1] - self.corner[1]
        return 0 <= x < self.size[0] and 0 <= y < self.size[1]

    def under(self, kind: Document, cell: Cell) -> list[Cell]:
        """Return the cells under a robot."""
        radius = max(0.0, kind["radius_m"] * self.metre - 1e-6)
        reach = range(-math.floor(radius), math.floor(radius) + 1)
        return [(cell[0] + u, cell[1] + v) for u in reach for v in reach if u * u + v * v <= radius * radius]

    def looks(self, event: Document) -> list[tuple[str, Cell, int]]:
        """Return which robot saw which terrain where, in a `reveal` or `change`."""
        seen = looked_at(event["cells"], self.size[0])
        return [(event["robot"], self.true_cell(cell), code) for cell, code in seen]

    def apply(self, event: Document) -> None:
        """Go on by one event."""
        self.t_ms = event["t_ms"]
        apply = getattr(self, f"_on_{event['event']}", None)
        if apply is not None:
            apply(event)

    def _on_mission(self, event: Document) -> None:
        self.size = (event["width"], event["height"])
        self.kinds = {kind["name"]: kind for kind in event["types"]}
        for robot in event["robots"]:
            cell = None if robot["cell"] is None else self.true_cell(robot["cell"])
            self.robots[robot["name"]] = Robot(self.kinds[robot["type"]], cell, robot["carrier"])
            self.homes[robot["name"]] = cell

    def _on_frame(self, event: Document) -> None:
        self.size = (event["width"], event["height"])
        self.corner = (self.corner[0] - event["shift"][0], self.corner[1] - event["shift"][1])
        self.targets, self.meetings = {}, {}  # their names change

    def _on_reveal(self, event: Document) -> None:
        for _, (x, y), code in self.looks(event):
            self.known[y, x], self.ever[y, x] = code, True

    def _on_change(self, event: Document) -> None:
        for _, (x, y), code in self.looks(event):
            self.known[y, x] = code
            self.changes[y, x] += 1

    def _on_plan(self, event: Document) -> None:
        self.plans += 1
        self.targets = self._listed(event["targets"], self.targets)
        self.meetings |= self._listed(event["meetings"], self.meetings)

    def _listed(self, listed: list[Document | str], before: dict[str, Document]) -> dict[str, Document]:
        """Return the places of a plan by name; unchanged ones are given by name only."""
        found: dict[str, Document] = {}
        for one in listed:
            if isinstance(one, str):
                found[one] = before.get(one, {})
                continue
            cells = {
                key: self.true_cell(at) for key, at in one.items() if key in ("cell", "carrier_cell", "rover_cell")
            }
            found[one["name"]] = one | cells
        return found

    def _on_drive(self, event: Document) -> None:
        robot = self.robots[event["robot"]]
        robot.drive = route(self.true_cell(event["cell"]), event["steps"])
        robot.cell = robot.drive[0]

    def _on_stand(self, event: Document) -> None:
        robot = self.robots[event["robot"]]
        robot.cell, robot.drive = self.true_cell(event["cell"]), []

    def _on_start(self, event: Document) -> None:
        action = event["action"]
        for name in filter(None, (action["robot"], action["carrier"])):
            self.started[name] = action
        if action["name"] == "undock":
            rover = self.robots[action["robot"]]
            rover.carrier, rover.cell = None, self.true_cell(event["cell"])

    def _on_end(self, event: Document) -> None:
        action, done = event["action"], event["end"] == "done"
        for name in filter(None, (action["robot"], action["carrier"])):
            self.started.pop(name, None)
        rover = self.robots[action["robot"]]
        if action["name"] == "dock" and done:
            rover.carrier, rover.cell = action["carrier"], None
            self.retrieved += 1
        elif action["name"] == "undock" and done:
            self.deployed += 1
        elif action["name"] == "undock" and event["end"] == "failed":
            rover.carrier, rover.cell = action["carrier"], None

    def _on_lost(self, event: Document) -> None:
        self.robots[event["robot"]].lost = True
        self.lost_once.add(event["robot"])
        if event["reason"] == MISSING:
            self.missing.add(event["robot"])

    def _on_returned(self, event: Document) -> None:
        self.robots[event["robot"]].lost = False
        self.missing.discard(event["robot"])

    def _on_away(self, event: Document) -> None:
        self.away.add(event["robot"])
        self.parted.add(event["robot"])

    def _on_contact(self, event: Document) -> None:
        self.away.discard(event["robot"])

"""The account of a mission: everything that its log says of map, robots, plans and zones so far.

The account only follows the events; the rules (`rules`) judge each of them before it is applied. Its cells are those of
the true map: where robots report their own map, the lower left cell of the first frame is known, and each `frame` event
says how the next one lies to it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.charges import ChargeAccount
from benchmarks.storm.contact import MISSING, Contacts
from benchmarks.storm.distortion import Distortion, ReportedPicture
from benchmarks.storm.faults import ScenarioFaults
from benchmarks.storm.ground import UNKNOWN, Document, TeamGround, drawn_cells, inside, standable
from benchmarks.storm.logs import Cell, looked_at, route
from benchmarks.storm.robots import Robot
from benchmarks.storm.zones import ScenarioZones

CELLS = ("cell", "carrier_cell", "rover_cell")
"""The fields of a log that are cells."""


@dataclass(frozen=True, eq=False)
class ReportedMission:
    """A mission whose robots reported their own map: its log, and what is true of its robots and their reports."""

    lines: list[str]
    distortion: Distortion
    called_back: bool  # by its operator
    corner: Cell  # the true cell of the lower left one of the first frame
    open_edges: bool  # whether the map may grow
    known: NDArray[np.uint8]  # what robots in contact have seen
    stood: list[tuple[int, str, Cell]]  # when robots were reported where, in cells of the true map
    last: ReportedPicture  # the last reported map
    driven: Mapping[str, tuple[float, int]]  # how far each robot has driven, in metres, and for how long, in ms


def robots_of(action: Document) -> list[str]:
    """Return the names of the robots of an action: one, or a rover and a carrier."""
    return [name for name in (action["robot"], action["carrier"]) if name is not None]


class Account:
    """The state of a mission after the events so far; it begins with the first one.

    `summary` is what the product returned for a mission in its simulator, `reported` what is true of another one.
    """

    def __init__(
        self, scenario: Document, line: str, summary: Document | None, reported: ReportedMission | None
    ) -> None:
        self.scenario, self.summary, self.reported = scenario, summary, reported
        self.metre = 1 / scenario["map"]["resolution_m"]  # in cells
        self.drawn, self.truth = (drawn_cells(scenario["map"]["rows"]) for _ in range(2))  # at first, and now
        self.known = np.full_like(self.truth, UNKNOWN)
        self.ever = np.zeros(self.truth.shape, dtype=bool)  # cells that were known at some time
        self.seen_ms = np.full(self.truth.shape, -1, dtype=np.int64)  # when each cell was last revealed or changed
        self.changes = np.zeros(self.truth.shape, dtype=np.int64)  # how often known cells have changed or got lost
        self.corner = (0, 0) if reported is None else reported.corner
        self.targets: dict[str, Document] = {}
        self.meetings: dict[str, Document] = {}
        self.started: dict[str, Document] = {}  # the action that each robot does
        self.plans = self.deployed = self.retrieved = self.t_ms = 0
        self.faults = ScenarioFaults(scenario, self.metre)
        self.zones = ScenarioZones(scenario.get("zones", []), self.truth.shape, self.metre)
        self.contacts = Contacts()
        self.first = self.read(line)
        self.size = (self.first["width"], self.first["height"])  # of the frame
        self.foresees = self.first["strategy"] == "clairvoyant"  # whether the strategy is given the map
        self.kinds = {kind["name"]: self._in_cells(kind) for kind in self.first["types"]}
        self.charges = ChargeAccount([self._true_cell(cell) for cell in self.first.get("chargers", ())])
        self.robots: dict[str, Robot] = {}
        for one in self.first["robots"]:
            robot = Robot(self.kinds[one["type"]], one["cell"], one["carrier"], one["cell"])
            if robot.cell is not None:
                robot.stand(0, robot.cell)
            self.robots[one["name"]] = robot
        self._fits: dict[str, NDArray[np.bool_]] = {}

    # reading

    def read(self, line: str) -> Document:
        """Return the event of a line: its cells are those of the true map; a drive has its `way`, a look its `seen`."""
        event: Document = self._moved(json.loads(line))
        if event["event"] == "drive":
            event["way"] = route(event["cell"], event["steps"])
        if "cells" in event:
            event["seen"] = [(self._true_cell(at), code) for at, code in looked_at(event["cells"], self.size[0])]
        return event

    def _moved(self, part: Any) -> Any:
        if isinstance(part, list):
            return [self._moved(one) for one in part]
        if not isinstance(part, dict):
            return part
        return {key: self._true_cell(one) if key in CELLS and one else self._moved(one) for key, one in part.items()}

    def _true_cell(self, cell: Any) -> Cell:
        return (cell[0] + self.corner[0], cell[1] + self.corner[1])

    def _in_cells(self, kind: Document) -> Document:
        """Return a robot's type with its lengths in cells too."""
        lengths = {"radius": "radius_m", "range": "sensor_range_m", "radio": "radio_range_m"}
        return kind | {cells: kind[metres] * self.metre for cells, metres in lengths.items() if metres in kind}

    # questions that several rules ask

    def holds(self, cell: Cell) -> bool:
        """Return whether a cell of the true map is in the frame."""
        x, y = cell[0] - self.corner[0], cell[1] - self.corner[1]
        return 0 <= x < self.size[0] and 0 <= y < self.size[1] and inside(self.truth, cell)

    @property
    def lost(self) -> set[str]:
        """The robots that are lost, or given up as they were out of contact for too long."""
        return {name for name, robot in self.robots.items() if robot.lost} | self.contacts.missing

    def aboard(self, carrier: str) -> list[Document]:
        """Return the types of the rovers aboard a carrier."""
        return [robot.kind for robot in self.robots.values() if robot.carrier == carrier and not robot.lost]

    def is_noisy(self, name: str) -> bool:
        """Return whether a robot's drives end beside their goals."""
        return bool(self.faults.of(name, "position_noise"))

    def is_inexact(self, name: str) -> bool:
        """Return whether a robot's drives end beside their goals, or take longer than it says."""
        unheard = "radio" in self.robots[name].kind and self.faults.of(name, "slows")
        return self.is_noisy(name) or self.faults.understate(name) or bool(unheard)

    def fits(self, kind: Document) -> NDArray[np.bool_]:
        """Return where a type of robot can stand on the true map."""
        if kind["name"] not in self._fits:
            self._fits[kind["name"]] = standable(kind, self.truth)
        return self._fits[kind["name"]]

    def listed(self, key: str, listed: list[Document | str]) -> dict[str, Document]:
        """Return the `targets` or `meetings` of a plan by name; unchanged ones are given by name only."""
        before = self.targets if key == "targets" else self.meetings
        full = {one if isinstance(one, str) else one["name"]: one for one in listed}
        return {name: before.get(name, {}) if isinstance(one, str) else one for name, one in full.items()}

    def steps_made(self, name: str, cell: Cell, t_ms: int) -> int | None:
        """Return how many steps of its drive a robot has made that stands at a cell now; None if it can't be there."""
        robot = self.robots[name]
        passed = list(enumerate(robot.passed))
        fails = robot.lost or bool(self.faults.of(name, "stuck", "lost"))
        if fails:  # between two cells it counts as on the first
            arriving = [one for one in passed if abs(one[1][0] - t_ms) <= 1]  # it may have arrived or not
            passed = [one for one in passed if one[1][0] < t_ms - 1][-1:] + arriving
        return next((k for k, (ms, at) in passed if at == cell and (fails or abs(ms - t_ms) <= 1)), None)

    def known_ground(self) -> TeamGround:
        """Return what the robots, those that are lost included, can reach on the known map."""
        team = [(robot.kind, robot.cell) for robot in self.robots.values() if robot.cell or robot.carrier]
        sight = self.truth if self.reported is None else np.where(self.known == UNKNOWN, np.uint8(0), self.known)
        return TeamGround(team, self.known, sight, self.zones.barred)

    # what events change

    def pass_to(self, t_ms: int) -> None:
        """Let time pass until an event."""
        for robot in self.robots.values():
            robot.lost_ms += robot.lost * (t_ms - self.t_ms)
        self.charges.pass_to(t_ms, self.robots, self.started)

    def apply(self, event: Document) -> None:
        """Go on by one event."""
        self.t_ms = t_ms = event["t_ms"]
        name = event.get("robot", "")
        match event["event"]:
            case "reveal" | "change":
                self._see(event)
            case "plan":
                self.plans += 1
                self.targets = self.listed("targets", event["targets"])
                self.meetings |= self.listed("meetings", event["meetings"])
            case "drive":
                if self.robots[name].drive and self.faults.of(name, "slows"):
                    self._stand(event)  # it goes on at another speed
                self.robots[name].set_off(t_ms, event["way"], self.metre)
            case "stand":
                self._stand(event)
            case "start":
                self._start(event)
            case "end":
                self._end(event)
            case "lost":
                self._lose(event)
            case "returned" if name in self.contacts.missing:
                self.contacts.missing.remove(name)
            case "returned":
                self.robots[name].lost = False
            case "speed":
                self.robots[name].speed = event["share"]
            case "away":
                self.contacts.lose(name, self.robots[name], self.plans)
            case "contact":
                self.contacts.regain(name, self.robots[name], t_ms)
            case "zone":
                self.zones.change(event)
            case "frame":
                self.size = (event["width"], event["height"])
                self.corner = (self.corner[0] - event["shift"][0], self.corner[1] - event["shift"][1])

    def _see(self, event: Document) -> None:
        for cell, code in event["seen"]:
            if not self.holds(cell):
                continue
            x, y = cell
            self.known[y, x], self.ever[y, x] = code, True
            self.seen_ms[y, x] = event["t_ms"]
            self.changes[y, x] += event["event"] == "change"
            if code != self.truth[y, x] and self.faults.may_become(event["t_ms"], cell, code):
                self.truth[y, x] = code
                self._fits.clear()

    def _stand(self, event: Document) -> None:
        name, cell, t_ms = event["robot"], event["cell"], event["t_ms"]
        if self.is_inexact(name):
            self.robots[name].stand(t_ms, cell)
        else:
            self.robots[name].arrive(t_ms, cell, self.steps_made(name, cell, t_ms) or 0)

    def _start(self, event: Document) -> None:
        action: Document = event["action"]
        rover, carrier = self.robots[action["robot"]], self.robots.get(action["carrier"])
        self.started |= dict.fromkeys(robots_of(action), action)
        if carrier is None:
            return
        rover.docks_since = carrier.docks_since = event["t_ms"]
        if action["name"] == "undock":
            rover.carrier, rover.cell = None, event["cell"]

    def _end(self, event: Document) -> None:
        action, t_ms = event["action"], event["t_ms"]
        rover, end = self.robots[action["robot"]], event["end"]
        for name in robots_of(action):
            self.started.pop(name, None)
            for fault in self.faults.of(name, "stuck") if end == "failed" else ():
                if round(1000 * fault.get("at_s", 0)) == t_ms:
                    self.robots[name].stuck_until = t_ms + round(1000 * fault["for_s"])
        if action["carrier"] is None:
            return
        rover.docks_since = self.robots[action["carrier"]].docks_since = None
        if action["name"] == "dock" and end == "done":
            rover.carrier, rover.cell = action["carrier"], None
            self.retrieved += 1
        elif action["name"] == "undock" and end == "done" and rover.cell is not None:
            rover.stand(t_ms, rover.cell)
            self.deployed += 1
        elif action["name"] == "undock" and end == "failed":
            rover.carrier, rover.cell = action["carrier"], None

    def _lose(self, event: Document) -> None:
        name, robot = event["robot"], self.robots[event["robot"]]
        if event["reason"] == MISSING and name in self.contacts.away:
            self.contacts.missing.add(name)
            return
        self.charges.lose(name, robot, event["t_ms"])
        robot.lost, robot.lost_once, robot.docks_since = True, True, None

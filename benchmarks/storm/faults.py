"""The faults of a mission: robots are lost, return, fail and slow down, and the ground changes, only as asked for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.account import Robot
from benchmarks.storm.contact import MISSING
from benchmarks.storm.ground import UNKNOWN, Document
from benchmarks.storm.logs import Cell, looked_at
from benchmarks.storm.plans import PlanAccount


class FaultAccount(PlanAccount):
    """Checks what goes wrong against the faults of the scenario, and keeps the true ground up to date."""

    def __init__(self, scenario: Document, summary: Document) -> None:
        super().__init__(scenario, summary)
        terrains = [terrain["name"] for terrain in scenario.get("terrains", [])]
        self._codes = {name: code for code, name in enumerate(("obstacle", "floor", "rough", *terrains))}
        self._fits: dict[str, NDArray[np.bool_]] = {}  # where each type of robot can stand

    def _on_lost(self, event: Document) -> None:
        robot = self._robots[event["robot"]]
        if event["reason"] == MISSING and event["robot"] in self._contacts.away:
            self._contacts.missing.add(event["robot"])
            return
        names = [event["robot"], *([] if robot.carrier is None else [robot.carrier])]
        late = event["robot"] in self._contacts.parted and any(f["fault"] == "lost" for f in self._of(names[0]))
        absent = event["t_ms"] == 0 and any(fault["fault"] == "joins" for name in names for fault in self._of(name))
        empty = event["reason"].endswith("empty battery") and self._may_be_empty(event, names[-1])
        if not absent and not empty and not late and not any(self._has(event, name, "lost") for name in names):
            self._find(event, f"{event['robot']} is lost, though no fault was asked for: {event['reason']}")
        self._charges.lose(event["robot"], robot, event["t_ms"])
        robot.lost, robot.busy_until = True, None

    def _may_be_empty(self, event: Document, name: str) -> bool:
        """Return whether the battery of a robot is empty, and something went wrong: plans keep rovers charged."""
        if name in self._contacts.parted:
            return True  # nobody knows when it is picked up
        robot, exact = self._robots[name], not any(map(self._is_inexact, self._robots))
        if exact and self._charges.level_j(name, robot) > 0.02 * robot.kind["battery"]["capacity_j"]:
            self._find(event, f"{name} is lost with a charge of {self._charges.level_j(name, robot):.1f} J")
        rovers = [kind for kind, cell in self._team if cell is not None and kind["role"] == "rover"]
        changes = self._faults or self._scenario.get("zones") or self._scenario["planning_time"] == "charged"
        return bool(changes or rovers or robot.kind["role"] == "carrier")

    def _on_returned(self, event: Document) -> None:
        robot = self._robots[event["robot"]]
        if event["robot"] in self._contacts.missing:
            self._contacts.missing.remove(event["robot"])
            return
        names = [event["robot"], *([] if robot.carrier is None else [robot.carrier])]
        late = event["robot"] in self._contacts.parted and any(f["fault"] == "returns" for f in self._of(names[0]))
        if late:
            robot.lost = False
            return
        if not robot.lost or not any(self._has(event, name, "returns", "joins") for name in names):
            self._find(event, f"{event['robot']} returns, though no fault was asked for")
        robot.lost = False
        if robot.carrier is not None:
            self._hold(event, robot.carrier)

    def _has(self, event: Document, name: str, *faults: str) -> bool:
        """Return whether one of these faults happens to a robot at the time of an event, or may by chance."""
        t_ms, found = event["t_ms"], [fault for fault in self._of(name) if fault["fault"] in faults]
        return any("at_s" not in fault or round(1000 * fault["at_s"]) == t_ms for fault in found)

    def _judge_failure(self, event: Document) -> None:
        """Check that a command failed by a fault, and note how long its robot is stuck."""
        action, t_ms = event["action"], event["t_ms"]
        names = [name for name in (action["robot"], action["carrier"]) if name is not None]
        for name in names:
            for fault in self._of(name):
                if fault["fault"] == "stuck" and round(1000 * fault.get("at_s", 0)) == t_ms:
                    self._robots[name].stuck_until = t_ms + round(1000 * fault["for_s"])
        of_two = ("declines", "docking_fails", "lost", "position_noise", "ground")
        kinds = ("stuck", "declines", "ground") if action["carrier"] is None else of_two
        if not any(fault["fault"] in kinds for name in names for fault in self._of(name)):
            self._find(event, f"{action['name']} of {action['robot']} failed, though no fault was asked for")

    def _undo(self, event: Document, robot: Robot) -> None:
        """Undo a failed docking or undocking: the rover stays where it was; on the ground if its carrier was lost."""
        action = event["action"]
        if not self._faulty or event["end"] not in ("failed", "lost"):
            self._find(event, f"{action['name']} of {action['robot']} ended as {event['end']}")
        if event["end"] == "failed" and action["name"] == "undock":
            robot.carrier, robot.cell = action["carrier"], None
            self._hold(event, action["carrier"])

    def _on_speed(self, event: Document) -> None:
        name, share = event["robot"], event["share"]
        # a lost robot says what speed it has when it, or its carrier, returns, and one out of contact when it is heard
        back = any(self._has(event, one, "returns", "joins") for one in (name, self._robots[name].carrier) if one)
        told = name in self._contacts.parted or self._has(event, name, "slows") or back
        said = told and share in [fault.get("speed_share") for fault in self._of(name)]
        if not said and not self._is_slower_than_it_says(name):
            self._find(event, f"{name} changes its speed to {share}, though no fault was asked for")
        self._robots[name].speed = share

    def _on_change(self, event: Document) -> None:
        """Check that known cells became what a fault makes of them."""
        for (x, y), code in looked_at(event["cells"], self._known.shape[1]):
            if self._known[y, x] == UNKNOWN:
                self._find(event, f"{(x, y)} changes, but was not known")
            if not self._may_become(event["t_ms"], (x, y), code):
                self._find(event, f"{(x, y)} becomes {code}, though no fault was asked for")
            self._known[y, x] = code
            self._become((x, y), code)

    def _may_become(self, t_ms: int, cell: Cell, code: int) -> bool:
        """Return whether a fault may have given a cell this terrain by a time."""
        for fault in self._faults:
            if fault["fault"] != "ground" or round(1000 * fault.get("at_s", 0)) > t_ms:
                continue
            columns, rows = (sorted(math.floor(fault["area_m"][i] * self._metre) for i in (k, k + 2)) for k in (0, 1))
            inside = columns[0] <= cell[0] <= columns[1] and rows[0] <= cell[1] <= rows[1]
            if inside and self._codes[fault["terrain"]] == code:
                return True
        return False

    def _become(self, cell: Cell, code: int) -> None:
        self._truth[cell[1], cell[0]] = code
        for kind in self._kinds.values():
            self._fits[kind["name"]] = self._standable(kind, self._truth, slack=1e-6)

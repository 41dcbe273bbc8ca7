"""The totals of a mission's events, and whether its stop report agrees with them.

Status and reason must be true; areas, distances, energy and counts must match the events; "complete" must mean that
nothing reachable is left.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from benchmarks.storm.ground import UNKNOWN, Document, TrueGround, drawn_cells
from benchmarks.storm.logs import Cell
from benchmarks.storm.zones import ScenarioZones


@dataclass
class Robot:
    """The state of a robot by the log so far."""

    kind: Document
    cell: Cell | None
    carrier: str | None
    drive: list[Cell] = field(default_factory=list)
    passed_ms: list[int] = field(default_factory=list)
    busy_until: int | None = None
    distance_m: float = 0.0
    driving_ms: int = 0
    visits: list[tuple[int, Cell]] = field(default_factory=list)
    lost: bool = False
    off_ms: int = 0  # how long it was lost
    speed: float = 1.0  # share of its type's speed
    stuck_until: int = 0


class Account(TrueGround):
    """The robots and counts of a mission after its events so far; `findings` are the broken rules."""

    def __init__(self, scenario: Document, summary: Document) -> None:
        super().__init__(drawn_cells(scenario["map"]["rows"]), 1 / scenario["map"]["resolution_m"])
        self._faults: list[Document] = scenario.get("faults", [])
        self.findings: list[str] = []
        self._scenario, self._summary = scenario, summary
        self._robots: dict[str, Robot] = {}
        self._team: list[tuple[Document, Cell | None]] = []
        self._kinds: dict[str, Document] = {}
        self._deployed = self._retrieved = self._plans = 0
        self._faulty = bool(self._faults)
        self._unaware: set[str] = set()  # robots that did not hear of all zones in time
        self._zones = ScenarioZones(scenario.get("zones", []), self._truth.shape, self._metre)
        self._reachable = {slack: np.zeros_like(self._truth, dtype=bool) for slack in (0.0, 1e-6)}

    def _of(self, name: str) -> Iterator[Document]:
        """Yield the faults that may happen to a robot."""
        yield from (fault for fault in self._faults if fault.get("robot", name) == name)

    def _is_inexact(self, name: str) -> bool:
        """Return whether a robot's drives end beside their goals, or take longer than it says."""
        slows = "radio_range_m" in self._robots[name].kind and any(f["fault"] == "slows" for f in self._of(name))
        return self._is_noisy(name) or self._is_slower_than_it_says(name) or slows

    def _is_noisy(self, name: str) -> bool:
        return any(fault["fault"] == "position_noise" for fault in self._of(name))

    def _is_slower_than_it_says(self, name: str) -> bool:
        return any(not fault.get("reported", True) for fault in self._of(name))

    def _find(self, event: Document, what: str) -> None:
        self.findings.append(f"{event['event']} at {event['t_ms']} ms: {what}")

    def _on_ended(self, event: Document) -> None:
        self._judge_sight(event)
        area, known = 1 / self._metre**2, self._known != UNKNOWN
        # ground for setting down a rover that no robot ever sees counts as out of reach
        self._barred = self._zones.lasting
        seen = [self._reach(self._known, self._team, slack) for slack in self._reachable]
        # parts no larger than a rover are left out where robots would have to search for them
        pockets = self._pockets(self._truth, self._team) * area
        self._barred = self._zones.barred
        counts_now = ~self._barred & self._zones.inside
        for reachable in chain(self._reachable.values(), seen):
            counted = reachable & counts_now
            mine = (np.count_nonzero(known & counted) * area, np.count_nonzero(counted) * area)
            said = event["explored_area_m2"], event["reachable_area_m2"]
            if all(-1e-5 <= ours - theirs <= pockets + 1e-5 for ours, theirs in zip(mine, said, strict=True)):
                break
        else:
            self._find(event, f"explored and reachable area are {said}, by the map {mine[0]:.4f}, {mine[1]:.4f}")
        # the place of a rover lost while it was set down is unknown
        there = {name for name, robot in self._robots.items() if not robot.lost}
        aboard = sorted(name for name in there if self._robots[name].carrier is not None)
        counts = {"deployments": self._deployed, "retrievals": self._retrieved, "replans": self._plans}
        for key, mine_too in counts.items():
            if event[key] != mine_too:
                self._find(event, f"{key} is {event[key]}, by the log {mine_too}")
        if sorted(there.intersection(event["aboard"])) != aboard:
            self._find(event, f"aboard are {event['aboard']}, by the log {aboard}")
        lost = [name for name in self._robots if name not in there]
        if event.get("lost", []) != lost or (event["status"] != "failed" and not names_all(event["reason"], lost)):
            self._find(event, f"lost are {event.get('lost', [])}, by the log {lost}: {event['reason']}")
        self._judge_zones(event)
        self._judge_metres(event)
        self._judge_status(event, aboard, said[0] == said[1])
        self._judge_reason(event, aboard)

    def _judge_zones(self, event: Document) -> None:
        for fault in self._zones.missing(event["t_ms"]):
            self._find(event, fault)
        for name, robot in self._robots.items():
            if self._is_noisy(name):
                continue  # it may miss its goal, and end in a zone
            passed = [(ms, at) for at, ms in zip(robot.drive, robot.passed_ms, strict=False) if ms <= event["t_ms"]]
            for fault in self._zones.trespass(self._under(robot.kind), [*robot.visits, *passed], event["t_ms"]):
                if name in self._unaware:
                    break
                self._find(event, f"{name} {fault}")

    def _judge_metres(self, event: Document) -> None:
        for name, metres in event["distance_m"]:
            robot = self._robots[name]
            # the log lacks the distance of a drive that the end cut short
            under_way = bool(robot.drive) or self._is_inexact(name)
            if abs(metres - robot.distance_m) > 0.002 + 1e-6 * metres and not under_way:
                self._find(event, f"{name} drove {metres} m, by the log {robot.distance_m:.3f}")
            energy, idle_s = robot.kind["energy"], (event["t_ms"] - robot.off_ms) / 1000
            mine = energy["idle_w"] * idle_s + energy["drive_w"] * robot.driving_ms / 1000
            mine += energy["metre_j"] * robot.distance_m
            told = dict(map(tuple, event["energy_j"]))[name]
            # when one that was out of contact was lost is not in the log
            late = name in self._unaware and any(fault["fault"] == "lost" for fault in self._of(name))
            if abs(told - mine) > 0.01 + 1e-3 * mine and not under_way and not late:
                self._find(event, f"{name} used {told} J, by the log {mine:.3f}")

    def _judge_status(self, event: Document, aboard: list[str], all_seen: bool) -> None:
        status, goal = event["status"], self._scenario["goal"]
        limit_ms = round(self._scenario["limits"]["time_s"] * 1000)
        none_left = all(robot.lost for robot in self._robots.values())
        # one that waits for a lost robot may reach its time limit
        fails = none_left and status != "time_limit"
        if (status == "failed") != fails or status not in ("complete", "stalled", "time_limit", "failed"):
            self._find(event, f"ends {status}: {event['reason']}")
        back_early = event["reason"].startswith("called back before the time limit")
        if event["t_ms"] > limit_ms or (status == "time_limit" and event["t_ms"] != limit_ms and not back_early):
            self._find(event, f"ends {status}, the time limit is {limit_ms} ms")
        if status == "time_limit":
            self._judge_who_is_left(event, aboard)
        if status != "complete" and not event["reason"]:
            self._find(event, "gives no reason")
        explained = self._faulty or ", as batteries allow no more" in event["reason"]
        if event["reason"].startswith("no progress after") and not explained:
            self._find(event, f"ends because plans led nowhere: {event['reason']}")
        for key in (
            "status",
            "reason",
            "deployments",
            "retrievals",
            "replans",
            "explored_area_m2",
            "reachable_area_m2",
        ):
            if self._summary[key] != event[key]:
                self._find(event, f"the summary's {key} is {self._summary[key]}")
        if status != "complete":
            return
        rovers = {name for name, robot in self._robots.items() if robot.kind["role"] == "rover"}
        if (goal["recover_rovers"] or goal["return_home"]) and set(event["aboard"]) != rovers:
            self._find(event, f"is complete without {sorted(rovers.difference(event['aboard']))}")
        if goal["return_home"]:
            for name, robot in self._robots.items():
                if robot.kind["role"] == "carrier" and robot.cell != robot.visits[0][1]:
                    self._find(event, f"is complete with {name} at {robot.cell}, not at home")
        changed = self._zones.dated or any(fault["fault"] == "ground" for fault in self._faults)
        if self._is_enough(event):
            return
        if changed or any(robot.lost for robot in self._robots.values()):
            self._judge_team(event)
        elif not all_seen:
            self._find(event, f"is complete at {event['explored_area_m2'] / event['reachable_area_m2']:.1%} coverage")

    def _is_enough(self, event: Document) -> bool:
        """Return whether the scenario asks for no more than is explored."""
        enough = self._scenario["limits"].get("coverage", 1)
        then = re.match(r"([0-9.]+) % of the reachable area were explored when", event["reason"])
        if then is not None and self._zones.dated:  # zones have changed since what counts
            return float(then[1]) >= 100 * enough - 0.05
        return enough < 1 and event["explored_area_m2"] >= enough * event["reachable_area_m2"] - 1e-6

    def _judge_team(self, event: Document) -> None:
        """Check that the robots, those that are lost included, know all that they could reach now."""
        team = [(robot.kind, robot.cell) for robot in self._robots.values() if robot.cell or robot.carrier]
        unknown = np.pad((self._known == UNKNOWN) & ~self._barred & self._zones.inside, 1)
        beside = unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
        left = self._reach(self._known, team, 0.0) & self._reach(self._known, team, 1e-6) & beside
        flickers = any(frontier["reason"].startswith("flickers") for frontier in event["remaining"])
        if np.count_nonzero(left) > self._pockets(self._known, team) and not flickers:
            y, x = np.argwhere(left)[0].tolist()
            self._find(event, f"is complete, but robots can still reach {(x, y)}, beside a cell that is not known")

    def _judge_who_is_left(self, event: Document, aboard: list[str]) -> None:
        """Check that the reason names exactly the robots that are not at their goal at the time limit."""
        goal, left, unsure = self._scenario["goal"], set[str](), set[str]()
        for name, robot in self._robots.items():
            if robot.lost:  # its place may be unknown
                unsure |= {f"{name} is not aboard", f"{name} is not home"}
                continue
            if robot.kind["role"] == "rover" and (goal["recover_rovers"] or goal["return_home"]) and name not in aboard:
                left.add(f"{name} is not aboard")
            if (
                robot.kind["role"] == "carrier"
                and goal["return_home"]
                and (robot.drive or robot.cell != robot.visits[0][1])
            ):
                left.add(f"{name} is not home")
        told = set(re.findall(r"\S+ is not (?:aboard|home)", event["reason"]))
        if not left <= told <= left | unsure:
            self._find(event, f"by the log {sorted(left) or 'nobody is left'}: {event['reason']}")

    def _judge_reason(self, event: Document, aboard: list[str]) -> None:
        """Check the stop report: the remaining frontiers are frontiers, and a stalled mission has some goal left."""
        explored_ms = event["exploration_ms"]
        if explored_ms is not None and explored_ms > event["t_ms"]:
            self._find(event, f"exploration ends at {explored_ms} ms, after the mission")
        if event["status"] == "complete" and explored_ms is None and not self._is_enough(event):
            self._find(event, "is complete, but targets were left")
        drivable = set().union(*(kind["terrains"] for kind in self._kinds.values()))
        wide = 1 + math.floor(max(kind["radius_m"] for kind in self._kinds.values()) * self._metre)
        for frontier in event["remaining"]:
            x, y = frontier["cell"]  # unknown cells may keep the footprint from the cells beside it
            around = self._known[max(0, y - wide) : y + wide + 1, max(0, x - wide) : x + wide + 1]
            if self._known[y, x] not in drivable or not (around == UNKNOWN).any():
                self._find(event, f"{(x, y)} is called a frontier that is left, but is none")
            if not frontier["reason"]:
                self._find(event, f"does not say why the frontier at {(x, y)} is left")
        goal, team = self._scenario["goal"], self._robots.values()
        out = any(robot.kind["role"] == "rover" and robot.carrier is None for robot in team)
        away = any(robot.visits[0][1] != robot.cell for robot in team if robot.kind["role"] == "carrier")
        left = explored_ms is None or (goal["recover_rovers"] and out) or (goal["return_home"] and (out or away))
        if event["status"] == "stalled" and not left:
            self._find(event, f"stalls with nothing left to do: {event['reason']}")

    def _judge_sight(self, event: Document) -> None:
        """Check that cells in plain view of a robot become known: nothing near the straight line blocks sight."""
        if any(fault["fault"] in ("missed_cells", "ground", "joins") for fault in self._faults):
            return
        for name, robot in self._robots.items():
            if "sensor_angle_deg" in robot.kind:
                continue
            radius = robot.kind["sensor_range_m"] * self._metre
            for _, cell in dict.fromkeys(robot.visits):
                hidden = self._missed(cell, radius)
                if hidden is not None:
                    self._find(event, f"{name} was at {cell} and did not see {hidden}, in plain view")
                    break


def names_all(text: str, names: list[str]) -> bool:
    """Return whether a text contains all these names as words."""
    return set(names) <= set(re.findall(r"[\w.-]+", text))

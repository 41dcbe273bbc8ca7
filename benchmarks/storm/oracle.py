"""Judge a mission by its log, its summary and the scenario, using only the rules of the documentation.

The oracle imports nothing of the product. It replays the log on the true map and checks every line against a rule:

- motion: where a footprint fits, no cutting of corners, only over known cells, at the speed of the robot's type;
- docking: near enough, both robots at rest for the whole time, within capacity and seats; the carried don't act;
- sensing: what is seen is true, within range, seen by a robot that was there; cells in plain view are seen;
- contact: rovers out of contact follow no later plan, and what they see is logged once they are in contact again;
- zones: nobody enters a no-go zone that holds, and no target lies in one;
- plans: no robot does two things at once or acts aboard; targets and meeting points are those of the plan;
- the end: areas, distances, energy and counts are those of the log; "complete" means nothing reachable is left.

The rules of motion, docking, sensing and zones are here, those of plans and contact in `plans`, of faults in `faults`,
of the end in `account`; each class adds to the one before it.

Where the documentation leaves room (a line of sight through a corner, rounding), the oracle accepts both readings.

Coordinates are cells (column, row), row 0 at the bottom; times are ms; arrays are (height, width).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from itertools import pairwise

from benchmarks.storm.account import Robot
from benchmarks.storm.charges import ChargeAccount
from benchmarks.storm.faults import FaultAccount
from benchmarks.storm.ground import UNKNOWN, Document
from benchmarks.storm.logs import Cell, looked_at, route


class Oracle(FaultAccount):
    """Checks one mission against the rules; `findings` has a sentence for each broken rule."""

    def __init__(self, scenario: Document, lines: Iterable[str], summary: Document) -> None:
        super().__init__(scenario, summary)
        self._events = [json.loads(line) for line in lines]
        self._last_ms = 0

    def judge(self) -> list[str]:
        """Return the faults of the mission; empty if all rules hold."""
        if not self._events or self._events[0]["event"] != "mission" or self._events[-1]["event"] != "ended":
            return ["the log does not run from `mission` to `ended`"]
        for event in self._events:
            if event["t_ms"] < self._last_ms:
                self._find(event, "time goes back")
            for robot in self._robots.values():
                robot.off_ms += robot.lost * (event["t_ms"] - self._last_ms)
            self._last_ms = event["t_ms"]
            if event["event"] not in ("mission", "reveal"):
                self._charges.pass_to(event["t_ms"], self._robots, self._started)
            getattr(self, f"_on_{event['event']}")(event)
        return self.findings

    def _on_mission(self, event: Document) -> None:
        self._foresees = event["strategy"] == "clairvoyant"
        self._kinds = {kind["name"]: kind for kind in event["types"]}
        self._charges = ChargeAccount([(x, y) for x, y in event.get("chargers", ())])
        seats = {kind["name"]: kind.get("seats", {}) for kind in self._scenario["robot_types"]}
        for kind in self._kinds.values():
            if dict(kind.get("seats", ())) != seats[kind["name"]]:
                self._find(event, f"the seats of {kind['name']} are {kind.get('seats')}")
            self._fits[kind["name"]] = self._standable(kind, self._truth, slack=1e-6)
        for robot in event["robots"]:
            cell = tuple(robot["cell"]) if robot["cell"] is not None else None
            self._robots[robot["name"]] = Robot(self._kinds[robot["type"]], cell, robot["carrier"])
            if cell is not None:
                self._stand(event, robot["name"], cell)
        if (event["width"], event["height"]) != (self._width, self._height):
            self._find(event, "the size of the map is another")
        for name in self._robots:
            self._hold(event, name)
        self._team = [(robot.kind, robot.cell) for robot in self._robots.values()]
        self._barred = self._zones.lasting
        for slack in self._reachable:  # a centre right on the rim of a footprint may count either way
            self._reachable[slack] = self._reach(self._truth, self._team, slack)
        self._barred = self._zones.barred

    def _stand(self, event: Document, name: str, cell: Cell) -> None:
        robot = self._robots[name]
        robot.cell, robot.drive = cell, []
        robot.visits.append((event["t_ms"], cell))
        if not self._fits[robot.kind["name"]][cell[1], cell[0]]:
            self._find(event, f"{name} stands at {cell}, where its footprint does not fit")

    def _on_drive(self, event: Document) -> None:
        name, cell = event["robot"], tuple(event["cell"])
        robot = self._robots[name]
        if robot.carrier is not None or robot.lost:
            self._find(
                event, f"{name} drives aboard {robot.carrier}" if robot.carrier else f"{name} drives, but is lost"
            )
        if robot.stuck_until > event["t_ms"]:
            self._find(event, f"{name} drives, but is stuck until {robot.stuck_until} ms")
        if robot.drive and any(fault["fault"] == "slows" for fault in self._of(name)):
            self._on_stand(event)  # it goes on at another speed
        if robot.drive:
            self._find(event, f"{name} sets out while it drives")
        if robot.busy_until is not None:
            self._find(event, f"{name} drives while it docks or undocks")
        if robot.cell != cell and not (robot.drive and self._is_inexact(name)):
            self._find(event, f"{name} sets out from {cell}, but stands at {robot.cell}")
        robot.drive = route(cell, event["steps"])
        entered = self._zones.entered(self._under(robot.kind), robot.drive)
        if entered is not None and name not in self._contacts.away:
            self._find(event, f"{name} is to drive to {entered}, in a no-go zone")
        fits, known = self._fits[robot.kind["name"]], self._standable(robot.kind, self._known, slack=1e-6)
        length, robot.passed_ms, from_unknown = 0.0, [event["t_ms"]], list[Cell]()
        diagonal = robot.kind.get("diagonal", math.sqrt(2))
        for before, after in zip(robot.drive, robot.drive[1:], strict=False):
            if after not in self._moves(fits, before):
                self._find(event, f"{name} can't step from {before} to {after}")
            if not self._foresees and after not in self._moves(known, before):
                from_unknown = from_unknown or robot.drive[len(robot.passed_ms) - 1 :]
            length += 1.0 if before[0] == after[0] or before[1] == after[1] else diagonal
            speed_mps = robot.kind["speed_mps"] * robot.speed
            robot.passed_ms.append(event["t_ms"] + round(1000 * length / self._metre / speed_mps))
        if from_unknown and not self._is_drift(name, from_unknown):
            before, after, *_ = from_unknown
            self._find(event, f"{name} steps from {before} to {after} over cells that are not known yet")

    def _is_drift(self, name: str, cells: list[Cell]) -> bool:
        """Return whether noise can drive a robot on along cells: diagonally, then straight on, once for each fault."""
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(cells)]
        turns = sum(a != b for a, b in pairwise(steps))
        return turns < 2 * sum(fault["fault"] == "position_noise" for fault in self._of(name))

    def _on_stand(self, event: Document) -> None:
        name, cell, t_ms = event["robot"], tuple(event["cell"]), event["t_ms"]
        robot = self._robots[name]
        if self._is_inexact(name):
            self._stand(event, name, cell)
            return
        passed = list(enumerate(zip(robot.drive, robot.passed_ms, strict=True)))
        fails = any(fault["fault"] in ("stuck", "lost") for fault in self._of(name))
        if robot.lost or fails:  # between two cells it counts as on the first
            arriving = [one for one in passed if abs(one[1][1] - t_ms) <= 1]  # it may have arrived or not
            passed = [one for one in passed if one[1][1] < t_ms - 1][-1:] + arriving
        steps = next((k for k, (at, ms) in passed if at == cell and (robot.lost or fails or abs(ms - t_ms) <= 1)), None)
        if steps is None:
            self._find(event, f"{name} stands at {cell}, where its drive does not bring it at that time")
            steps = 0
        for before, after in zip(robot.drive[:steps], robot.drive[1 : steps + 1], strict=True):
            slanted = before[0] != after[0] and before[1] != after[1]
            robot.distance_m += (robot.kind.get("diagonal", math.sqrt(2)) if slanted else 1.0) / self._metre
        if robot.drive:
            robot.driving_ms += robot.passed_ms[steps] - robot.passed_ms[0]
            robot.visits += zip(robot.passed_ms[1 : steps + 1], robot.drive[1 : steps + 1], strict=True)
        self._stand(event, name, cell)

    def _on_reveal(self, event: Document) -> None:
        name, t_ms = event["robot"], event["t_ms"]
        robot = self._robots[name]
        if robot.carrier is not None:
            self._find(event, f"{name} sees aboard {robot.carrier}")
            return
        at, way = self._at(robot, t_ms), self._contacts.way(name, t_ms)
        if name in self._contacts.away:
            self._find(event, f"what {name} sees out of contact is known")
        anywhere = bool(robot.drive) and self._is_inexact(name)
        radius = robot.kind["sensor_range_m"] * self._metre
        touch = robot.kind["radius_m"] * self._metre + math.sqrt(2)  # its body's reach one cell further on
        for (x, y), code in looked_at(event["cells"], self._known.shape[1]):
            if not self._inside((x, y)):
                self._find(event, f"{name} sees {(x, y)}, which is not on the map")
                continue
            if self._known[y, x] != UNKNOWN:
                self._find(event, f"{name} sees {(x, y)} for the first time again")
            if code != self._truth[y, x]:
                if not self._may_become(t_ms, (x, y), code):
                    self._find(event, f"{name} sees {code} at {(x, y)}, where {self._truth[y, x]} is")
                self._become((x, y), code)
            self._known[y, x] = code
            if anywhere:
                continue
            if way and min(math.dist(cell, (x, y)) for cell in way) <= max(radius, touch) + 1e-6:
                continue
            if at is None:
                self._find(event, f"{name} looks at {t_ms} ms, when it passes no cell")
                break
            if math.dist(at, (x, y)) > max(radius, touch) + 1e-6:
                self._find(event, f"{name} at {at} sees {(x, y)}, out of its range of {radius:.2f} cells")

    def _at(self, robot: Robot, t_ms: int) -> Cell | None:
        if robot.drive:
            return next((at for at, ms in zip(robot.drive, robot.passed_ms, strict=True) if abs(ms - t_ms) <= 1), None)
        return robot.cell

    def _on_start(self, event: Document) -> None:
        action = event["action"]
        name, carrier = action["robot"], action["carrier"]
        robot = self._robots[name]
        parting = self._contacts.away.get(name)
        if parting is not None and (carrier is not None or event["revision"] > parting.told):
            self._find(event, f"{name} starts to {action['name']} by plan {event['revision']}, out of contact")
        for one in (name, carrier):
            if one is None:
                continue
            if self._robots[one].lost:
                self._find(event, f"{one} starts to {action['name']}, but is lost")
            if one in self._started:
                self._find(event, f"{one} starts to {action['name']} before it ended what it did")
            self._started[one] = action
        if action["name"] in ("move", "explore"):
            if robot.carrier is not None:
                self._find(event, f"{name} is to {action['name']} aboard {robot.carrier}")
            return
        bearer = self._robots[carrier]
        if bearer.drive or robot.drive:
            self._find(event, f"{name} and {carrier} {action['name']} while one of them drives")
        spot = (event["cell"][0], event["cell"][1])
        for one, at in ((robot, spot), (bearer, bearer.cell)):
            if at is not None and self._zones.entered(self._under(one.kind), [(-99, -99), at]) is not None:
                self._find(event, f"{name} and {carrier} {action['name']} in a no-go zone")
        noisy = self._is_noisy(name) or self._is_noisy(carrier)
        near = () if bearer.cell is None else self._near([bearer.cell], self._dock_cells(bearer.kind, robot.kind))
        if spot not in near and not noisy:
            self._find(event, f"{name} at {spot} and {carrier} at {bearer.cell} are too far apart")
        if action["name"] == "undock":
            if robot.carrier != carrier:
                self._find(event, f"{name} undocks from {carrier}, but is aboard {robot.carrier}")
            robot.carrier, robot.cell = None, spot
        elif robot.carrier is not None or (robot.cell != spot and not noisy):
            self._find(event, f"{name} docks at {spot}, but is at {robot.cell} aboard {robot.carrier}")
        robot.busy_until = bearer.busy_until = event["t_ms"]

    def _on_end(self, event: Document) -> None:
        action, name, carrier = event["action"], event["action"]["robot"], event["action"]["carrier"]
        for one in (name, carrier):
            # A plan that continues an action gives it new times, and a target that moved has another name.
            started = self._started.pop(one, {"name": None})["name"] if one is not None else None
            without_route = event["end"] == "blocked" and carrier is None and started is None
            if one is not None and started != action["name"] and not without_route:
                self._find(event, f"{one} ends a {action['name']} that it did not start")
        if event["end"] == "failed":
            self._judge_failure(event)
        if carrier is None:
            return
        robot, bearer = self._robots[name], self._robots[carrier]
        began = robot.busy_until if robot.busy_until is not None else event["t_ms"]
        robot.busy_until = bearer.busy_until = None
        takes = robot.kind["dock_ms" if action["name"] == "dock" else "undock_ms"]
        if event["end"] == "done" and event["t_ms"] - began != takes:
            self._find(event, f"{name} took {event['t_ms'] - began} ms to {action['name']}, not {takes}")
        if event["end"] != "done":
            self._undo(event, robot)
        elif action["name"] == "dock":
            robot.carrier, robot.cell = carrier, None
            self._retrieved += 1
            self._hold(event, carrier)
        else:
            self._deployed += 1
            spot = self._meetings[action["place"]]["rover_cell"]
            self._stand(event, name, (spot[0], spot[1]))

    def _on_ended(self, event: Document) -> None:
        for name in self._contacts.missing:
            self._robots[name].lost = True
        for name, parting in self._contacts.away.items():  # nobody knows what it has seen since
            del self._robots[name].visits[parting.visits :]
        self._unaware = self._contacts.parted
        super()._on_ended(event)

    def _on_zone(self, event: Document) -> None:
        for fault in self._zones.change(event):
            self._find(event, fault)
        self._barred = self._zones.barred

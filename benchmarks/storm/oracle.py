"""Judge a mission by its log, its summary and the scenario, using only the rules of the documentation.

The oracle imports nothing of the product. It replays the log on the true map and checks every line against a rule:

- motion: where a footprint fits, no cutting of corners, only over known cells, at the speed of the robot's type;
- docking: near enough, both robots at rest for the whole time, within capacity and seats; the carried don't act;
- sensing: what is seen is true, within range, seen by a robot that was there; cells in plain view are seen;
- contact: rovers out of contact follow no later plan, and what they see is logged once they are in contact again;
- zones: nobody enters a no-go zone that holds, and no target lies in one;
- plans: no robot does two things at once or acts aboard; targets and meeting points are those of the plan;
- the end: areas, distances, energy and counts are those of the log; "complete" means nothing reachable is left.

Where the documentation leaves room (a line of sight through a corner, rounding), the oracle accepts both readings.

Coordinates are cells (column, row), row 0 at the bottom; times are ms; arrays are (height, width).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.account import Account, Robot
from benchmarks.storm.charges import ChargeAccount
from benchmarks.storm.contact import MISSING, SLACK_CELLS, Contacts
from benchmarks.storm.ground import UNKNOWN, Document, most_aboard
from benchmarks.storm.logs import Cell, looked_at, route


class Oracle(Account):
    """Checks one mission against the rules; `findings` has a sentence for each broken rule."""

    def __init__(self, scenario: Document, lines: Iterable[str], summary: Document) -> None:
        super().__init__(scenario, summary)
        terrains = [terrain["name"] for terrain in scenario.get("terrains", [])]
        self._codes = {name: code for code, name in enumerate(("obstacle", "floor", "rough", *terrains))}
        self._events = [json.loads(line) for line in lines]
        self._fits: dict[str, NDArray[np.bool_]] = {}
        self._targets: dict[str, Document] = {}
        self._meetings: dict[str, Document] = {}
        self._started: dict[str, Document] = {}
        self._last_ms = 0
        self._charges = ChargeAccount([])
        self._foresees = False
        self._contacts = Contacts(self._metre, self._dock_cells)

    def judge(self) -> list[str]:
        """Return the faults of the mission; empty if all rules hold."""
        if not self._events or self._events[0]["event"] != "mission" or self._events[-1]["event"] != "ended":
            return ["the log does not run from `mission` to `ended`"]
        for event in self._events:
            if event["t_ms"] < self._last_ms:
                self._find(event, "time goes back")
            self._last_ms = event["t_ms"]
            if event["event"] not in ("mission", "reveal"):
                self._charges.pass_to(event["t_ms"], self._robots, self._started)
            getattr(self, f"_on_{event['event']}")(event)
        return self.findings

    # -- events -----------------------------------------------------------------------------------------------------

    def _on_mission(self, event: Document) -> None:
        self._foresees = event["strategy"] == "clairvoyant"  # it is given the map
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

    def _hold(self, event: Document, carrier: str) -> None:
        aboard = [robot.kind for robot in self._robots.values() if robot.carrier == carrier and not robot.lost]
        if not self._holds(carrier, aboard):
            self._find(event, f"{carrier} carries {[kind['name'] for kind in aboard]}")

    def _holds(self, carrier: str, aboard: list[Document]) -> bool:
        """Return whether a carrier has places for rovers of these types together."""
        kind = self._robots[carrier].kind
        few = all(aboard.count(rover) <= most_aboard(kind, rover) for rover in aboard)
        return few and len(aboard) <= kind["capacity"]

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
        length, robot.passed_ms = 0.0, [event["t_ms"]]
        diagonal = robot.kind.get("diagonal", math.sqrt(2))
        for before, after in zip(robot.drive, robot.drive[1:], strict=False):
            if after not in self._moves(fits, before):
                self._find(event, f"{name} can't step from {before} to {after}")
            if not self._foresees and after not in self._moves(known, before):
                self._find(event, f"{name} steps from {before} to {after} over cells that are not known yet")
            length += 1.0 if before[0] == after[0] or before[1] == after[1] else diagonal
            speed_mps = robot.kind["speed_mps"] * robot.speed
            robot.passed_ms.append(event["t_ms"] + round(1000 * length / self._metre / speed_mps))

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
        for name, offset, text in event["looks"]:
            robot, t_ms = self._robots[name], event["t_ms"] + offset
            if robot.carrier is not None:
                self._find(event, f"{name} sees aboard {robot.carrier}")
                continue
            at, way = self._at(robot, t_ms), self._contacts.way(name, t_ms)
            if name in self._contacts.away:
                self._find(event, f"what {name} sees out of contact is known")
            anywhere = bool(robot.drive) and self._is_inexact(name)
            radius = robot.kind["sensor_range_m"] * self._metre
            touch = robot.kind["radius_m"] * self._metre + math.sqrt(2)  # its body's reach one cell further on
            for (x, y), code in looked_at(text):
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

    def _undo(self, event: Document, robot: Robot) -> None:
        """Undo a failed docking or undocking: the rover stays where it was; on the ground if its carrier was lost."""
        action = event["action"]
        if not self._faulty or event["end"] not in ("failed", "lost"):
            self._find(event, f"{action['name']} of {action['robot']} ended as {event['end']}")
        if event["end"] == "failed" and action["name"] == "undock":
            robot.carrier, robot.cell = action["carrier"], None
            self._hold(event, action["carrier"])

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

    def _on_ended(self, event: Document) -> None:
        for name in self._contacts.missing:
            self._robots[name].lost = True
        for name, parting in self._contacts.away.items():  # nobody knows what it has seen since
            del self._robots[name].visits[parting.visits :]
        self._unaware = self._contacts.parted
        super()._on_ended(event)

    def _on_away(self, event: Document) -> None:
        name = event["robot"]
        if name in self._contacts.away or "radio_range_m" not in self._robots[name].kind:
            self._find(event, f"{name} can't lose contact")
        self._contacts.lose(name, self._robots[name], self._plans)
        self._judge_contact(event, [name])

    def _on_contact(self, event: Document) -> None:
        name = event["robot"]
        if name not in self._contacts.away:
            self._find(event, f"{name} was in contact")
            return
        self._contacts.regain(name, self._robots[name], event["t_ms"])
        self._judge_contact(event, [name])

    def _judge_contact(self, event: Document, names: Iterable[str]) -> None:
        """Check that exactly the robots in range are in contact."""
        away, exact = self._contacts.away, not any(map(self._is_inexact, self._robots))
        if not exact or any(robot.lost for robot in self._robots.values()) or self._contacts.missing:
            return
        kinds, t_ms = self._kinds.values(), event["t_ms"]
        near, far = (self._contacts.heard(self._robots, kinds, t_ms, s) for s in (-SLACK_CELLS, SLACK_CELLS))
        for name in names:
            if name in near if name in away else name not in far:
                self._find(event, f"{name} is {'out of' if name in away else 'in'} contact")

    def _on_speed(self, event: Document) -> None:
        name, share = event["robot"], event["share"]
        # a lost robot says what speed it has when it returns, and one out of contact when it is heard again
        told = name in self._contacts.parted or self._has(event, name, "slows", "returns", "joins")
        said = told and share in [fault.get("speed_share") for fault in self._of(name)]
        if not said and not self._is_slower_than_it_says(name):
            self._find(event, f"{name} changes its speed to {share}, though no fault was asked for")
        self._robots[name].speed = share

    def _on_change(self, event: Document) -> None:
        """Check that known cells became what a fault makes of them."""
        for _, _, text in event["looks"]:
            for (x, y), code in looked_at(text):
                if self._known[y, x] == UNKNOWN:
                    self._find(event, f"{(x, y)} changes, but was not known")
                if not self._may_become(event["t_ms"], (x, y), code):
                    self._find(event, f"{(x, y)} becomes {code}, though no fault was asked for")
                self._known[y, x] = code
                self._become((x, y), code)

    def _on_zone(self, event: Document) -> None:
        for fault in self._zones.change(event):
            self._find(event, fault)
        self._barred = self._zones.barred

    def _on_plan(self, event: Document) -> None:
        self._judge_charges(event)
        if not self._faulty:  # a robot that was lost may not be known to be
            self._judge_contact(event, self._robots)
        self._plans += 1
        if event["revision"] != self._plans:
            self._find(event, f"plan {self._plans} is called {event['revision']}")
        for kept, key in ((self._targets, "targets"), (self._meetings, "meetings")):
            now: dict[str, Document] = {}
            for one in event[key]:
                if isinstance(one, str) and one not in kept:
                    self._find(event, f"{one} did not stand in the plan before")
                    continue
                now |= {one: kept[one]} if isinstance(one, str) else {one["name"]: one}
            if key == "targets":
                self._targets = now
            else:
                self._meetings = self._meetings | now
        for name, target in self._targets.items():
            x, y = target["cell"]
            if self._known[y, x] == UNKNOWN and not self._foresees:
                self._find(event, f"target {name} is at a cell that is not known")
            if self._barred[y, x]:
                self._find(event, f"target {name} is in a no-go zone")
        if any(robot.kind["role"] == "rover" for robot in self._robots.values()):
            self._judge_area(event)
        self._judge_plan(event)

    def _judge_area(self, event: Document) -> None:
        """Check that no target leads out of the area to explore, once one leads into it.

        Before, robots look for a way there; afterwards, for ground to set rovers down on.
        """
        inside, leads = self._zones.inside, {}
        if inside.all():
            return
        for name, target in self._targets.items():
            # the cells that a robot touches there, and those beside them
            (x, y), widest = target["cell"], max(self._kinds[kind]["radius_m"] for kind in target["explorers"])
            offsets = self._under({"radius_m": widest + 1 / self._metre}, slack=-1e-6)
            beside = filter(self._inside, ((x + u, y + v) for u, v in offsets))
            unknown = [(u, v) for u, v in beside if self._known[v, u] == UNKNOWN and not self._barred[v, u]]
            leads[name] = not unknown or any(inside[v, u] for u, v in unknown)
        if all(leads.values()) or not any(leads.values()):
            return
        there = self._reach(self._known, [(robot.kind, robot.cell) for robot in self._robots.values()], 0.0)
        if (there & inside).any():
            for name in (name for name, does in leads.items() if not does):
                self._find(event, f"target {name} leads out of the area to explore")

    def _judge_plan(self, event: Document) -> None:
        """Check that robots do one thing at a time, carried rovers do nothing, and no carrier exceeds its capacity."""
        free_ms = dict.fromkeys(self._robots, 0)
        aboard = {name: robot.carrier for name, robot in self._robots.items()}
        for name, action in self._started.items():  # a docking in progress ends before the plan's actions
            if action["name"] == "dock" and action["robot"] == name:
                aboard[name] = action["carrier"]
        for action in sorted(event["actions"], key=lambda a: (a["start_ms"], a["start_ms"] + a["duration_ms"])):
            name, carrier, start = action["robot"], action["carrier"], action["start_ms"]
            for one in filter(None, (name, carrier)):
                if self._robots[one].lost or one in self._contacts.missing:
                    self._find(event, f"in the plan {one} is to {action['name']}, but is lost")
                if free_ms[one] > start:
                    self._find(event, f"in the plan {one} is to {action['name']} at {start} ms, but is busy")
                free_ms[one] = start + action["duration_ms"]
            if action["name"] in ("move", "explore"):
                if aboard[name] is not None:
                    self._find(event, f"in the plan {name} is to {action['name']} aboard {aboard[name]}")
                if action["name"] == "explore" and action["place"] not in self._targets:
                    self._find(event, f"in the plan {name} explores {action['place']}, which is no target")
                continue
            if action["place"] not in self._meetings:
                self._find(event, f"in the plan {name} is to {action['name']} at {action['place']}, no meeting point")
            if (aboard[name] == carrier) != (action["name"] == "undock"):
                self._find(event, f"in the plan {name} is to {action['name']} while it is aboard {aboard[name]}")
            aboard[name] = carrier if action["name"] == "dock" else None
            held = [one for one, bearer in aboard.items() if bearer == carrier and not self._robots[one].lost]
            if not self._holds(carrier, [self._robots[one].kind for one in held]):
                self._find(event, f"in the plan {carrier} carries {held}")

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

    def _judge_charges(self, event: Document) -> None:
        """Compare the charges of robots without a command with the oracle's own."""
        for name, share in event.get("charges", ()):
            robot = self._robots[name]
            unsure = robot.lost or robot.drive or name in self._started or name in self._contacts.away
            if unsure or any(map(self._is_inexact, self._robots)):
                continue
            if any(fault["fault"] == "stuck" for fault in self._of(name)):
                continue  # a robot that is stuck tells the charge that it will have when it is free
            mine = max(0.0, self._charges.level_j(name, robot)) / robot.kind["battery"]["capacity_j"]
            if abs(mine - share) > 0.002:
                self._find(event, f"{name} has a charge of {share}, not {mine:.4f}")

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
        robot.lost, robot.busy_until = True, None

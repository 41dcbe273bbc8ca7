"""The plans of a mission: who is to do what, and which robots hear of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set

from benchmarks.storm.account import Account, Robot
from benchmarks.storm.charges import ChargeAccount
from benchmarks.storm.contact import SLACK_CELLS, Contacts
from benchmarks.storm.ground import UNKNOWN, Document, most_aboard


class PlanAccount(Account):
    """Checks each plan against what is known by then, and that it reaches the robots in range."""

    def __init__(self, scenario: Document, summary: Document) -> None:
        super().__init__(scenario, summary)
        self._targets: dict[str, Document] = {}
        self._meetings: dict[str, Document] = {}
        self._started: dict[str, Document] = {}  # the action that each robot does
        self._charges = ChargeAccount([])
        self._contacts = Contacts(self._metre, self._dock_cells)
        self._foresees = False  # whether the strategy is given the map

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
        places = set(self._targets), set(self._meetings)
        for what in wrong_in_plan(event, self._robots, self._started, places, self._contacts.missing):
            self._find(event, what)

    def _hold(self, event: Document, carrier: str) -> None:
        aboard = [robot.kind for robot in self._robots.values() if robot.carrier == carrier and not robot.lost]
        if not has_places(self._robots[carrier].kind, aboard):
            self._find(event, f"{carrier} carries {[kind['name'] for kind in aboard]}")

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


def wrong_in_plan(
    event: Document,
    robots: Mapping[str, Robot],
    started: Mapping[str, Document],
    places: tuple[Set[str], Set[str]],
    missing: Set[str],
) -> Iterator[str]:
    """Yield where robots do two things at once, carried or lost ones act, or a carrier exceeds its capacity.

    `places` are the names of targets and of meeting points, `started` has the action that each robot does.
    """
    free_ms = dict.fromkeys(robots, 0)
    aboard = {name: robot.carrier for name, robot in robots.items()}
    for name, action in started.items():  # a docking in progress ends before the plan's actions
        if action["name"] == "dock" and action["robot"] == name:
            aboard[name] = action["carrier"]
    for action in sorted(event["actions"], key=lambda a: (a["start_ms"], a["start_ms"] + a["duration_ms"])):
        name, carrier, start = action["robot"], action["carrier"], action["start_ms"]
        for one in filter(None, (name, carrier)):
            if robots[one].lost or one in missing:
                yield f"in the plan {one} is to {action['name']}, but is lost"
            if free_ms[one] > start:
                yield f"in the plan {one} is to {action['name']} at {start} ms, but is busy"
            free_ms[one] = start + action["duration_ms"]
        if action["name"] in ("move", "explore"):
            if aboard[name] is not None:
                yield f"in the plan {name} is to {action['name']} aboard {aboard[name]}"
            if action["name"] == "explore" and action["place"] not in places[0]:
                yield f"in the plan {name} explores {action['place']}, which is no target"
            continue
        if action["place"] not in places[1]:
            yield f"in the plan {name} is to {action['name']} at {action['place']}, no meeting point"
        if (aboard[name] == carrier) != (action["name"] == "undock"):
            yield f"in the plan {name} is to {action['name']} while it is aboard {aboard[name]}"
        aboard[name] = carrier if action["name"] == "dock" else None
        held = [one for one, bearer in aboard.items() if bearer == carrier and not robots[one].lost]
        if not has_places(robots[carrier].kind, [robots[one].kind for one in held]):
            yield f"in the plan {carrier} carries {held}"


def has_places(carrier: Document, aboard: list[Document]) -> bool:
    """Return whether a type of carrier has places for rovers of these types together."""
    few = all(aboard.count(rover) <= most_aboard(carrier, rover) for rover in aboard)
    return few and len(aboard) <= carrier["capacity"]

"""What must hold at the end of a mission whose robots report their own map: the stop report is true.

"Complete" means that nothing reachable is left but what the report names, given-up frontiers are really ones that
nobody could see, lost robots are named, and so is everybody who is left behind.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import names_all
from benchmarks.storm.distortion import Distortion
from benchmarks.storm.ground import UNKNOWN, Document, TrueGround
from benchmarks.storm.logs import Cell
from benchmarks.storm.reported_log import ReportedLog
from benchmarks.storm.reported_rules import FLICKER_CELLS
from marsupial.model.grid import Mask

GIVEN_UP = ("three looks", "three drives")

NAMED_CELLS = 4
"""How near to a frontier that is left the cell is by which the report names it, besides the robot's body."""


def robots_are_told(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check counts, who is aboard, and that lost robots are named."""
    if event["event"] != "ended":
        return
    for key, mine in (("deployments", log.deployed), ("retrievals", log.retrieved), ("replans", log.plans)):
        if event[key] != mine:
            yield f"{key} is {event[key]}, by the log {mine}"
    there = {name for name, robot in log.robots.items() if not robot.lost}
    aboard = sorted(name for name in there if log.robots[name].carrier is not None)
    if sorted(there.intersection(event["aboard"])) != aboard:
        yield f"aboard are {event['aboard']}, by the log {aboard}"
    lost = [name for name in log.robots if name not in there]
    if event.get("lost", []) != lost or (event["status"] != "failed" and not names_all(event["reason"], lost)):
        yield f"lost are {event.get('lost', [])}, by the log {lost}: {event['reason']}"


def metres_and_energy_are_true(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check how far robots have driven, and the energy that they used; nothing is heard of those out of contact."""
    if event["event"] != "ended":
        return
    metres, energy_j = dict(map(tuple, event["distance_m"])), dict(map(tuple, event["energy_j"]))
    for name, robot in log.robots.items():
        if name in log.parted or name in log.lost_once:
            continue
        metres_driven, driving_ms = log.told.driven[name]
        if abs(metres[name] - metres_driven) > 0.002 + 1e-6 * metres_driven:
            yield f"{name} drove {metres[name]} m, in truth {metres_driven:.3f}"
        energy = robot.kind["energy"]
        used_j = energy["idle_w"] * event["t_ms"] / 1000 + energy["drive_w"] * driving_ms / 1000
        used_j += energy["metre_j"] * metres_driven
        if abs(energy_j[name] - used_j) > 0.01 + 1e-3 * used_j:
            yield f"{name} used {energy_j[name]} J, in truth {used_j:.3f}"


class EndStatus:
    """Checks the status of the end against the goal of the mission."""

    def __init__(self, *, called_back: bool) -> None:
        self._called_back = called_back

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        if event["event"] != "ended":
            return
        status, reason, goal = event["status"], event["reason"], log.scenario["goal"]
        limit_ms = round(log.scenario["limits"]["time_s"] * 1000)
        none_left = all(robot.lost for robot in log.robots.values())
        if (status == "failed") != none_left and status not in ("time_limit", "cancelled"):
            yield f"ends {status}: {reason}"
        if status == "cancelled" and not self._called_back:
            yield f"ends {status}, but nobody called the team back"
        early = reason.startswith("called back before the time limit")
        if status == "time_limit" and event["t_ms"] < limit_ms and not early:
            yield f"ends {status}, the time limit is {limit_ms} ms"
        if not reason:
            yield "gives no reason"
        rovers = {name for name, robot in log.robots.items() if robot.kind["role"] == "rover"}
        wants_rovers = goal["recover_rovers"] or goal["return_home"]
        out = rovers.difference(event["aboard"]) if wants_rovers else set()
        away = {
            name
            for name, robot in log.robots.items()
            if goal["return_home"] and robot.kind["role"] == "carrier" and robot.cell != log.homes[name]
        }
        if status == "complete" and (out or away):
            yield f"is complete, but {sorted(out | away)} are out: {reason}"
        if status in ("time_limit", "cancelled"):
            named = set(re.findall(r"(\S+) is not (?:aboard|home)", reason))
            lost = {name for name, robot in log.robots.items() if robot.lost}
            driving = {name for name, robot in log.robots.items() if robot.drive or name in log.away}
            if not (out | away) - lost - driving <= named <= out | away | lost | driving:
                yield f"{sorted(out | away)} are left: {reason}"
        left = event["exploration_ms"] is None or out or away or any(robot.lost for robot in log.robots.values())
        if status == "stalled" and not left and " can't stand at " not in reason:
            yield f"stalls with nothing left to do: {reason}"


class NothingLeft:
    """Checks that a complete mission leaves nothing that robots can reach, except for what its report names."""

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        enough = log.scenario["limits"].get("coverage", 1) < 1
        if event["event"] != "ended" or event["status"] != "complete" or enough:
            return
        ground = _KnownGround(log)
        left = ground.frontier() & ~_near(log.changes > 0, FLICKER_CELLS)
        if np.count_nonzero(left) <= ground.pockets():
            return
        wide = NAMED_CELLS + max(kind["radius_m"] for kind in log.kinds.values()) * log.metre
        named = np.zeros(left.shape, dtype=bool)
        for frontier in event["remaining"]:
            x, y = log.true_cell(frontier["cell"])
            named[y, x] = True
        for part in _parts(left):
            if not any(_near(named, math.ceil(wide))[y, x] for x, y in part):
                yield f"is complete, but robots can still reach {part[0]}, beside a cell that is not known"
                return


class GivenUp:
    """Checks that what is given up could not be seen: only a late report is no reason."""

    def __init__(self, distortion: Distortion) -> None:
        self._excused = distortion.hidden | (distortion.flickers & (distortion.wrong > 0))

    def __call__(self, log: ReportedLog, event: Document) -> Iterator[str]:
        """Check one event."""
        if event["event"] != "ended":
            return
        wide = NAMED_CELLS + math.ceil(max(kind["radius_m"] for kind in log.kinds.values()) * log.metre)
        for frontier in event["remaining"]:
            x, y = log.true_cell(frontier["cell"])
            if not log.holds((x, y)):
                yield f"the frontier at {(x, y)} is not in the frame"
                continue
            if not frontier["reason"].startswith(GIVEN_UP):
                continue
            window = np.s_[max(0, y - wide) : y + wide + 1, max(0, x - wide) : x + wide + 1]
            unknown = log.known[window] == UNKNOWN
            if log.told.open_edges and not all(log.holds((x + u, y + v)) for u in (-wide, wide) for v in (-wide, wide)):
                continue  # unknown cells lie beyond the edge
            could_know = (log.told.known[window] != UNKNOWN) & ~self._excused[window] & (log.changes[window] == 0)
            if not unknown.any():
                yield f"the frontier at {(x, y)} is given up, but all cells there are known"
            elif not (unknown & ~could_know).any():
                yield f"the frontier at {(x, y)} is given up, but robots have seen all cells there"


def map_is_the_last_one(log: ReportedLog, event: Document) -> Iterator[str]:
    """Check that the map of the log is the last that was reported."""
    last = log.told.last
    if event["event"] != "ended" or any(last.shift) or not last.cells.size:
        return
    expected = np.full_like(log.known, UNKNOWN)
    x, y = last.corner
    expected[y : y + last.cells.shape[0], x : x + last.cells.shape[1]] = last.cells
    for v, u in np.argwhere(expected != log.known)[:1].tolist():
        yield f"the map has {log.known[v, u]} at {(u, v)}, but {expected[v, u]} was reported"


class _KnownGround(TrueGround):
    """What the robots can reach on the map as it was reported."""

    def __init__(self, log: ReportedLog) -> None:
        super().__init__(np.where(log.known == UNKNOWN, np.uint8(0), log.known), log.metre)
        self._known, self._barred = log.known, log.zones.barred
        self._inside_area = log.zones.inside
        self._team = [(robot.kind, robot.cell) for robot in log.robots.values() if robot.cell or robot.carrier]

    def frontier(self) -> Mask:
        """Return the cells from which only unknown ones to be explored keep a robot from going on by one."""
        wanted = np.where((self._known == UNKNOWN) & ~self._barred & self._inside_area, np.uint8(1), self._known)
        wanted[self._barred] = 0
        found = np.zeros(wanted.shape, dtype=bool)
        reaches = (self._reaches(self._known, self._team, slack) for slack in (0.0, 1e-6))
        for (kind, exact), (_, slack) in zip(*reaches, strict=True):
            could = self._standable(kind | {"terrains": [*kind["terrains"], 1]}, wanted, 0.0)
            onto = np.pad(could & ~self._standable(kind, self._known, 1e-6), 1)
            beside = onto[:-2, 1:-1] | onto[2:, 1:-1] | onto[1:-1, :-2] | onto[1:-1, 2:]
            found |= exact & slack & beside
        return found

    def pockets(self) -> int:
        """Return how many cells lie in parts no larger than a rover, which need no search."""
        return self._pockets(self._known, self._team)


def _near(mask: Mask, reach: int) -> Mask:
    """Return the cells within some columns and rows of those of a mask."""
    found = np.zeros_like(mask)
    for y, x in np.argwhere(mask).tolist():
        found[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = True
    return found


def _parts(mask: Mask) -> Iterator[list[Cell]]:
    """Yield the cells of a mask in groups, no more than two columns and rows apart."""
    left = {(x, y) for y, x in np.argwhere(mask).tolist()}
    while left:
        part = [left.pop()]
        for x, y in part:
            near = {(x + u, y + v) for u in range(-2, 3) for v in range(-2, 3)} & left
            left -= near
            part += sorted(near)
        yield part

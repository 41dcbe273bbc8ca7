"""Zones in the storm: random ones, and the rules about them, by their documentation alone.

A cell belongs to a zone if its centre lies in the polygon, by the even-odd rule. Nobody enters a no-go zone that holds:
no part of a robot's footprint. Robots inside may leave, and a step that was under way when the zone began is completed.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterable, Iterator

import numpy as np

from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell, route
from marsupial.model.grid import Mask


def draw_zones(rng: random.Random, document: Document) -> list[Document]:
    """Return one to five zones for a scenario."""
    rows, resolution = document["map"]["rows"], document["map"]["resolution_m"]
    width, height = len(rows[0]) * resolution, len(rows) * resolution
    found: list[Document] = []
    for number in range(rng.choice((1, 1, 2, 3, 5))):
        kind = rng.choice(("no_go", "no_go", "no_go", "priority", "explore"))
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        reach = max(width, height) * (rng.uniform(0.3, 0.8) if kind == "explore" else rng.uniform(0.05, 0.6))
        angles = [rng.uniform(0, 2 * math.pi) for _ in range(rng.choice((3, 4, 4, 5, 9)))]
        if rng.random() < 0.8:  # the others cross themselves
            angles.sort()
        corners = [[round(x + reach * math.cos(a), 3), round(y + reach * math.sin(a), 3)] for a in angles]
        if kind == "no_go" and rng.random() < 0.3:  # a wall across the map
            across = [[x, -1], [x + 2 * resolution, -1], [x + 2 * resolution, height + 1], [x, height + 1]]
            corners = across if rng.random() < 0.5 else [[b, a] for a, b in across]
        elif rng.random() < 0.3:  # along the edges of cells, as a person would draw it on a grid
            corners = [[x, y], [x + reach, y], [x + reach, y + reach], [x, y + reach]]
            corners = [[round(a / resolution) * resolution for a in corner] for corner in corners]
        zone: Document = {"name": f"z{number}", "kind": kind, "polygon_m": corners}
        if kind == "priority":
            zone["weight"] = rng.choice((1, 2, 10, 1000))
        if rng.random() < 0.8:
            zone["from_s"] = round(10 ** rng.uniform(-1, 1.8), 3)
        if rng.random() < 0.3:
            zone["until_s"] = round(zone.get("from_s", 0) + 10 ** rng.uniform(-0.5, 2), 3)
        found.append(zone)
    return found


def zone_ahead(rng: random.Random, lines: Iterable[str], document: Document) -> list[Document]:
    """Return a no-go zone that closes the way of a robot during one of the drives of this log; none without drives."""
    begun: dict[str, Document] = {}
    drives: list[tuple[Document, int]] = []  # with the times when they end
    for event in map(json.loads, lines):
        if event["event"] == "drive":
            begun[event["robot"]] = event
        elif event["event"] == "stand" and event["robot"] in begun:
            drives.append((begun.pop(event["robot"]), event["t_ms"]))
    drives = [(drive, end_ms) for drive, end_ms in drives if len(drive["steps"]) > 3]
    if not drives:
        return []
    drive, end_ms = rng.choice(drives)
    way, share = route(tuple(drive["cell"]), drive["steps"]), rng.random()
    x, y = way[math.ceil(rng.uniform(share, 1) * (len(way) - 1))]
    resolution, reach = document["map"]["resolution_m"], rng.choice((0.5, 0.5, 1.5, 4.5))  # along edges of cells
    corners = [(x + 0.5 + u * reach, y + 0.5 + v * reach) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    at_ms = round(drive["t_ms"] + share * (end_ms - drive["t_ms"]))
    polygon = [[a * resolution, b * resolution] for a, b in corners]
    zone: Document = {"name": "ahead", "kind": "no_go", "polygon_m": polygon, "from_s": at_ms / 1000}
    if rng.random() < 0.5:
        zone["until_s"] = zone["from_s"] + rng.choice((1, 10, 100))
    return [zone]


class ScenarioZones:
    """The zones that hold in a mission, by its log so far."""

    def __init__(self, listed: Iterable[Document], shape: tuple[int, int], metre: float) -> None:
        self._listed = {zone["name"]: zone for zone in listed}
        self._masks = {name: _inside(zone["polygon_m"], shape, metre) for name, zone in self._listed.items()}
        self._nothing = np.zeros(shape, dtype=bool)
        self._since: dict[str, int] = {}  # the zones that hold
        self._over: list[tuple[str, int, int]] = []

    @property
    def dated(self) -> bool:
        """Whether the ground or the area to explore changes, or the area is only a part of the map."""
        return any(
            zone["kind"] == "explore" or (zone["kind"] == "no_go" and ("from_s" in zone or "until_s" in zone))
            for zone in self._listed.values()
        )

    @property
    def lasting(self) -> Mask:
        """The cells of no-go zones that hold for the whole mission."""
        return self._union(n for n, z in self._listed.items() if "from_s" not in z and "until_s" not in z)

    @property
    def barred(self) -> Mask:
        """The cells of the no-go zones that hold."""
        return self._union(self._since)

    @property
    def inside(self) -> Mask:
        """The cells to explore."""
        areas = [self._masks[name] for name in self._since if self._listed[name]["kind"] == "explore"]
        return np.logical_or.reduce(areas) if areas else ~self._nothing

    def change(self, event: Document) -> Iterator[str]:
        """Note that a zone holds or holds no more; yield what is wrong with that."""
        name, zone, t_ms = event["name"], event["zone"], event["t_ms"]
        asked = self._listed.get(name)
        if asked is None:
            yield f"there is no zone {name}"
            return
        due_s = asked.get("from_s", 0) if zone is not None else asked.get("until_s", -1)
        if round(1000 * due_s) != t_ms or (zone is None) != (name in self._since):
            yield f"the zone {name} changes, but not at that time"
        if zone is None:
            self._over.append((name, self._since.pop(name, t_ms), t_ms))
            return
        self._since[name] = t_ms
        weight = asked.get("weight", 1)
        if (zone["kind"], zone["polygon_m"], zone["weight"]) != (asked["kind"], asked["polygon_m"], weight):
            yield f"the zone {name} is {zone}"

    def missing(self, end_ms: int) -> Iterator[str]:
        """Yield the zones that should have begun or ended by the end of the mission."""
        begun = {name for name, _, _ in self._over} | self._since.keys()
        for name, zone in self._listed.items():
            if round(1000 * zone.get("from_s", 0)) < end_ms and name not in begun:
                yield f"the zone {name} never began"
            if round(1000 * zone.get("until_s", 1e12)) < end_ms and name in self._since:
                yield f"the zone {name} never ended"

    def entered(self, offsets: Iterable[Cell], way: Iterable[Cell]) -> Cell | None:
        """Return the first cell of a way that is in a no-go zone, unless the way only leads out of it."""
        barred, leaves = self.barred, True
        if not barred.any():
            return None
        for cell in way:
            touches = _touches(barred, offsets, cell)
            if touches and not leaves:
                return cell
            leaves = leaves and touches
        return None

    def trespass(self, offsets: Iterable[Cell], visits: Iterable[tuple[int, Cell]], end_ms: int) -> Iterator[str]:
        """Yield where a robot went on in a zone after the step that it was taking when the zone began."""
        held = [*self._over, *((name, since, end_ms) for name, since in self._since.items())]
        seen = list(visits)
        for name, since, until in held:
            if self._listed[name]["kind"] != "no_go":
                continue
            may = True
            for t_ms, cell in seen:
                if t_ms <= since or t_ms > until:
                    continue
                touches = _touches(self._masks[name], offsets, cell)
                if touches and not may:
                    yield f"enters {name} at {cell}, {t_ms} ms"
                    break
                may = touches

    def _union(self, names: Iterable[str]) -> Mask:
        masks = [self._masks[name] for name in names if self._listed[name]["kind"] == "no_go"]
        return np.logical_or.reduce([self._nothing, *masks])


def _touches(mask: Mask, offsets: Iterable[Cell], cell: Cell) -> bool:
    height, width = mask.shape
    under = ((cell[0] + u, cell[1] + v) for u, v in offsets)
    return any(0 <= x < width and 0 <= y < height and mask[y, x] for x, y in under)


def _inside(corners: list[list[float]], shape: tuple[int, int], metre: float) -> Mask:
    """Return the cells in a polygon: a ray to the right of the centre crosses its edges an odd number of times."""
    mask = np.zeros(shape, dtype=bool)
    edges = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for y in range(shape[0]):
        for x in range(shape[1]):
            at_x, at_y = (x + 0.5) / metre, (y + 0.5) / metre
            crossed = [
                ax + (at_y - ay) / (by - ay) * (bx - ax) > at_x
                for (ax, ay), (bx, by) in edges
                if (ay <= at_y) != (by <= at_y)
            ]
            mask[y, x] = sum(crossed) % 2 == 1
    return mask

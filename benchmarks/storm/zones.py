"""The zones that hold in a mission, by its log so far, and the rules about them, by their documentation alone.

A cell belongs to a zone if its centre lies in the polygon, by the even-odd rule. Nobody enters a no-go zone that holds:
no part of a robot's footprint. Robots inside may leave, and a step that was under way when the zone began is completed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.storm.ground import Document, inside
from benchmarks.storm.logs import Cell


class ScenarioZones:
    """The zones that a scenario asks for, and which of them hold; a metre has `metre` cells."""

    def __init__(self, listed: Iterable[Document], shape: tuple[int, int], metre: float) -> None:
        self._listed = {zone["name"]: zone for zone in listed}
        self._masks = {name: _polygon(zone["polygon_m"], shape, metre) for name, zone in self._listed.items()}
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
    def lasting(self) -> NDArray[np.bool_]:
        """The cells of no-go zones that hold for the whole mission."""
        return self._union(n for n, z in self._listed.items() if "from_s" not in z and "until_s" not in z)

    @property
    def barred(self) -> NDArray[np.bool_]:
        """The cells of the no-go zones that hold."""
        return self._union(self._since)

    @property
    def to_explore(self) -> NDArray[np.bool_]:
        """The cells to explore."""
        areas = [self._masks[name] for name in self._since if self._listed[name]["kind"] == "explore"]
        return np.logical_or.reduce(areas) if areas else ~self._nothing

    def wrong(self, event: Document) -> Iterator[str]:
        """Yield what is wrong with a `zone` event."""
        name, zone = event["name"], event["zone"]
        asked = self._listed.get(name)
        if asked is None:
            yield f"there is no zone {name}"
            return
        due_s = asked.get("from_s", 0) if zone is not None else asked.get("until_s", -1)
        if round(1000 * due_s) != event["t_ms"] or (zone is None) != (name in self._since):
            yield f"the zone {name} changes, but not at that time"
        expected = (asked["kind"], asked["polygon_m"], asked.get("weight", 1))
        if zone is not None and (zone["kind"], zone["polygon_m"], zone["weight"]) != expected:
            yield f"the zone {name} is {zone}"

    def change(self, event: Document) -> None:
        """Let a zone hold, or hold no more."""
        name, t_ms = event["name"], event["t_ms"]
        if event["zone"] is not None and name in self._listed:
            self._since[name] = t_ms
        elif name in self._since:
            self._over.append((name, self._since.pop(name), t_ms))

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
        visits = list(visits)
        for name, since, until in (*self._over, *((name, since, end_ms) for name, since in self._since.items())):
            if self._listed[name]["kind"] != "no_go":
                continue
            may = True
            for t_ms, cell in visits:
                if t_ms <= since or t_ms > until:
                    continue
                touches = _touches(self._masks[name], offsets, cell)
                if touches and not may:
                    yield f"enters {name} at {cell}, {t_ms} ms"
                    break
                may = touches

    def _union(self, names: Iterable[str]) -> NDArray[np.bool_]:
        masks = [self._masks[name] for name in names if self._listed[name]["kind"] == "no_go"]
        return np.logical_or.reduce([self._nothing, *masks])


def _touches(mask: NDArray[np.bool_], offsets: Iterable[Cell], cell: Cell) -> bool:
    under = ((cell[0] + u, cell[1] + v) for u, v in offsets)
    return any(inside(mask, (x, y)) and mask[y, x] for x, y in under)


def _polygon(corners: list[list[float]], shape: tuple[int, int], metre: float) -> NDArray[np.bool_]:
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

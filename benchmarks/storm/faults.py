"""The faults that a scenario asks for, and what they allow: losses, failures, other speeds, other ground."""

from __future__ import annotations

import math

from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell


class ScenarioFaults:
    """The faults of a mission; those by chance may happen at any time."""

    def __init__(self, scenario: Document, metre: float) -> None:
        self._listed: list[Document] = scenario.get("faults", [])
        self._metre = metre
        terrains = [terrain["name"] for terrain in scenario.get("terrains", [])]
        self._codes = {name: code for code, name in enumerate(("obstacle", "floor", "rough", *terrains))}
        self.what = {fault["fault"] for fault in self._listed}

    def of(self, name: str, *what: str) -> list[Document]:
        """Return the faults of these kinds that may happen to a robot."""
        return [fault for fault in self._listed if fault.get("robot", name) == name and fault["fault"] in what]

    def happen(self, t_ms: int, name: str, *what: str) -> bool:
        """Return whether one of these faults happens to a robot at a time, or may by chance."""
        return any("at_s" not in fault or round(1000 * fault["at_s"]) == t_ms for fault in self.of(name, *what))

    def understate(self, name: str) -> bool:
        """Return whether a robot may drive at another speed than it says."""
        return any(not fault.get("reported", True) for fault in self.of(name, "slows"))

    def may_become(self, t_ms: int, cell: Cell, code: int) -> bool:
        """Return whether a fault may have given a cell this terrain by a time."""
        for fault in self._listed:
            if fault["fault"] != "ground" or round(1000 * fault.get("at_s", 0)) > t_ms:
                continue
            columns, rows = (sorted(math.floor(fault["area_m"][i] * self._metre) for i in (k, k + 2)) for k in (0, 1))
            there = columns[0] <= cell[0] <= columns[1] and rows[0] <= cell[1] <= rows[1]
            if there and self._codes[fault["terrain"]] == code:
                return True
        return False

"""The charge of each battery: what drives, waits and charging do to it between the events of a log."""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell
from benchmarks.storm.robots import Robot


class ChargeAccount:
    """The charge of each battery in J, by the events of a log so far."""

    def __init__(self, chargers: list[Cell]) -> None:
        self._chargers = chargers
        self._level_j: dict[str, float] = {}
        self._t_ms = 0

    def level_j(self, name: str, robot: Robot) -> float:
        """Return the present charge of a robot."""
        return self._level_j.setdefault(name, robot.kind["battery"]["capacity_j"])

    def lose(self, name: str, robot: Robot, t_ms: int) -> None:
        """Let a robot be lost: its drive counts up to the last cell that it has passed, where it stands."""
        if "battery" in robot.kind and robot.drive and t_ms < robot.passed_ms[-1]:
            passed_ms = max(ms for ms in robot.passed_ms if ms <= t_ms)
            self._level_j[name] = self.level_j(name, robot) + _drive_w(robot) * (t_ms - passed_ms) / 1000

    def pass_to(self, t_ms: int, robots: Mapping[str, Robot], started: Mapping[str, Document]) -> None:
        """Let time pass."""
        before, self._t_ms = self._t_ms, t_ms
        given_j = dict.fromkeys(robots, 0.0)
        # rovers first: their carriers give them their charge
        for name, robot in sorted(robots.items(), key=lambda item: item[1].kind["role"] != "rover"):
            if "battery" not in robot.kind or t_ms == before or robot.lost:
                continue
            battery, energy, level_j = robot.kind["battery"], robot.kind["energy"], self.level_j(name, robot)
            docks = started.get(name, {"name": ""})["name"] in ("dock", "undock")
            gain_j = min(battery["capacity_j"] - level_j, battery["charge_w"] * (t_ms - before) / 1000)
            if robot.carrier is not None and not docks:
                given_j[robot.carrier] += gain_j
                self._level_j[name] = level_j + gain_j
            elif robot.cell in self._chargers and not robot.drive:
                self._level_j[name] = level_j + gain_j
            else:
                ends_ms = robot.passed_ms[-1] if robot.drive else before
                driven_s = max(0, min(t_ms, ends_ms) - before) / 1000
                used_j = energy["idle_w"] * (t_ms - before) / 1000 + _drive_w(robot) * driven_s
                self._level_j[name] = level_j - used_j - given_j[name]


def _drive_w(robot: Robot) -> float:
    """Return the power that a robot's drive takes in addition to standing."""
    energy = robot.kind["energy"]
    return float(energy["drive_w"] + energy["metre_j"] * robot.kind["speed_mps"] * robot.speed)

"""The rooms that simulated robots explore over `fake_ros`, their team, and its settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from fake_ros import SimulatedRobot
from support.maps.drawn_maps import carrier, draw, rover

from marsupial.model import FLOOR, Cell, Grid

ROOMS = (
    "########################################",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#####..###########..##########..########",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#######..########..#############..######",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "########################################",
)

CARRIER = carrier(radius_m=0.4, range_m=3.0, capacity=1)
ROVER = replace(rover(radius_m=0.1, range_m=2.5), terrains=frozenset({FLOOR}), dock_ms=3000, undock_ms=2000)


def rooms() -> Grid:
    """Return a map of 10 x 5 m: a hall, and rooms whose doors (0.5 m) only a rover fits through."""
    return replace(draw(*ROOMS, resolution_m=0.25), origin_m=(-2.0, 1.0, 0.0))


def team(grid: Grid, carriers: int = 2) -> list[SimulatedRobot]:
    """Return carriers in the hall, each with a rover aboard."""
    robots = []
    for i in range(1, carriers + 1):
        at = grid.centre_m(Cell(6 + 26 * (i - 1), 8))
        robots.append(SimulatedRobot(f"carrier{i}", CARRIER, (at[0] + 0.03, at[1] - 0.02)))
        robots.append(SimulatedRobot(f"rover{i}", ROVER, at, carrier=f"carrier{i}"))
    return robots


def settings_text(url: str, robots: list[SimulatedRobot], more: Mapping[str, str] | None = None) -> str:
    """Return settings for a team; `more` maps further fields to their YAML."""
    return "\n".join(_settings_lines(url, robots, more or {})) + "\n"


def _settings_lines(url: str, robots: list[SimulatedRobot], more: Mapping[str, str]) -> Iterator[str]:
    yield from ("format: marsupial-ros", "version: 1", "name: rooms", f"rosbridge: {url}", "clock: /clock")
    defaults = {"waits": "{silent_s: 60, lost_s: 120, stuck_s: 120, handover_s: 120}"}
    yield "planning: {planner: greedy, budget_s: 0.05}"
    yield "robot_types:"
    for kind in {robot.kind.name: robot.kind for robot in robots}.values():
        own = "capacity: 1" if kind is CARRIER else "dock_s: 3, undock_s: 2"
        own += "" if kind.radio_range_m is None else f", radio_range_m: {kind.radio_range_m}"
        yield (
            f"  - {{name: {kind.name}, role: {kind.role}, speed_mps: {kind.speed_mps}, radius_m: {kind.radius_m}, "
            f"sensor_range_m: {kind.sensor_range_m}, terrains: [floor], {own}}}"
        )
    yield "robots:"
    for robot in robots:
        aboard = f", carrier: {robot.carrier}" if robot.carrier else ""
        yield f"  - {{name: {robot.name}, type: {robot.kind.name}{aboard}}}"
    for key, value in {**defaults, **more}.items():
        yield f"{key}: {value}"

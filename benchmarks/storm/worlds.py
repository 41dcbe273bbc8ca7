"""Draw random scenarios: maps of many shapes, odd robot types, odd teams.

A scenario is the plain document of a scenario file, so that oracle and product read the same text. Most
draws are ordinary; each oddity (a robot with a range of one cell, an area without a door, a full carrier) has its own
share, because bugs come from combinations of them.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from benchmarks.storm.ground import Document

Rows = list[list[str]]

MAX_CELLS = 44
"""Longest side of a map, in cells. Small maps give more decisions a second, and a person can check them by eye."""


def _empty(rng: random.Random, width: int, height: int) -> Rows:
    return _walled([["."] * width for _ in range(height)])


def _walled(rows: Rows) -> Rows:
    for row in rows:
        row[0] = row[-1] = "#"
    rows[0] = ["#"] * len(rows[0])
    rows[-1] = ["#"] * len(rows[0])
    return rows


def _noise(rng: random.Random, width: int, height: int) -> Rows:
    share = rng.uniform(0.02, 0.3)
    return _walled([["#" if rng.random() < share else "." for _ in range(width)] for _ in range(height)])


def _rooms(rng: random.Random, width: int, height: int) -> Rows:
    """Cut the floor into rooms by binary partition; doors are one to four cells wide, and some are missing."""
    rows = _empty(rng, width, height)

    def cut(left: int, low: int, right: int, high: int) -> None:
        wide, tall = right - left, high - low
        if max(wide, tall) < 8 or rng.random() < 0.1:
            return
        door = rng.choice((1, 1, 2, 3, 4))
        if wide > tall:
            at = rng.randrange(left + 3, right - 3)
            gap = rng.randrange(low, max(low + 1, high - door))
            for y in range(low, high):
                if not gap <= y < gap + door or rng.random() < 0.03:
                    rows[y][at] = "#"
            cut(left, low, at, high)
            cut(at + 1, low, right, high)
        else:
            at = rng.randrange(low + 3, high - 3)
            gap = rng.randrange(left, max(left + 1, right - door))
            for x in range(left, right):
                if not gap <= x < gap + door:
                    rows[at][x] = "#"
            cut(left, low, right, at)
            cut(left, at + 1, right, high)

    cut(1, 1, width - 1, height - 1)
    return rows


def _cave(rng: random.Random, width: int, height: int) -> Rows:
    """Smooth noise with a cellular automaton: a cell is rock if most cells around it are."""
    rows = [["#" if rng.random() < 0.44 else "." for _ in range(width)] for _ in range(height)]
    for _ in range(3):
        old = [row[:] for row in _walled(rows)]
        for y in range(1, height - 1):
            for x in range(1, width - 1):
                rock = sum(old[y + v][x + u] == "#" for u in (-1, 0, 1) for v in (-1, 0, 1))
                rows[y][x] = "#" if rock >= 5 else "."
    return _walled(rows)


def _corridors(rng: random.Random, width: int, height: int) -> Rows:
    rows = [["#"] * width for _ in range(height)]
    x, y = width // 2, height // 2
    for _ in range(rng.randrange(4, 14)):
        across, length, half = rng.random() < 0.5, rng.randrange(4, 20), rng.choice((0, 0, 1, 2))
        step = rng.choice((-1, 1))
        for _ in range(length):
            for u in range(-half, half + 1):
                for v in range(-half, half + 1):
                    if 0 < x + u < width - 1 and 0 < y + v < height - 1:
                        rows[y + v][x + u] = "."
            x, y = (x + step, y) if across else (x, y + step)
            x, y = min(max(x, 1), width - 2), min(max(y, 1), height - 2)
    return rows


def _islands(rng: random.Random, width: int, height: int) -> Rows:
    """Draw separate areas without paths between them."""
    rows = _noise(rng, width, height)
    for _ in range(rng.choice((1, 2))):
        if rng.random() < 0.5:
            at = rng.randrange(2, width - 2)
            for row in rows:
                row[at] = "#"
        else:
            rows[rng.randrange(2, height - 2)] = ["#"] * width
    return rows


MAPS: dict[str, Callable[[random.Random, int, int], Rows]] = {
    "empty": _empty,
    "noise": _noise,
    "rooms": _rooms,
    "cave": _cave,
    "corridors": _corridors,
    "islands": _islands,
}


def _patches(rng: random.Random, rows: Rows, characters: str) -> None:
    """Turn rectangles of floor into other terrain, or into unknown cells."""
    for _ in range(rng.randrange(1, 6)):
        wide, tall = rng.randrange(2, 12), rng.randrange(2, 12)
        left, low, mark = rng.randrange(len(rows[0])), rng.randrange(len(rows)), rng.choice(characters)
        for row in rows[low : low + tall]:
            for x in range(left, min(left + wide, len(row))):
                if row[x] == ".":
                    row[x] = mark


def scenario(rng: random.Random, *, rovers: bool, most_robots: int | None = None) -> tuple[str, Document]:
    """Return the kind of map and a scenario document; robots' starts are given, or drawn by the mission's seed.

    Parameters
    ----------
    rovers
        Whether the team may have rovers.
    most_robots
        The most robots that the strategy can lead; None for any number.
    """
    kind = rng.choice(list(MAPS))
    rows = MAPS[kind](rng, rng.randrange(7, MAX_CELLS), rng.randrange(7, MAX_CELLS))
    marks = ""
    if rng.random() < 0.6:
        marks = rng.choice(("~", "~m", "~g", "~mg?", "?"))
        _patches(rng, rows, marks)
    resolution = rng.choice((0.05, 0.1, 0.25, 0.25, 0.5, 1.0))
    terrains = [{"name": "mud", "blocks_sight": False}, {"name": "grass", "blocks_sight": True}]
    document: Document = {
        "format": "marsupial-scenario",
        "version": 1,
        "name": f"storm-{kind}",
        "map": {
            "resolution_m": resolution,
            "legend": {"m": "mud", "g": "grass"},
            "rows": ["".join(row) for row in rows],
        },
        "terrains": terrains,
        "goal": {"recover_rovers": rng.random() < 0.8, "return_home": rng.random() < 0.25},
        "limits": {"time_s": rng.choice((14400, 14400, 14400, 600, 60, 5)), "coverage": rng.choice((*9 * (1,), 0.5))},
        "planning_time": rng.choice((*5 * ("instant",), "charged")),
    }
    document["robot_types"] = _types(rng, resolution, rovers)
    document["team"] = _team(rng, document["robot_types"], rovers, most_robots)
    return kind, document


def _types(rng: random.Random, resolution: float, rovers: bool) -> list[Document]:
    kinds = [_type(rng, f"carrier{letter}", resolution) for letter in "ABC"[: rng.choice((1, 1, 2, 3))]]
    for kind in kinds:
        kind |= {"role": "carrier", "capacity": rng.choice((1, 2, 2, 3, 4)) if rovers else 0}
    if not rovers:
        return kinds
    small = [_type(rng, f"rover{letter}", resolution) for letter in "ABC"[: rng.choice((1, 1, 2, 3))]]
    for kind in small:
        kind |= {"role": "rover", "dock_s": rng.choice((0, 0.001, 3, 10)), "undock_s": rng.choice((0, 2.5, 5))}
        if rng.random() < 0.7:  # most rovers are smaller than carriers and drive on more ground: the usual case
            kind["radius_m"] = round(min(kind["radius_m"], kinds[0]["radius_m"] / 2), 4)
            kind["terrains"] = ["floor", "rough", "mud", "grass"]
    return kinds + small


def _type(rng: random.Random, name: str, resolution: float) -> Document:
    kind: Document = {
        "name": name,
        "speed_mps": rng.choice((0.001, 0.3, 0.5, 1.0, 1.0, 2.0, 7.77)),
        "sensor_range_m": round(resolution * rng.choice((1.1, 1.5, 2, 4, 8, 8, 20, 40, 100)), 6),
        "radius_m": round(resolution * rng.choice((0, 0, 0.5, 1, 1.2, 2, 2.5)), 6),
        "terrains": ["floor", *rng.choice(((), (), ("rough",), ("mud",), ("rough", "mud", "grass")))],
        "energy": {"idle_w": rng.choice((0, 20)), "drive_w": rng.choice((0, 60)), "metre_j": rng.choice((0, 3.5))},
    }
    if kind["speed_mps"] == 0.001 and rng.random() < 0.8:  # so slow that hardly anything happens: make it rare
        kind["speed_mps"] = 1.0
    if rng.random() < 0.1:
        kind["diagonal"] = rng.choice((1, 1.2))
    if rng.random() < 0.1 and (kind["energy"]["metre_j"] or kind["energy"]["drive_w"]):
        kind["routes"] = "energy"
    if rng.random() < 0.1:
        kind["sensor_angle_deg"] = rng.choice((1, 30, 90, 180, 270, 360))
    return kind


def _team(rng: random.Random, types: list[Document], rovers: bool, most_robots: int | None) -> Any:
    carriers = [kind for kind in types if kind["role"] == "carrier"]
    small = [kind for kind in types if kind["role"] == "rover"]
    count = min(rng.choice((1, 2, 2, 3, 4, 6, 8)), most_robots or 8)
    team: list[Document] = []
    for index in range(1, count + 1):
        kind = rng.choice(carriers)
        team.append({"name": f"c{index}", "type": kind["name"], "start": "drawn"})
        if not rovers:
            continue
        aboard = rng.randrange(0, kind["capacity"] + 1)
        for number in range(1, aboard + 1):
            place = {"carrier": f"c{index}"} if rng.random() < 0.95 else {"start": "drawn"}
            team.append({"name": f"r{index}_{number}", "type": rng.choice(small)["name"], **place})
    return team

"""Draw what a scenario may have besides its map and team: faults, zones, seats, batteries and short radios.

Some are drawn from the log of a first run, so that they meet the robots where it matters.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterable

from benchmarks.storm.ground import Document, has_places
from benchmarks.storm.logs import route


def draw_faults(rng: random.Random, document: Document) -> list[Document]:
    """Return one to eight faults for a scenario, which may have drawn starts but names its robots."""
    rows, resolution = document["map"]["rows"], document["map"]["resolution_m"]
    size = (len(rows[0]) * resolution, len(rows) * resolution)
    names = [robot["name"] for robot in document["team"]]
    found: list[Document] = []
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8))):
        fault = rng.choice(("lost", "lost", "returns", "joins", "slows", "stuck", "declines", "docking_fails", "ground",
                            "ground", "missed_cells", "position_noise", "slows"))  # fmt: skip
        one: Document = {"fault": fault}
        when: Document = {"at_s": round(10 ** rng.uniform(0, 2.7), 3)}
        if fault == "ground":
            corner = [rng.uniform(0, length) for length in size]
            far = [at + resolution * rng.choice((1, 2, 6)) for at in corner]
            one |= {"area_m": [*corner, *far], "terrain": rng.choice(("obstacle", "obstacle", "floor", "mud"))}
            if rng.random() < 0.3:
                when = {"seen_m": corner}
        elif fault in ("missed_cells", "position_noise"):
            one, when = one | {"share": rng.choice((0.01, 0.1, 0.5)), "seed": rng.randrange(100)}, {}
            if fault == "position_noise" and rng.random() < 0.5:
                one["robot"] = rng.choice(names)
        else:
            one["robot"] = rng.choice(names)
        if fault in ("stuck", "declines", "docking_fails", "lost") and rng.random() < 0.2:
            when = {"rate_per_h": rng.choice((2, 20, 100)), "seed": rng.randrange(100)}
            if rng.random() < 0.5:
                del one["robot"]
        if fault == "slows" and rng.random() < 0.4:
            one["reported"] = False
        one |= {"slows": {"speed_share": rng.choice((0.1, 0.5, 0.9, 1.5))}, "stuck": {"for_s": 10.0}}.get(fault, {})
        found.append(one | when)
    return found


def lost_late(rng: random.Random, lines: Iterable[str], document: Document) -> list[Document]:
    """Return the loss of a rover or carrier near the end of a mission with this log, perhaps with its return."""
    end_ms = json.loads([*lines][-1])["t_ms"]
    kinds = {kind["name"]: kind["role"] for kind in document["robot_types"]}
    names = [robot["name"] for robot in document["team"] if kinds[robot["type"]] == "rover" or rng.random() < 0.2]
    if not names or not end_ms:
        return []
    name, at_ms = rng.choice(names), round(end_ms * rng.choice((0.6, 0.9, 0.97, 1)) * rng.uniform(0.95, 1))
    found: list[Document] = [{"fault": "lost", "robot": name, "at_s": at_ms / 1000}]
    if rng.random() < 0.5:
        found.append({"fault": "returns", "robot": name, "at_s": (at_ms + rng.choice((500, 20_000, 200_000))) / 1000})
    return found


def draw_seats(rng: random.Random, document: Document) -> None:
    """Give some carrier types seats by rover type; rovers aboard that have no place then start on the ground."""
    kinds = {kind["name"]: kind for kind in document["robot_types"]}
    small = [name for name, kind in kinds.items() if kind["role"] == "rover"]
    for kind in kinds.values():
        if small and kind["role"] == "carrier" and rng.random() < 0.7:
            named = rng.sample(small, rng.randrange(1, len(small) + 1))
            kind["seats"] = {name: rng.choice((0, 1, 1, 2, 4)) for name in named}
            if rng.random() < 0.3:
                kind["capacity"] = sum(kind["seats"].values())
    carriers = {robot["name"]: kinds[robot["type"]] for robot in document["team"] if "carrier" not in robot}
    aboard: dict[str, list[Document]] = {name: [] for name in carriers}
    for robot in document["team"]:
        if "carrier" in robot:
            load = [*aboard[robot["carrier"]], kinds[robot["type"]]]
            if has_places(carriers[robot["carrier"]], load):
                aboard[robot["carrier"]] = load
            else:
                del robot["carrier"]
                robot["start"] = "drawn"


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


def draw_batteries(rng: random.Random, document: Document) -> None:
    """Give some types batteries, and the map charging places."""
    resolution, rows = document["map"]["resolution_m"], document["map"]["rows"]
    floor = [(x, y) for y, row in enumerate(reversed(rows)) for x, mark in enumerate(row) if mark == "."]
    cells = rng.sample(floor, min(len(floor), rng.choice((0, 1, 3))))
    document["chargers"] = [{"at_m": [(x + 0.5) * resolution, (y + 0.5) * resolution]} for x, y in cells]
    for kind in document["robot_types"]:
        energy, rover = kind["energy"], kind["role"] == "rover"
        if rng.random() < (0.2 if rover else 0.5):
            continue
        energy["idle_w"] = energy["idle_w"] or 5
        watts = energy["idle_w"] + energy["drive_w"] + energy["metre_j"] * kind["speed_mps"]
        kind["battery"] = {
            "capacity_j": round(watts * 10 ** rng.uniform(1.5, 4), 3),
            "charge_w": rng.choice((0, 1, 3, 10)) * watts,
        }


def draw_ranges(rng: random.Random, document: Document) -> None:
    """Limit the radios of some rover types."""
    for kind in document["robot_types"]:
        if kind["role"] == "rover" and rng.random() < 0.8:
            kind["radio_range_m"] = round(document["map"]["resolution_m"] * rng.choice((0.1, 2, 4, 8, 16)), 6)

"""From the JSON of requests, whose shape is known to be right, to briefs and reports."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from marsupial.errors import EngineUnavailable, Problem, ScenarioError, UsageError
from marsupial.formats.fields import Fields
from marsupial.formats.scenario.map import read_terrains
from marsupial.formats.scenario.read import read_types
from marsupial.formats.scenario.team import Entry, Kinds, check_carriers, check_names
from marsupial.formats.situation import read_goal
from marsupial.model.grid import UNKNOWN, Cell, Grid, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.planning import Budget
from marsupial.model.robots import TeamMember
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.strategies.registry import strategy, strategy_names
from marsupial_service.intake import check_count, read_budget, refuse, refusing
from marsupial_service.intake_map import check_radii
from marsupial_service.missions.values import Brief, Report, RobotNote, Runs, expand, fault_of
from marsupial_service.settings import Limits

DEFAULT_BUDGET_S = 1.0


def read_brief(body: Mapping[str, Any], limits: Limits, commands: Mapping[str, str]) -> Brief:
    """Return the brief of a request; `commands` are the external planners that the operator allows, by name.

    Raises
    ------
    HttpProblem
        Naming everything that is wrong, or what there is too much of.
    """
    check_count("/team", len(body["team"]), limits.robots, "robots")
    check_count("/robot_types", len(body["robot_types"]), limits.robots, "robot types")
    frame = body["frame"]
    check_count("/frame", frame["width"] * frame["height"], limits.cells, "cells")
    budget, engine = read_budget(body, limits, DEFAULT_BUDGET_S), _read_planner(body, commands)
    problems: list[Problem] = []
    with refusing("", body):
        brief = _read(Fields(body, "", problems), body, budget, engine)
        if problems or brief is None:
            raise ScenarioError(problems)
    try:
        strategy(brief.strategy, planner=engine, budget=budget)
    except (UsageError, EngineUnavailable) as error:
        raise refuse("/planner", brief.without_command(str(error))) from error
    return brief


def _read_planner(body: Mapping[str, Any], commands: Mapping[str, str]) -> str:
    name: str = body.get("planner", "auto")
    if body.get("strategy", "temporal") not in strategy_names():
        raise refuse("/strategy", f"there is none of that name; there are {', '.join(strategy_names())}")
    if name in commands:
        return commands[name]
    if ":" in name:
        raise refuse("/planner", "command lines are not taken from clients")
    return name


def _read(top: Fields, body: Mapping[str, Any], budget: Budget, engine: str) -> Brief | None:
    frame = body["frame"]
    size = frame["width"] * frame["height"]
    terrains = read_terrains(top)
    kinds = read_types(top, terrains)
    codes = frozenset(terrain.code for terrain in terrains)
    _check_runs(top, "frame.known", frame.get("known", ()), size, codes)
    _check_runs(top, "area", body.get("area", ()), size, frozenset(range(256)))
    check_radii(top, kinds, frame["resolution_m"])
    goal = read_goal(top.part("goal", required=False))
    if top.problems:
        return None
    x, y, yaw = frame.get("origin_m", (0.0, 0.0, 0.0))
    cells = np.full(size, UNKNOWN, dtype=np.uint8)
    indices, known = expand(tuple(frame.get("known", ())))
    cells[indices] = known
    grid = Grid(
        cells=cells.reshape(frame["height"], frame["width"]),
        resolution_m=float(frame["resolution_m"]),
        origin_m=(float(x), float(y), float(yaw)),
        terrains=terrains,
    )
    return Brief(
        name=body.get("name", "mission"),
        strategy=body.get("strategy", "temporal"),
        planner=body.get("planner", "auto"),
        engine=engine,
        budget=budget,
        seed=body.get("seed", 0),
        grid=grid,
        kinds=tuple(kind for kind in kinds.values() if kind is not None),
        robots=_read_team(top, kinds, grid),
        goal=Goal(recover_rovers=goal.recover_rovers, return_home=goal.return_home),
        limits=MissionLimits(time_ms=body.get("time_limit_ms", MissionLimits().time_ms)),
        planning_time=PlanningTime(body.get("planning_time", "instant")),
        reachable=_read_area(body, grid) if "area" in body else None,
    )


def _read_area(body: Mapping[str, Any], grid: Grid) -> Mask:
    area = np.zeros(grid.cells.size, dtype=np.bool_)
    area[expand(tuple(body["area"]))[0]] = True
    return area.reshape(grid.cells.shape)


def _read_team(top: Fields, kinds: Kinds, grid: Grid) -> tuple[PlacedRobot, ...]:
    entries = []
    for fields in top.parts("team"):
        name, kind = fields.text("name"), fields.choice("type", kinds, what="robot type")
        given = [key for key in ("pose_m", "cell", "carrier") if fields.has(key)]
        if len(given) != 1:
            fields.wrong("", f"needs one of pose_m, cell, carrier, got {' and '.join(given) or 'none'}")
        cell = _place(fields.data, grid)
        if cell is not None and not grid.contains(cell):
            fields.wrong("cell" if "cell" in fields.data else "pose_m", "lies outside the map")
        carrier = fields.text("carrier") if fields.has("carrier") else None
        entries.append(Entry(fields, TeamMember(name=name, type=kind, start=cell, carrier=carrier)))
    check_names(entries)
    check_carriers(entries, kinds)
    members = [entry.member for entry in entries]
    return tuple(PlacedRobot(name=m.name, type=m.type, cell=m.start, carrier=m.carrier) for m in members)


def _place(fields: Mapping[str, Any], grid: Grid) -> Cell | None:
    if "cell" in fields:
        return Cell(*fields["cell"])
    return grid.cell_at_m(*fields["pose_m"]) if "pose_m" in fields else None


def _check_runs(top: Fields, path: str, runs: Runs, size: int, codes: frozenset[int]) -> None:
    fault = fault_of(runs, size, codes)
    if fault is not None:
        top.wrong(path, fault)


def read_report(body: Mapping[str, Any], brief: Brief) -> Report:
    """Return the report of a request.

    Raises
    ------
    HttpProblem
        Naming everything that is wrong in it, whatever has happened before.
    """
    with refusing("", body):
        problems = list(_Reading(brief).faults(body))
        if problems:
            raise ScenarioError(problems)
    grid, cells = brief.grid, None
    if "map" in body:
        indices, codes = expand(tuple(body["map"]["runs"]))
        cells = np.full(grid.cells.shape, UNKNOWN, dtype=np.uint8)
        cells.reshape(-1)[indices] = codes
    return Report(
        n=body["n"],
        t_ms=body["t_ms"],
        revealed=tuple((seen["robot"], tuple(seen["runs"])) for seen in body.get("revealed", ())),
        map=cells,
        robots=tuple(
            RobotNote(
                name=note["name"],
                cell=_place(note, grid),
                free_at_ms=note.get("free_at_ms"),
                distance_m=float(note["distance_m"]) if "distance_m" in note else None,
                driving_ms=note.get("driving_ms"),
            )
            for note in body.get("robots", ())
        ),
        finished=tuple(body.get("finished", ())),
        failed=tuple((failed["id"], failed.get("reason", "")) for failed in body.get("failed", ())),
        lost=tuple((lost["robot"], lost.get("reason", "")) for lost in body.get("lost", ())),
    )


@dataclass(frozen=True, slots=True)
class _Reading:
    """What reports of a mission may speak of."""

    brief: Brief

    def faults(self, body: Mapping[str, Any]) -> Iterator[Problem]:
        names = [(f"robots[{i}].name", note["name"]) for i, note in enumerate(body.get("robots", ()))]
        lost = [(f"lost[{i}].robot", one["robot"]) for i, one in enumerate(body.get("lost", ()))]
        seers = [(f"revealed[{i}].robot", seen["robot"]) for i, seen in enumerate(body.get("revealed", ()))]
        known = {robot.name for robot in self.brief.robots}
        for path, name in (*names, *lost, *seers):
            if name not in known:
                yield Problem(path, f"there is no robot {name!r}")
        ids = [(f"finished[{i}]", number) for i, number in enumerate(body.get("finished", ()))]
        ids += [(f"failed[{i}].id", failed["id"]) for i, failed in enumerate(body.get("failed", ()))]
        for pairs in (names, lost, ids):
            yield from _twice(pairs)
        yield from self._map_faults(body)
        for i, note in enumerate(body.get("robots", ())):
            yield from self._pose_faults(f"robots[{i}]", note)

    def _map_faults(self, body: Mapping[str, Any]) -> Iterator[Problem]:
        grid = self.brief.grid
        codes = frozenset(terrain.code for terrain in grid.terrains)
        runs = [(f"revealed[{i}].runs", seen["runs"]) for i, seen in enumerate(body.get("revealed", ()))]
        if "map" in body:
            if runs:
                yield Problem("map", "a report has either a map or what was revealed")
            runs.append(("map.runs", body["map"]["runs"]))
        for path, numbers in runs:
            fault = fault_of(numbers, grid.cells.size, codes)
            if fault is not None:
                yield Problem(path, fault)

    def _pose_faults(self, path: str, note: Mapping[str, Any]) -> Iterator[Problem]:
        if "cell" in note and "pose_m" in note:
            yield Problem(f"{path}.pose_m", "give the cell or the pose, not both")
            return
        cell = _place(note, self.brief.grid)
        if cell is not None and not self.brief.grid.contains(cell):
            yield Problem(f"{path}.{'cell' if 'cell' in note else 'pose_m'}", "lies outside the map")


def _twice(pairs: Iterable[tuple[str, object]]) -> Iterator[Problem]:
    seen: set[object] = set()
    for path, value in pairs:
        if value in seen:
            yield Problem(path, f"{value} is given twice")
        seen.add(value)

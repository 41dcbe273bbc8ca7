"""Convert the bodies of requests, whose shape is validated already, to briefs and reports."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.errors import EngineUnavailable, InputError, ScenarioError, UsageError
from marsupial.formats.fields import Fields, Notes
from marsupial.formats.scenario.map import read_terrains
from marsupial.formats.scenario.team import MemberEntry, standing_fault
from marsupial.formats.scenario.zones import conflict, name_faults
from marsupial.maps.discs import fits
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.missionframe import MissionFrame, frame_at
from marsupial.model.robots import RobotType
from marsupial.model.runs import Runs, cells_in, drawn, known_runs, runs_fault
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.sizes import Extent
from marsupial.model.zones import DatedZone, Zone, ZoneChange, ZoneKind, zone_faults
from marsupial.strategies.registry import check_suits, is_strategy, strategy, strategy_names
from marsupial.wording import unknown_name
from marsupial_service.analyses.situations import budget_of, field_error
from marsupial_service.analyses.team import ORIGIN, Types, cell_of, chargers_of, check_charge, entries_of, types_of
from marsupial_service.entries.documents import text_of
from marsupial_service.entries.records import canonical_text, digest_of
from marsupial_service.intake.reading import BodyReader, ParsedBody
from marsupial_service.missions.values import MissionBrief, MissionReport, MissionTask, StoredReport
from marsupial_service.planners import engine_name
from marsupial_service.problems import check_count
from marsupial_service.schemas.answers import KnownMapAnswer
from marsupial_service.schemas.missions import (
    BatchBody,
    DatedZoneBody,
    MissionBody,
    ReportBody,
    ReportFrameBody,
    ReportsBody,
    ZoneBody,
)
from marsupial_service.settings import ServiceLimits

DEFAULT_BUDGET_S = 1.0


def brief_of(body: MissionBody, limits: ServiceLimits, commands: Mapping[str, str]) -> MissionBrief:
    """Return the brief of a request; `commands` are the external planners that the operator allows, by name.

    Raises InputError naming everything that is wrong, or HttpProblem if there is too much of something.
    """
    check_count("/frame", body.frame.width * body.frame.height, limits.cells, "cells")
    budget, engine = budget_of(body.budget, limits, DEFAULT_BUDGET_S), _engine(body, commands)
    grid, types = _map_and_types(body, limits)
    notes = Notes()
    grid = replace(grid, chargers=chargers_of(body.chargers, grid, notes))
    entries = entries_of(body.team, types, grid, notes.below("team"))
    _check_starts(entries, body, types, grid)
    if body.coverage < 1 and body.area is None:
        notes.wrong("coverage", "needs the area to explore (area): it is a share of that")
    members = [entry.member for entry in entries]
    zones = zones_of(body.zones, notes)
    brief = MissionBrief(
        name=body.name,
        strategy=body.strategy,
        planner=body.planner,
        budget=budget,
        seed=body.seed,
        grid=grid,
        kinds=tuple(types.values()),
        robots=tuple(PlacedRobot(name=m.name, type=m.type, cell=m.start, carrier=m.carrier) for m in members),
        goal=body.goal or Goal(recover_rovers=False),
        limits=MissionLimits(time_ms=body.time_limit_ms, coverage=body.coverage),
        planning_time=PlanningTime(body.planning_time),
        reachable=None if body.area is None else _mask(body.area, grid),
        zones=zones,
        map_may_grow=body.map_may_grow,
    )
    for i, dated in enumerate(zones):
        if fault := conflict(dated, grid, brief.goal, _starts(brief)):
            notes.wrong(f"zones[{i}].polygon_m", fault)
    notes.check(ScenarioError)
    try:
        decider = strategy(brief.strategy, planner=engine, budget=budget)
    except (UsageError, EngineUnavailable) as error:
        raise field_error("planner", MissionTask(brief, engine).without_command(str(error))) from error
    try:
        check_suits(decider, [types[robot.type].role for robot in brief.robots])
    except ScenarioError as error:
        raise field_error("strategy", str(error)) from error
    return brief


def zones_of(asked: Sequence[DatedZoneBody], notes: Notes) -> tuple[DatedZone, ...]:
    """Return the zones of a request; note all that is wrong with them."""
    zones = []
    for i, sent in enumerate(asked):
        until_ms = None if sent.until_s is None else round(1000 * sent.until_s)
        from_ms = round(1000 * sent.from_s)
        zones.append(_zone(sent.name, sent, notes.below(f"zones[{i}]"), from_ms=from_ms, until_ms=until_ms))
    for path, fault in name_faults(zones):
        notes.wrong(f"zones{path}", fault)
    return tuple(zones)


def _zone(name: str, sent: ZoneBody, notes: Notes, *, from_ms: int = 0, until_ms: int | None = None) -> DatedZone:
    kind = ZoneKind(sent.kind)
    if kind is ZoneKind.PRIORITY and sent.weight is None:
        notes.wrong("weight", "missing")
    zone = Zone(kind=kind, polygon_m=tuple(sent.polygon_m), weight=1.0 if sent.weight is None else sent.weight)
    dated = DatedZone(name=name, zone=zone, from_ms=from_ms, until_ms=until_ms)
    for key, fault in zone_faults(dated):
        notes.wrong(key, fault)
    return dated


def _starts(brief: MissionBrief) -> list[tuple[str, RobotType, Cell | None]]:
    kinds = {kind.name: kind for kind in brief.kinds}
    return [(robot.name, kinds[robot.type], robot.cell) for robot in brief.robots]


def _check_starts(entries: Sequence[MemberEntry], body: MissionBody, types: Types, grid: Grid) -> None:
    """Note robots on ground that is known to be none for them; where it is unknown, the mission waits for a map."""
    for kind in types.values():
        explored = replace(grid, cells=np.where(grid.cells == UNKNOWN, np.uint8(min(kind.terrains)), grid.cells))
        for entry, sent in zip(entries, body.team, strict=True):
            start = entry.member.start
            if entry.member.type == kind.name and start is not None and not fits(explored, kind, start):
                fault = standing_fault(grid, kind, start)
                key = "cell" if sent.pose_m is None else "pose_m"
                entry.notes.wrong(key, f"a {kind.name} can't stand at [{start.x}, {start.y}]: {fault}")


def _engine(body: MissionBody, commands: Mapping[str, str]) -> str:
    if not is_strategy(body.strategy):
        raise field_error("strategy", unknown_name("strategy", body.strategy, strategy_names()))
    try:
        return engine_name(body.planner, commands)
    except UsageError as error:
        raise field_error("planner", str(error)) from error


def _map_and_types(body: MissionBody, limits: ServiceLimits) -> tuple[Grid, Types]:
    """Return the known map, and the robot types for it."""
    frame = body.frame
    notes = Fields({"terrains": body.terrains, "robot_types": body.robot_types}, "", [])
    size = frame.width * frame.height
    terrains = read_terrains(notes)
    types = types_of(notes, terrains, Extent(size, frame.resolution_m), limits)
    _check_runs(frame.known, size, {terrain.code for terrain in terrains}, "frame.known", notes)
    _check_runs(body.area or (), size, range(256), "area", notes)
    notes.check(ScenarioError)
    grid = Grid(
        cells=drawn(frame.known, (frame.height, frame.width)),
        resolution_m=frame.resolution_m,
        origin_m=frame.origin_m or ORIGIN,
        terrains=terrains,
    )
    return grid, types


def _mask(runs: Runs, grid: Grid) -> Mask:
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    mask.reshape(-1)[cells_in(runs)[0]] = True
    return mask


def _check_runs(runs: Sequence[int], size: int, codes: Iterable[int], path: str, notes: Notes) -> None:
    fault = runs_fault(runs, size, frozenset(codes))
    if fault is not None:
        notes.wrong(path, fault)


def report_of(body: ReportBody, brief: MissionBrief, frame: MissionFrame, most_cells: int) -> MissionReport:
    """Return the report of a request, whatever happened before. Raises ScenarioError naming all that is wrong.

    `frame` is that of the mission when the report comes.
    """
    notes, own = Notes(), frame
    if body.frame is not None:
        own = _frame(body.frame, brief.grid, notes, most_cells) or own
        notes.check(ScenarioError)
    grid = own.grid(brief.grid, np.broadcast_to(np.uint8(UNKNOWN), (own.height, own.width)))
    robots, kinds = list(body.robots), brief.kind_of
    _check_names(body, kinds, notes)
    _check_map(body, grid, notes)
    for i, note in enumerate(body.robots):
        here = notes.below(f"robots[{i}]")
        if note.cell is not None and note.pose_m is not None:
            here.wrong("pose_m", "give cell or pose_m, not both")
        check_charge(note.charge, kinds.get(note.name), here)
        cell = cell_of(note, grid, here)
        if note.pose_m is not None:
            robots[i] = note.model_copy(update={"cell": cell, "pose_m": None})
    notes.check(ScenarioError)
    return MissionReport.model_construct(
        **{**dict(body), "robots": robots, "frame": None if own == MissionFrame.of(brief.grid) else own}
    )


def reports_of(
    body: ReportsBody, sent: ParsedBody, limits: ServiceLimits, brief: MissionBrief, frame: MissionFrame
) -> tuple[list[StoredReport], bool]:
    """Return the reports of a request with their digests, and whether it is a batch; see `report_of`.

    Cells of each are of the frame that those before it leave.
    """
    is_batch = isinstance(body.root, BatchBody)
    revealed = sum(sum(seen.runs[1::3]) for one in _bodies(body) for seen in one.revealed)  # lengths of runs
    check_count("/reports" if is_batch else "/revealed", revealed, max(limits.cells, frame.size), "cells")
    if isinstance(body.root, ReportBody):
        return [(report_of(body.root, brief, frame, limits.cells), sent.digest)], False
    # the maps of a batch may have no more cells in all than one map may have: few runs make many cells
    frames = [one.frame for one in body.root.reports if one.map is not None]
    cells = sum(frame.size if one is None else one.width * one.height for one in frames)
    check_count("/reports", cells if len(frames) > 1 else 0, limits.cells, "cells in their maps")
    digests = [digest_of(canonical_text(one)) for one in sent.document["reports"]]
    reports: list[MissionReport] = []
    for i, one in enumerate(body.root.reports):
        try:
            reports.append(report_of(one, brief, frame, limits.cells))
        except InputError as error:
            notes = Notes(f"reports[{i}]")
            notes.take(error)
            raise ScenarioError(notes.problems) from error
        frame = frame.grown(reports[-1].frame or frame)
    return list(zip(reports, digests, strict=True)), True


def _frame(body: ReportFrameBody, grid: Grid, notes: Notes, most_cells: int) -> MissionFrame | None:
    """Return the frame that a report names, or None with what is wrong with it noted."""
    if body.width * body.height > most_cells:
        notes.wrong("frame", f"has {body.width * body.height} cells, more than the limit of {most_cells}")
    if body.resolution_m is not None and body.resolution_m != grid.resolution_m:
        notes.wrong("frame.resolution_m", f"must be the mission's, {grid.resolution_m:g}, got {body.resolution_m:g}")
    frame = frame_at(grid, body.width, body.height, body.origin_m or grid.origin_m)
    if frame is None:
        notes.wrong("frame.origin_m", f"must have the yaw of the mission's frame, {grid.origin_m[2]:g}")
    return frame


def _check_names(body: ReportBody, known: Mapping[str, RobotType], notes: Notes) -> None:
    """Note robots that are not of the team, duplicates, and robots that can't be out of contact."""
    names = [(f"robots[{i}].name", note.name) for i, note in enumerate(body.robots)]
    lost = [(f"lost[{i}].robot", one.robot) for i, one in enumerate(body.lost)]
    reporter = [] if body.robot is None else [("robot", body.robot)]
    observers = [(f"revealed[{i}].robot", seen.robot) for i, seen in enumerate(body.revealed)]
    returned = [(f"returned[{i}]", name) for i, name in enumerate(body.returned)]
    contacts = [(f"out_of_contact[{i}].robot", one.robot) for i, one in enumerate(body.out_of_contact)]
    contacts += [(f"in_contact[{i}]", name) for i, name in enumerate(body.in_contact)]
    for path, name in (*reporter, *names, *lost, *returned, *contacts, *observers):
        if name not in known:
            notes.wrong(path, f"unknown robot {name!r}")
    for path, name in contacts:
        if name in known and known[name].radio_range_m is None:
            notes.wrong(path, f"a {known[name].name} is always in contact: it has no radio_range_m")
    for pairs in (names, lost, [*lost, *returned], contacts, body.ended()):
        seen_before: set[object] = set()
        for path, value in pairs:
            if value in seen_before:
                notes.wrong(path, f"{value} is given twice")
            seen_before.add(value)


def _check_map(body: ReportBody, grid: Grid, notes: Notes) -> None:
    if body.map is not None and body.revealed:
        notes.wrong("map", "a report must not have both map and revealed")
    codes = {terrain.code for terrain in grid.terrains}
    for i, seen in enumerate(body.revealed):
        _check_runs(seen.runs, grid.cells.size, codes | {UNKNOWN}, f"revealed[{i}].runs", notes)
    if body.map is not None:
        _check_runs(body.map.runs, grid.cells.size, codes, "map.runs", notes)


def _change_of(body: ZoneBody, sent: ParsedBody, limits: ServiceLimits, name: str, brief: MissionBrief) -> ZoneChange:
    """Return the change that a request asks for; the home of a carrier that has to return must stay free."""
    notes = Notes()
    dated = _zone(name, body, notes, from_ms=1)  # robots inside may leave
    fault = None if notes.problems else conflict(dated, brief.grid, brief.goal, _starts(brief))
    if fault is not None:
        notes.wrong("polygon_m", fault)
    notes.check(ScenarioError)
    return ZoneChange(name=name, zone=dated.zone)


def _mission_of(
    body: MissionBody, sent: ParsedBody, limits: ServiceLimits, commands: Mapping[str, str]
) -> tuple[MissionBrief, bytes]:
    return brief_of(body, limits, commands), sent.digest


def _bodies(body: ReportsBody) -> Sequence[ReportBody]:
    return body.root.reports if isinstance(body.root, BatchBody) else [body.root]


def _has_no_map(body: ReportsBody) -> bool:
    """Return whether no report has a whole map: even a few runs of a map expand to all cells of a frame."""
    return all(one.map is None for one in _bodies(body))


# to what they mean, and the digest of what was sent
MISSION_READER = BodyReader(model=MissionBody, make=_mission_of)
ZONE_READER = BodyReader(model=ZoneBody, make=_change_of)
REPORT_READER = BodyReader(model=ReportsBody, make=reports_of, is_quick=_has_no_map)


def changes_in(cells: CellArray) -> int:
    """Return how often a cell differs from the one before it: that is about the number of runs."""
    return int(np.count_nonzero(np.diff(cells.ravel())))


def known_map_text(known: Grid) -> bytes:
    return text_of(KnownMapAnswer.of(known, runs=known_runs(known.cells))).encode()

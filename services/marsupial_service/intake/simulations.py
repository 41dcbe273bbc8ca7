"""Convert the body of a simulation to the brief of a mission.

The brief is made from the same document that `marsupial run --server` sends, so the same rules apply and the log is the
same.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PureWindowsPath

import numpy as np

from marsupial.errors import EngineUnavailable, InputError, Problem, ScenarioError
from marsupial.exports.ground import coarse
from marsupial.exports.mapclasses import MapClass, map_classes
from marsupial.formats.fields import Fields, Notes
from marsupial.formats.mapfiles.nav2 import known_in, understand_image
from marsupial.formats.scenario.faults import read_faults
from marsupial.formats.scenario.team import start_fault
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario
from marsupial.library.choices import planner_for
from marsupial.library.missions import reachable_area
from marsupial.maps.describe import describe
from marsupial.mission.placement import place_team
from marsupial.model.faults import dated
from marsupial.model.grid import MapReading
from marsupial.model.mission import PlacedRobot
from marsupial.model.robots import Battery, RobotType, Role
from marsupial.model.runs import known_runs
from marsupial.model.scenario import Scenario
from marsupial.model.zones import covered
from marsupial.wording import unknown_name
from marsupial_service.analyses.maps import decoded_image, yaml_header
from marsupial_service.analyses.situations import budget_of, field_error
from marsupial_service.analyses.team import chargers_of
from marsupial_service.entries.documents import text_of
from marsupial_service.intake.missions import DEFAULT_BUDGET_S, brief_of, zones_of
from marsupial_service.intake.reading import INLINE_CELLS, BodyReader, ParsedBody
from marsupial_service.missions.simulated import mission_document
from marsupial_service.missions.values import MissionBrief, RobotSimulation
from marsupial_service.problems import check_count, problem_of
from marsupial_service.schemas.answers import PreviewAnswer, PreviewRobotAnswer, ProblemDetailAnswer
from marsupial_service.schemas.missions import MissionBody
from marsupial_service.schemas.simulations import (
    MOST_COARSER,
    BatteriesBody,
    MapSimulationBody,
    ScenarioSimulationBody,
    SimulationBody,
    UploadedMapBody,
)
from marsupial_service.settings import ServiceLimits

PREVIEW_CELLS = 400_000  # most cells of a preview: more than a screen shows

AnySimulation = ScenarioSimulationBody | MapSimulationBody


def simulation_of(
    body: SimulationBody, sent: ParsedBody, limits: ServiceLimits, commands: Mapping[str, str]
) -> tuple[MissionBrief, bytes]:
    """Return the brief of a request and the digest of what was sent; `commands` as in `brief_of`.

    Raises InputError naming what is wrong by the fields of the request, HttpProblem if there is too much of something.
    """
    request: AnySimulation = body.root
    budget = budget_of(request.budget, limits, DEFAULT_BUDGET_S)
    scenario, warnings = _scenario_of(request, limits)
    scenario = _fixed(request, scenario)
    notes = Fields({"faults": request.faults}, "", [])
    faults = read_faults(notes, [member.name for member in scenario.team], scenario.grid.terrains, scenario.grid)
    notes.check(ScenarioError)
    scenario = replace(scenario, faults=faults, limits=replace(scenario.limits, coverage=request.coverage))
    roles = {member.name: scenario.type_of(member).role for member in scenario.team}
    for _ in dated(faults, roles, scenario.limits.time_ms, request.seed):
        pass  # raises if there are too many
    team = _placed(request, scenario, warnings)
    try:
        planner = str(planner_for(request.strategy, request.planner))
    except EngineUnavailable as error:
        raise field_error("strategy", str(error)) from error
    document = mission_document(
        scenario,
        team,
        reachable_area(scenario, team),
        strategy=request.strategy,
        planner=planner,
        budget=budget,
        seed=request.seed,
    )
    brief = brief_of(MissionBody.model_validate(document), limits, commands)
    simulation = RobotSimulation(
        truth=known_runs(scenario.grid.cells), speed=request.speed, warnings=warnings, faults=tuple(request.faults)
    )
    return replace(brief, simulation=simulation), sent.digest


def preview_of(body: SimulationBody, sent: ParsedBody, limits: ServiceLimits) -> bytes:
    """Return as JSON how a map is understood and where the robots would start, or what keeps them from it.

    Raises InputError or HttpProblem if there is no map.
    """
    request: AnySimulation = body.root
    scenario, warnings = _scenario_of(request, limits)
    team: tuple[PlacedRobot, ...] = ()
    errors: Sequence[ProblemDetailAnswer] = ()
    try:
        team = _placed(request, _fixed(request, scenario), ())
    except InputError as error:
        errors = problem_of(error, sent.document).errors
    grid, block = scenario.grid, math.ceil(math.sqrt(scenario.grid.cells.size / PREVIEW_CELLS))
    classes = map_classes(grid, scenario.robot_types)
    if team:
        # no robot drives there from elsewhere, but carriers can set rovers down there
        classes[(classes == MapClass.ISLAND) & reachable_area(scenario, team)] = MapClass.ROVERS
    picture = coarse(classes, block) if block > 1 else classes
    roles = {kind.name: kind.role for kind in scenario.robot_types}
    answer = PreviewAnswer(
        width=picture.shape[1],
        height=picture.shape[0],
        resolution_m=grid.resolution_m * block,
        origin_m=list(grid.origin_m),
        runs=list(known_runs(picture)),
        robots=[
            PreviewRobotAnswer(name=robot.name, role=roles[robot.type], point_m=list(grid.centre_m(robot.cell)))
            for robot in team
            if robot.cell is not None
        ],
        warnings=list(warnings),
        errors=list(errors),
    )
    return text_of(answer).encode()


def _scenario_of(request: AnySimulation, limits: ServiceLimits) -> tuple[Scenario, tuple[str, ...]]:
    """Return the scenario with the team's starts to be drawn, and warnings about an uploaded map."""
    check_count("/carriers", request.carriers * (1 + request.rovers), limits.robots, "robots with their rovers")
    if isinstance(request, ScenarioSimulationBody):
        return _built_in(request, limits), ()
    reading = _map_of(request.map, limits)
    try:
        scenario = bare_map_scenario(request.map.name, reading.grid, request.carriers, request.rovers, limits.sizes)
    except ScenarioError as error:
        raise field_error("map.yaml", str(error)) from error
    return scenario, describe(scenario.grid, scenario.robot_types, reading=reading).warnings


def _fixed(request: AnySimulation, scenario: Scenario) -> Scenario:
    """Return the scenario with what a request says of it besides its map and team. Raises InputError."""
    notes, team, grid = Notes(), list(scenario.team), scenario.grid
    carriers = [i for i, member in enumerate(team) if member.carrier is None]
    if len(request.starts_m) > len(carriers):
        notes.wrong("starts_m", f"has {len(request.starts_m)} points for {len(carriers)} carriers")
    for number, (i, point) in enumerate(zip(carriers, request.starts_m, strict=False)):
        if fault := start_fault(grid, scenario.type_of(team[i]), point):
            notes.wrong(f"starts_m[{number}]", fault)
        team[i] = replace(team[i], start=grid.cell_at_m(*point))
    zones = zones_of(request.zones, notes)
    for number, zone in enumerate(zones):
        if not covered(grid, zone.zone.polygon_m).any():
            notes.wrong(f"zones[{number}].polygon_m", "contains the centre of no cell of the map")
    if request.chargers:
        grid = replace(grid, chargers=chargers_of(request.chargers, grid, notes))
    notes.check(InputError)
    kinds = _with_batteries(scenario.robot_types, request.batteries)
    if (range_m := request.radio_range_m) is not None:
        kinds = tuple(replace(kind, radio_range_m=range_m) if kind.role is Role.ROVER else kind for kind in kinds)
    return replace(scenario, grid=grid, robot_types=kinds, team=tuple(team), zones=zones)


def _with_batteries(kinds: Sequence[RobotType], given: BatteriesBody | None) -> tuple[RobotType, ...]:
    """Return the robot types with the batteries of their roles."""
    of_role = {} if given is None else {Role.CARRIER: given.carrier, Role.ROVER: given.rover}
    batteries = {
        role: Battery(capacity_j=body.capacity_j, charge_w=body.charge_w) for role, body in of_role.items() if body
    }
    return tuple(replace(kind, battery=batteries.get(kind.role, kind.battery)) for kind in kinds)


def _built_in(request: ScenarioSimulationBody, limits: ServiceLimits) -> Scenario:
    if request.scenario not in SCENARIOS:
        raise field_error("scenario", unknown_name("scenario", request.scenario, SCENARIOS))
    scenario = builtin_scenario(request.scenario, request.carriers, request.rovers)
    check_count("/scenario", scenario.grid.cells.size, limits.cells, "cells")
    return scenario


def _map_of(body: UploadedMapBody, limits: ServiceLimits) -> MapReading:
    notes = Notes("map")
    header = yaml_header(body.yaml, notes)
    known = None if header is None else known_in(header)
    image = decoded_image(body.image_base64, limits, notes, "image_base64", body.coarser, MOST_COARSER, known)
    notes.check(InputError)
    assert header is not None
    assert image is not None
    meant = PureWindowsPath(header.image)  # whose separators are those of all systems
    if body.image_name is not None and PureWindowsPath(body.image_name).stem != meant.stem:
        raise field_error(
            "map.image_base64", f"must be the image that the yaml names, {meant.name}, got {body.image_name}"
        )
    reading = understand_image(header, image)
    if body.coarser == 1:
        return reading
    cells = np.ascontiguousarray(coarse(reading.grid.cells, body.coarser))
    grid = replace(reading.grid, cells=cells, resolution_m=reading.grid.resolution_m * body.coarser)
    return replace(reading, grid=grid)


def _placed(request: AnySimulation, scenario: Scenario, warnings: Sequence[str]) -> tuple[PlacedRobot, ...]:
    """Return where the robots start. Without room for them, the error lists the map's oddities too."""
    try:
        return place_team(scenario, request.seed)
    except ScenarioError as error:
        first = any(problem.path.startswith("team[0]") for problem in error.problems)
        where = "carriers" if not first else "map" if isinstance(request, MapSimulationBody) else "scenario"
        fault = Problem(where, "; ".join(problem.message for problem in error.problems))
        raise InputError([fault, *(Problem("map", f"warning: {text}") for text in warnings)]) from error


def _never_inline(_: SimulationBody) -> int:
    # never in the server's process: placing a team takes a while
    return INLINE_CELLS + 1


SIMULATION_READER = BodyReader(model=SimulationBody, make=simulation_of, cells=_never_inline)
PREVIEW_READER = BodyReader(model=SimulationBody, make=preview_of, cells=_never_inline, needs_quota=True)

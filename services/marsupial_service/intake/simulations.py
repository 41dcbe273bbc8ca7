"""Convert the body of a simulation to the brief of a mission.

The brief is made from the same document that `marsupial run --server` sends, so the same rules apply and the log is the
same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PureWindowsPath

from marsupial.errors import EngineUnavailable, InputError, Problem, ScenarioError
from marsupial.formats.fields import Fields, Notes, unknown
from marsupial.formats.mapfiles.nav2 import understand_image
from marsupial.formats.scenario.faults import MOST_FAULTS, read_faults
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario
from marsupial.library.choices import planner_for
from marsupial.library.missions import reachable_area
from marsupial.maps.describe import describe
from marsupial.mission.placement import place_team
from marsupial.model.faults import dated
from marsupial.model.grid import MapReading
from marsupial.model.mission import PlacedRobot
from marsupial.model.scenario import Scenario
from marsupial_service.analyses.maps import decoded_image, yaml_header
from marsupial_service.analyses.situations import budget_of, field_error
from marsupial_service.intake.counts import Count
from marsupial_service.intake.missions import DEFAULT_BUDGET_S, brief_of
from marsupial_service.intake.reading import INLINE_CELLS, BodyReader, ParsedBody
from marsupial_service.missions.simulated import mission_document
from marsupial_service.missions.values import MissionBrief, RobotSimulation
from marsupial_service.problems import check_count
from marsupial_service.schemas.missions import MissionBody
from marsupial_service.schemas.simulations import (
    MapSimulationBody,
    ScenarioSimulationBody,
    SimulationBody,
    UploadedMapBody,
)
from marsupial_service.settings import ServiceLimits

AnySimulation = ScenarioSimulationBody | MapSimulationBody


def simulation_of(
    body: SimulationBody, sent: ParsedBody, limits: ServiceLimits, commands: Mapping[str, str]
) -> tuple[MissionBrief, bytes]:
    """Return the brief of a request and the digest of what was sent; `commands` as in `brief_of`.

    Raises InputError naming what is wrong by the fields of the request, HttpProblem if there is too much of something.
    """
    request: AnySimulation = body.root
    check_count("/carriers", request.carriers * (1 + request.rovers), limits.robots, "robots with their rovers")
    budget = budget_of(request.budget, limits, DEFAULT_BUDGET_S)
    warnings: tuple[str, ...] = ()
    if isinstance(request, ScenarioSimulationBody):
        scenario = _built_in(request, limits)
    else:
        reading = _map_of(request.map, limits)
        try:
            scenario = bare_map_scenario(request.map.name, reading.grid, request.carriers, request.rovers, limits.sizes)
        except ScenarioError as error:
            raise field_error("map.yaml", str(error)) from error
        warnings = describe(scenario.grid, scenario.robot_types, reading=reading).warnings
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
        truth=scenario.grid.cells, speed=request.speed, warnings=warnings, faults=tuple(request.faults)
    )
    return replace(brief, simulation=simulation), sent.digest


def _built_in(request: ScenarioSimulationBody, limits: ServiceLimits) -> Scenario:
    if request.scenario not in SCENARIOS:
        text = unknown("scenario", request.scenario, SCENARIOS)
        raise field_error("scenario", f"{text}; available: {', '.join(SCENARIOS)}")
    scenario = builtin_scenario(request.scenario, request.carriers, request.rovers)
    check_count("/scenario", scenario.grid.cells.size, limits.cells, "cells")
    return scenario


def _map_of(body: UploadedMapBody, limits: ServiceLimits) -> MapReading:
    notes = Notes("map")
    header = yaml_header(body.yaml, notes)
    image = decoded_image(body.image_base64, limits, notes, "image_base64")
    notes.check(InputError)
    assert header is not None
    assert image is not None
    meant = PureWindowsPath(header.image)  # whose separators are those of all systems
    if body.image_name is not None and PureWindowsPath(body.image_name).stem != meant.stem:
        raise field_error(
            "map.image_base64", f"must be the image that the yaml names, {meant.name}, got {body.image_name}"
        )
    return understand_image(header, image)


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


_COUNTS = (Count("faults", MOST_FAULTS, "faults"),)

SIMULATION_READER = BodyReader(model=SimulationBody, counts=_COUNTS, make=simulation_of, cells=_never_inline)

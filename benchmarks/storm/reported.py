"""One mission whose robots report their own map: draw how, run it, and judge its log by a list of rules."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

from benchmarks.storm.distortion import Distortion, draw_distortion, lattice_terrain
from benchmarks.storm.ground import Document, drawn_cells
from benchmarks.storm.reported_end import (
    EndStatus,
    GivenUp,
    NothingLeft,
    map_is_the_last_one,
    metres_and_energy_are_true,
    robots_are_told,
)
from benchmarks.storm.reported_log import ReportedLog
from benchmarks.storm.reported_rules import (
    Losses,
    ReportedRule,
    ReportedSight,
    StormProgress,
    dockings_are_possible,
    drives_are_possible,
    plans_are_valid,
    time_goes_on,
    zones_come_and_go,
)
from benchmarks.storm.reporting import DoesNotEnd, ReportingTeam, Told
from marsupial.formats.scenario.read import read_scenario
from marsupial.mission.placement import place_team
from marsupial.model import Scenario


@dataclass(frozen=True, eq=False)
class StormOutcome:
    """A mission that is over: its log, how it ended, what was drawn for it, and what finds the rules that it broke."""

    lines: list[str]
    status: str
    judge: Callable[[], list[str]]
    label: str = ""


class Reporters:
    """Runs one drawn scenario with robots that report their own map, each time in the same way."""

    def __init__(self, rng: random.Random, document: Document, how: Document) -> None:
        self._document, self._how = document, how
        self._draw = rng.randrange(2**32)
        self._called_back = rng.randrange(1, 60) if rng.random() < 0.1 else None

    def run(self, folder: Path) -> StormOutcome:
        """Run the mission of the scenario, with its file in a folder."""
        file = Path(folder, "world.json")
        document = deepcopy(self._document)
        scenario = _written(file, document)
        placed = place_team(scenario, self._how["seed"])
        radii = {kind["name"]: kind["radius_m"] / document["map"]["resolution_m"] for kind in document["robot_types"]}
        stands = [((robot.cell.x, robot.cell.y), radii[robot.type]) for robot in placed if robot.cell is not None]
        truth = drawn_cells(document["map"]["rows"])
        distortion = draw_distortion(random.Random(self._draw), truth, stands)
        if distortion.shifts:
            lattice_terrain(document)
        if distortion.frame != "whole":
            document["limits"]["coverage"] = 1  # there is no area of which it could be a share
        called_back = self._called_back
        label = distortion.label() + ("" if called_back is None else f" called back at report {called_back}")
        try:
            told = ReportingTeam(_written(file, document), placed, distortion, self._how, called_back).run()
        except DoesNotEnd as error:
            endless = str(error)
            return StormOutcome([], "endless", lambda: [endless], label)
        status = json.loads(told.lines[-1])["status"]
        return StormOutcome(
            told.lines,
            status,
            lambda: list(judge(document, told, distortion, called_back=called_back is not None)),
            label,
        )


def _written(file: Path, document: Document) -> Scenario:
    file.write_text(json.dumps(document), encoding="utf-8")
    return read_scenario(file)


def judge(document: Document, told: Told, distortion: Distortion, *, called_back: bool) -> Iterator[str]:
    """Yield what is wrong with a mission."""
    log, rules = ReportedLog(document, told), _rules(document, distortion, called_back=called_back)
    for event in map(json.loads, told.lines):
        for rule in rules:
            yield from (f"{event['event']} at {event['t_ms']} ms: {what}" for what in rule(log, event))
        log.apply(event)


def _rules(document: Document, distortion: Distortion, *, called_back: bool) -> list[ReportedRule]:
    faults = {fault["fault"] for fault in document.get("faults", [])}
    return [
        time_goes_on,
        ReportedSight(drawn_cells(document["map"]["rows"]), distortion, changing="ground" in faults),
        plans_are_valid,
        drives_are_possible,
        dockings_are_possible,
        Losses(document, fails=bool(distortion.wrong or distortion.shifts)),
        zones_come_and_go,
        StormProgress(),
        robots_are_told,
        metres_and_energy_are_true,
        EndStatus(called_back=called_back),
        NothingLeft(),
        GivenUp(distortion),
        map_is_the_last_one,
    ]

"""One mission whose robots report their own map: draw how, and run it."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.storm.distortion import draw_distortion, lattice_terrain
from benchmarks.storm.ground import Document, drawn_cells
from benchmarks.storm.oracle import judge_reported
from benchmarks.storm.reporting import DoesNotEnd, ReportingTeam
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
            mission = ReportingTeam(_written(file, document), placed, distortion, self._how, called_back).run()
        except DoesNotEnd as error:
            endless = str(error)
            return StormOutcome([], "endless", lambda: [endless], label)
        status = json.loads(mission.lines[-1])["status"]
        return StormOutcome(mission.lines, status, partial(judge_reported, document, mission), label)


def _written(file: Path, document: Document) -> Scenario:
    file.write_text(json.dumps(document), encoding="utf-8")
    return read_scenario(file)

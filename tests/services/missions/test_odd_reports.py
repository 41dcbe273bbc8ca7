"""Late, repeated, contradictory and random reports are refused without effect, or handled."""

import copy
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mission_setup import Driver, Hosted, body, brief_from, open_missions, replayed, send, started, team
from pydantic import ValidationError
from reference_missions import reference_log

from marsupial.errors import InputError
from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.grid import UNKNOWN, Cell
from marsupial.model.mission import MissionEnded
from marsupial.model.runs import known_runs
from marsupial_service.missions.state import MissionState, ReportConflict
from marsupial_service.missions.values import (
    Control,
    MissionBatch,
    MissionBrief,
    MissionReport,
    PendingInput,
    RobotUpdate,
)
from marsupial_service.schemas.enums import EventType

Change = Callable[[dict[str, Any], random.Random], object]

WRONG: dict[str, Change] = {
    "gap": lambda r, d: r.update(n=r["n"] + d.randint(1, 5)),
    "unknown command": lambda r, d: r["finished"].append(10**6),
    "twice": lambda r, d: r.update(lost=[{"robot": "carrier1"}] * 2),
    "two places": lambda r, d: r["robots"].append({"name": "carrier1", "cell": [1, 1], "pose_m": [0.5, 0.5]}),
    "half a run": lambda r, d: r["revealed"].append({"robot": "carrier1", "runs": [0, 1]}),
    "long run": lambda r, d: r["revealed"].append({"robot": "carrier1", "runs": [0, 10**8, 1]}),
    "other terrain": lambda r, d: r["revealed"].append({"robot": "carrier1", "runs": [0, 1, 1], "other": 1}),
    "both maps": lambda r, d: r.update(map={"runs": []}, revealed=[{"robot": "carrier1", "runs": [0, 1, 0]}]),
    "text for number": lambda r, d: r.update(t_ms="soon"),
}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
async def test_an_invalid_report_is_refused_and_changes_nothing(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    async with open_missions(tmp_path) as missions:
        record = await started(missions)

        driver = Driver(team())
        while not await driver.drive(missions, record, len(driver.reports) + 1):
            for name in draw.sample(sorted(WRONG), 3):
                odd = copy.deepcopy(driver.reports[-1])
                odd["n"] += 1
                WRONG[name](odd, draw)
                with pytest.raises((ValidationError, InputError, ReportConflict)):
                    await send(missions, record, odd)
            old = draw.choice(driver.reports)
            await send(missions, record, old)
            with pytest.raises(ReportConflict, match="was sent before with other content"):
                await send(missions, record, {**old, "t_ms": old["t_ms"] + 1})
            ended = [number for report in driver.reports for number in report["finished"]]
            if ended:
                last = driver.reports[-1]
                sent = {"n": last["n"] + 1, "t_ms": last["t_ms"], "finished": [draw.choice(ended)]}
                with pytest.raises(ReportConflict, match="is unknown or has ended"):
                    await send(missions, record, sent)
        assert await missions.log(record) == reference_log("lobby")


def small_brief(seed: int) -> MissionBrief:
    asked = body("lobby")
    asked["time_limit_ms"] = 200_000
    asked["planning_time"] = "charged" if seed % 3 == 0 else "instant"
    asked["goal"]["return_home"] = seed % 2 == 0
    return brief_from(asked)


class Fuzz:
    """A client that sends random reports that the state accepts."""

    def __init__(self, brief: MissionBrief, seed: int) -> None:
        self.brief = brief
        self.draw = random.Random(seed)
        self.state = MissionState(brief)
        self.truth = builtin_scenario("lobby").grid.solid().cells
        self.open: dict[int, dict[str, Any]] = {}
        self.paused = False

    def next(self, batch: MissionBatch) -> MissionReport | Control:
        self.state.follow(batch.events, ())
        for event in batch.events:
            if event.type == "commands":
                for command in json.loads(event.data)["commands"]:
                    if command["name"] != "stop":
                        self.open[command["id"]] = command
        wish = self.draw.random()
        if self.paused or wish < 0.05:
            self.paused = not self.paused
            return Control.PAUSE if self.paused else Control.RESUME
        while True:
            report = self.report()
            try:
                self.state.check(report)
            except ReportConflict:
                continue
            self.state.apply(report, b"")
            for number in (*report.finished, *(number for number, _ in report.failed)):
                del self.open[number]
            return report

    def report(self) -> MissionReport:
        draw, names = self.draw, [robot.name for robot in self.brief.robots]
        over = [number for number in self.open if draw.random() < 0.5]
        failed = [number for number in over if draw.random() < 0.2]
        lost = [name for name in names if draw.random() < 0.003]
        return MissionReport(
            n=self.state.n + 1,
            t_ms=self.state.t_ms + draw.choice([0, 1, 500, 3000]),
            revealed=tuple((name, self.patch()) for name in names[:1] if not self.state.n or draw.random() < 0.5),
            map=self.map() if draw.random() < 0.02 else None,
            robots=tuple(self.note(name, over) for name in names if draw.random() < 0.6),
            finished=tuple(number for number in over if number not in failed),
            failed=tuple((number, "odd") for number in failed),
            lost=tuple((name, "odd") for name in lost),
        )

    def patch(self) -> tuple[int, ...]:
        """Return a part of the true map, at first around the team, consistent with a changed map."""
        height, width = self.truth.shape
        middle = next(robot.cell for robot in self.brief.robots if robot.cell is not None)
        x, y, size = middle.x - 12, middle.y - 12, 24
        if self.state.n:
            x, y, size = self.draw.randrange(width), self.draw.randrange(height), self.draw.randint(1, 20)
        part = slice(max(0, y), y + size), slice(max(0, x), x + size)
        cells = np.full_like(self.truth, UNKNOWN)
        cells[part] = np.where(self.state.map.cells[part] == UNKNOWN, self.truth[part], self.state.map.cells[part])
        return known_runs(cells)

    def map(self) -> Any:
        cells = self.state.map.cells.copy()
        row, column, code = self.draw.randrange(40), self.draw.randrange(50), self.draw.choice([0, 1, 255])
        cells[row : row + 3, column : column + 5] = code
        return cells

    def note(self, name: str, over: list[int]) -> RobotUpdate:
        """Return an update of a robot's position: its destination or a random cell."""
        mine = [command for command in self.open.values() if command["robot"] == name and command["id"] in over]
        goals = [command["route"][-1] for command in mine if "route" in command]
        height, width = self.truth.shape
        anywhere = Cell(self.draw.randrange(width), self.draw.randrange(height))
        cell = Cell(*goals[0]) if goals else anywhere if self.draw.random() < 0.05 else None
        return RobotUpdate(name=name, cell=cell, free_at_ms=self.draw.choice([None, 0, self.state.t_ms + 700]))


@pytest.mark.parametrize("seed", [1, 5, 14, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(15, 45))])
def test_a_mission_survives_all_accepted_reports_and_can_be_replayed(seed: int) -> None:
    brief = small_brief(seed)
    fuzz, inputs, batches = Fuzz(brief, seed), [], []
    with Hosted(brief) as hosted:
        batches.append(hosted.batch(PendingInput(input=None)))
        while not batches[-1].over:
            inputs.append(fuzz.next(batches[-1]) if len(batches) < 400 else Control.CANCEL)
            batches.append(hosted.batch(PendingInput(input=inputs[-1])))
    lines = [event.data for batch in batches for event in batch.events if event.type is EventType.LOG]
    assert isinstance(parse_log("".join(f"{line}\n" for line in lines).encode()).events[-1], MissionEnded)
    assert replayed(brief, inputs, batches) == batches

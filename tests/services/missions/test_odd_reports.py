"""Late, repeated, contradictory and random reports are refused without effect, or handled."""

import copy
import json
import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mission_setup import Driver, Hosted, body, body_of, brief_from, open_missions, replayed, send, started, team
from pydantic import ValidationError
from support.missions.battery_yard import battery_yard
from support.missions.reference_missions import reference_log

from marsupial.errors import InputError
from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.grid import UNKNOWN, Cell
from marsupial.model.mission import MissionEnded
from marsupial.model.runs import known_runs
from marsupial.model.zones import Zone, ZoneChange, ZoneKind
from marsupial_service.missions.state import MissionState, ReportConflict
from marsupial_service.missions.values import Control, MissionBatch, MissionBrief, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.missions import PartedBody, RobotNoteBody

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
            for number in (*report.finished, *(one.id for one in report.failed)):
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
            revealed=[
                {"robot": name, "runs": self.patch()} for name in names[:1] if not self.state.n or draw.random() < 0.5
            ],
            **({"map": {"runs": self.map()}} if draw.random() < 0.02 else {}),
            robots=[self.note(name, over) for name in names if draw.random() < 0.6],
            finished=[number for number in over if number not in failed],
            failed=[{"id": number, "reason": "odd"} for number in failed],
            lost=[{"robot": name, "reason": "odd"} for name in lost],
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
        return known_runs(cells)

    def note(self, name: str, over: list[int]) -> RobotNoteBody:
        """Return an update of a robot's position: its destination or a random cell."""
        mine = [command for command in self.open.values() if command["robot"] == name and command["id"] in over]
        goals = [command["route"][-1] for command in mine if "route" in command]
        height, width = self.truth.shape
        anywhere = Cell(self.draw.randrange(width), self.draw.randrange(height))
        cell = Cell(*goals[0]) if goals else anywhere if self.draw.random() < 0.05 else None
        return RobotNoteBody.model_construct(
            name=name, cell=cell, free_at_ms=self.draw.choice([None, 0, self.state.t_ms + 700])
        )


@pytest.mark.parametrize("seed", [1, 6, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(15, 45))])
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


class Eventful(Fuzz):
    """One whose robots have batteries, refuse commands and return, and report by themselves, and whose operator acts.

    It sees that no command contradicts what it knows of a robot.
    """

    def next(self, batch: MissionBatch) -> MissionReport | Control | ZoneChange:  # type: ignore[override]
        for event in batch.events:
            if event.type == "commands":
                for command in json.loads(event.data)["commands"]:
                    self.check(command)
                    self.open |= {command["id"]: command} if command["name"] != "stop" else {}
        wish, (height, width) = self.draw.random(), self.truth.shape
        if self.state.n and wish < 0.05:
            x, y = self.draw.uniform(0, width / 2), self.draw.uniform(0, height / 2)
            zone = Zone(kind=self.draw.choice(list(ZoneKind)), polygon_m=((x, y), (x + 3, y), (x + 3, y + 2)))
            change = ZoneChange(name=self.draw.choice("ab"), zone=zone if wish < 0.03 else None)
            self.state.follow(batch.events, ())
            self.state.apply_wish(change)
            return change
        if wish > 0.99 and self.state.t_ms > 50_000:
            self.state.follow(batch.events, ())
            self.paused = False
            return Control.WIND_DOWN
        told = super().next(batch)
        refused = {one.id for one in told.declined} if isinstance(told, MissionReport) else set()
        gone = {robot for robot, its in self.state._team.robots.items() if its.lost}
        over = [i for i, one in self.open.items() if i in refused or gone & {one["robot"], one.get("carrier")}]
        for number in over:
            del self.open[number]
        return told

    def check(self, command: dict[str, Any]) -> None:
        """Check that a command is for robots that can carry it out."""
        if command["name"] == "stop":
            assert command["id"] in self.open
            return
        own = [command[key] for key in ("robot", "carrier") if key in command]
        busy = {one.get(key) for one in self.open.values() for key in ("robot", "carrier")}
        assert not busy.intersection(own)
        assert not any(self.state._team.robots[name].lost for name in own)
        aboard = self.state._team.robots[command["robot"]].where.aboard
        assert aboard == (command["carrier"] if command["name"] == "undock" else None)

    def report(self) -> MissionReport:
        draw, plain, robots = self.draw, super().report(), self.state._team.robots
        charged = [name for name in robots if draw.random() < 0.05]
        notes = {note.name: note for note in plain.robots} | {name: RobotNoteBody(name=name) for name in charged}
        for name in charged:
            notes[name] = notes[name].model_copy(update={"charge": draw.choice([0.0, draw.random(), 1.0])})
        declined = plain.failed if draw.random() < 0.3 else []
        own = draw.choice([None, None, *robots]) if self.state.n else None
        changes = {
            "n": plain.n if own is None else self.state.counts.get(own, 0) + 1,
            "robot": own,
            "robots": list(notes.values()),
            "failed": [] if declined else plain.failed,
            "declined": declined,
            "returned": [name for name in robots if robots[name].lost and draw.random() < 0.2],
        }
        return plain.model_copy(update=changes)


class Unheard(Eventful):
    """One whose rovers are out of contact at times; it sees that they are told nothing then."""

    def __init__(self, brief: MissionBrief, seed: int) -> None:
        super().__init__(brief, seed)
        self.unheard: set[str] = set()

    def next(self, batch: MissionBatch) -> MissionReport | Control | ZoneChange:
        told = super().next(batch)
        if isinstance(told, MissionReport):
            self.unheard = (self.unheard | {one.robot for one in told.out_of_contact}) - set(told.in_contact)
            self.unheard -= {n for n, one in self.state._team.robots.items() if one.lost or one.where.aboard}
        return told

    def check(self, command: dict[str, Any]) -> None:
        super().check(command)
        assert command["robot"] not in self.unheard

    def report(self) -> MissionReport:
        draw, plain = self.draw, super().report()
        rovers = [name for name, kind in self.brief.kind_of.items() if kind.radio_range_m is not None]
        heard = [name for name in rovers if draw.random() < 0.1]
        parted = [
            PartedBody(robot=name, returns=draw.random() < 0.5)
            for name in rovers
            if draw.random() < 0.1 and name not in heard
        ]
        return plain.model_copy(update={"out_of_contact": parted, "in_contact": heard})


@pytest.mark.parametrize("fleet", [Eventful, Unheard])
@pytest.mark.parametrize("seed", [2, 7, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(20, 40))])
def test_all_at_once_leads_to_no_command_that_robots_can_not_carry_out(seed: int, fleet: type[Eventful]) -> None:
    scenario = battery_yard()
    if fleet is Unheard:
        kinds = (replace(kind, radio_range_m=3.0) if kind.dock_ms else kind for kind in scenario.robot_types)
        scenario = replace(scenario, robot_types=tuple(kinds))
    more = {"time_limit_ms": 200_000, "planning_time": "charged" if seed % 2 else "instant"}
    brief = brief_from(body_of(scenario) | more)
    fuzz, inputs, batches = fleet(brief, seed), [], []
    fuzz.truth = scenario.grid.solid().cells
    with Hosted(brief) as hosted:
        batches.append(hosted.batch(PendingInput(input=None)))
        while not batches[-1].over:
            inputs.append(fuzz.next(batches[-1]) if len(batches) < 150 else Control.CANCEL)
            batches.append(hosted.batch(PendingInput(input=inputs[-1])))
    assert replayed(brief, inputs, batches) == batches

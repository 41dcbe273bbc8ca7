"""Rovers out of contact over reports: who can be, what they are told, where they are expected, what is heard late."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from entry_setup import followed
from mission_setup import (
    Hosted,
    Reports,
    body_of,
    brief_from,
    open_missions,
    over_reports,
    read_report,
    simulation_brief,
    team_of,
)
from mission_setup import brief as lobby
from support.missions.faulty_mission import FAULTS, yard
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of, rover_at

from marsupial.errors import ScenarioError
from marsupial.formats.missionlog import parse_log
from marsupial.model import Cell, MissionEnded, Scenario
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.mission import ActionStarted, Cause, ContactLost, ContactRegained, Planned, RobotLost, Status
from marsupial.model.team import Whereabouts
from marsupial_service.missions.encoding import decode_input, encode_input
from marsupial_service.missions.reported import RobotCommand
from marsupial_service.missions.simulated import SimulatedTeam
from marsupial_service.missions.state import MissionState, ReportConflict
from marsupial_service.missions.values import Control, MissionBrief, MissionReport, PendingInput
from marsupial_service.missions.world import RemoteWorld
from marsupial_service.schemas.enums import EventType


def ranged(range_m: float, faults: str = "") -> Scenario:
    scenario = yard(faults)
    kinds = (replace(kind, radio_range_m=range_m) if kind.dock_ms else kind for kind in scenario.robot_types)
    return replace(scenario, robot_types=tuple(kinds))


def brief(scenario: Scenario, strategy: str = "temporal") -> MissionBrief:
    return brief_from(body_of(scenario, strategy=strategy))


class Waiting(SimulatedTeam):
    """A fleet whose rovers wait where their drives have ended."""

    def _go_back(self, name: str) -> None:
        pass

    def answer(self, batch: Any) -> dict[str, Any] | None:
        report = super().answer(batch)
        for parted in () if report is None else report["out_of_contact"]:
            parted["returns"] = False
        return report


# whole missions


@pytest.mark.parametrize(
    ("strategy", "range_m", "faults", "fleet"),
    [("assignment", 1.0, "", SimulatedTeam), ("temporal", 1.0, FAULTS, SimulatedTeam), ("temporal", 2.0, "", Waiting)],
)
async def test_rovers_out_of_contact_are_fetched_even_if_the_service_restarts(
    tmp_path: Path, strategy: str, range_m: float, faults: str, fleet: type[SimulatedTeam]
) -> None:
    scenario, how = ranged(range_m, faults), {"strategy": strategy, "fleet": fleet}
    log, driver = await over_reports(tmp_path, scenario, **how)  # type: ignore[arg-type]
    again, _ = await over_reports(tmp_path, scenario, 12, 25, **how)  # type: ignore[arg-type]
    assert log == again
    events = parse_log(log.encode()).events
    end = events[-1]
    assert isinstance(end, MissionEnded)
    assert (end.status, end.aboard) == (Status.COMPLETE, ("r1", "r2", "r3"))
    away: set[str] = set()
    for event in events:
        if isinstance(event, ContactLost):
            away.add(event.robot)
        elif isinstance(event, ContactRegained):
            away.remove(event.robot)
        elif isinstance(event, ActionStarted):
            assert away.isdisjoint(event.action.robots)
    sent = {key for report in driver.reports for key, value in report.items() if value}
    assert sent >= {"out_of_contact", "in_contact"}
    causes = {trigger.cause for event in events if isinstance(event, Planned) for trigger in event.trigger}
    assert causes >= {Cause.PARTED, Cause.CONTACT}
    assert faults or not any(isinstance(event, RobotLost) for event in events)


async def test_a_simulation_with_short_radios_is_the_same_after_a_restart(tmp_path: Path) -> None:
    asked = {"scenario": "lobby", "planner": "greedy", "budget": {"steps": 1}, "radio_range_m": 1.0}
    simulation = simulation_brief(asked)
    assert [kind.radio_range_m for kind in simulation.kinds] == [None, 1.0]
    logs = []
    for reports in (None, 12):
        async with open_missions(tmp_path) as missions:
            record, _ = await missions.create(simulation, str(reports).encode(), owner="me")
            async for event in followed(missions, record.id):
                if reports and event.type == EventType.COMMANDS and json.loads(event.data)["n"] >= reports:
                    break
        async with open_missions(tmp_path) as missions:
            async for _ in followed(missions, record.id):
                pass
            record = await missions.of("me", record.id)
            assert record.status == "complete"
            logs.append(await missions.log(record))
    assert logs[0] == logs[1]
    assert any(isinstance(event, ContactLost) for event in parse_log(logs[0].encode()).events)


def test_a_rover_that_waits_where_no_carrier_can_hear_it_ends_the_mission() -> None:
    scenario = ranged(1.0)
    team, batches = team_of(scenario, fleet=Waiting), []
    with Hosted(brief(scenario)) as hosted:
        batches.append(hosted.batch(PendingInput(input=None)))
        while not batches[-1].over:
            (sent,) = (json.loads(event.data) for event in batches[-1].events if event.type is EventType.COMMANDS)
            report = team.report(sent)
            assert report is not None
            parted = [one.model_copy(update={"returns": False}) for one in report.out_of_contact]
            report = report.model_copy(update={"out_of_contact": parted})
            batches.append(hosted.batch(PendingInput(input=report)))
    lines = [event.data for batch in batches for event in batch.events if event.type is EventType.LOG]
    end = parse_log("".join(f"{line}\n" for line in lines).encode()).events[-1]
    assert isinstance(end, MissionEnded)
    assert end.status is Status.STALLED
    place = r"at \(\d+\.\d, \d+\.\d\)"
    assert re.search(rf"; out of contact: r\d {place}(, r\d {place})?$", end.reason)


# what is refused


@pytest.mark.parametrize(
    ("report", "problem"),
    [
        ({"out_of_contact": [{"robot": "r9"}]}, r"out_of_contact\[0\]\.robot: unknown robot 'r9'"),
        (
            {"out_of_contact": [{"robot": "c1"}]},
            r"out_of_contact\[0\]\.robot: a carrier is always in contact: it has no",
        ),
        ({"in_contact": ["r1", "c2"]}, r"in_contact\[1\]: a carrier is always in contact: it has no radio_range_m"),
        ({"in_contact": ["r1"], "out_of_contact": [{"robot": "r1"}]}, r"in_contact\[0\]: r1 is given twice"),
    ],
)
def test_only_rovers_with_a_range_lose_contact(report: dict[str, Any], problem: str) -> None:
    asked = brief(ranged(1.0))
    with pytest.raises(ScenarioError, match=problem):
        read_report(asked, {"n": 1, "t_ms": 0, **report})


def test_a_rover_without_a_range_and_lost_rovers_and_those_aboard_do_not_lose_contact() -> None:
    with pytest.raises(ScenarioError, match=r"in_contact\[0\]: a rover is always in contact: it has no radio_range_m"):
        read_report(lobby(), {"n": 1, "t_ms": 0, "in_contact": ["rover1_1"]})
    state = MissionState(brief(ranged(1.0)))
    with pytest.raises(ReportConflict, match=r"out_of_contact\[0\]\.robot: r1 is aboard c1"):
        state.check(parted(1, "r1"))
    state.apply(MissionReport(n=1, t_ms=0, lost=[{"robot": "r1", "reason": "gone"}]), b"")
    with pytest.raises(ReportConflict, match=r"out_of_contact\[0\]\.robot: r1 is lost"):
        state.check(parted(2, "r1"))
    state.check(MissionReport(n=2, t_ms=0, in_contact=["r1"]))


def test_contact_is_stored_with_a_report() -> None:
    parted = [{"robot": "r1", "returns": True}, {"robot": "r2"}]
    report = MissionReport(n=1, t_ms=0, out_of_contact=parted, in_contact=["r3"])
    assert encode_input(decode_input(encode_input(report))) == encode_input(report)
    assert decode_input(encode_input(report)).out_of_contact == report.out_of_contact  # type: ignore[union-attr]


# what a mission makes of reports


def parted(n: int, *names: str, **more: Any) -> MissionReport:
    return MissionReport(n=n, t_ms=1000 * n, out_of_contact=[{"robot": name} for name in names], **more)


class Bench:
    """A world of reports, in which r1 stands on the ground beside its carrier."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bool]] = []
        self.reports = Reports()
        self.reports.order = self.order  # type: ignore[method-assign]
        self.world = RemoteWorld(brief(ranged(1.0)), self.reports)
        self.world._robots["r1"].where = Whereabouts(Cell(5, 2))
        self.hear()

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        self.sent.append((order.id, stop))

    def hear(self, **more: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return who is out of contact, and in contact again, after a report."""
        self.reports.coming.append(more.pop("report", None) or MissionReport(n=1, t_ms=self.world.now_ms + 1, **more))
        news = self.world.advance(10**6)
        self.news = news
        return news.out_of_contact, news.in_contact


def test_repeated_news_of_contact_change_nothing() -> None:
    bench = Bench()
    assert bench.hear(in_contact=["r1"]) == ((), ())
    assert bench.hear(report=parted(2, "r1")) == (("r1",), ())
    assert bench.hear(report=parted(3, "r1")) == ((), ())
    assert bench.hear(in_contact=["r1"]) == ((), ("r1",))
    assert bench.hear(in_contact=["r1"]) == ((), ())


def test_a_rover_that_docks_is_in_contact_until_that_has_failed() -> None:
    bench = Bench()
    bench.world.dock("r1", "c1")
    assert bench.hear(report=parted(2, "r1")) == ((), ())
    assert bench.hear(failed=[{"id": 1, "reason": "slipped"}]) == (("r1",), ())
    bench = Bench()
    bench.world.dock("r1", "c1")
    assert bench.hear(report=parted(2, "r1")) == ((), ())
    assert bench.hear(finished=[1]) == ((), ())
    bench.world.undock("r1", "c1", Cell(5, 2))
    assert bench.hear(finished=[2]) == ((), ())


def test_a_rover_out_of_contact_that_is_given_up_is_lost_at_once_and_returns_in_contact() -> None:
    bench = Bench()
    bench.hear(report=parted(2, "r1"))
    assert bench.hear(lost=[{"robot": "r1", "reason": "fell"}]) == ((), ("r1",))
    assert bench.news.lost == (("r1", "fell"),)
    assert bench.hear(returned=["r1"]) == ((), ())


@pytest.mark.parametrize("end", ["failed", "declined"])
def test_a_command_that_did_not_reach_a_rover_says_where_it_is(end: str) -> None:
    bench = Bench()
    bench.world.drive("r1", [Cell(5, 2), Cell(6, 2), Cell(7, 2)])
    assert bench.hear(report=parted(2, "r1")) == (("r1",), ())
    assert bench.hear(**{end: [{"id": 1, "reason": "out of contact"}]}) == (("r1",), ("r1",))


def test_a_rover_out_of_contact_is_not_told_to_stop_before_it_is_in_contact() -> None:
    bench = Bench()
    bench.world.drive("r1", [Cell(5, 2), Cell(6, 2), Cell(7, 2)])
    bench.hear(report=parted(2, "r1"))
    bench.reports.coming += [
        Control.PAUSE,  # type: ignore[list-item]
        MissionReport(n=3, t_ms=2000),
        MissionReport(n=4, t_ms=3000, in_contact=["r1"]),
        Control.RESUME,  # type: ignore[list-item]
    ]
    assert bench.sent == [(1, False)]
    news = bench.world.advance(10**6)
    assert (bench.sent, news.in_contact) == ([(1, False), (1, True)], ("r1",))


def test_a_rover_that_fails_out_of_contact_but_can_act_again_has_only_failed_its_command() -> None:
    kinds = kinds_of(rover_range_m=2.0)
    kinds["rover"] = replace(kinds["rover"], radio_range_m=2.5)
    robots = [carrier_at(2, 1), rover_at(3, 1)]
    dated = ((FaultKind.LOST, 4500), (FaultKind.RETURNS, 4600))
    faults = [Fault(kind=kind, robot="r1", at_ms=ms) for kind, ms in dated]
    team = SimulatedTeam(drawn_grid("#" * 20, "#" + "." * 18 + "#", "#" * 20), kinds, robots, faults, 100_000)
    away = {"id": 1, "name": "drive", "robot": "r1", "route": [[x, 1] for x in range(3, 15)]}
    after = {"id": 2, "name": "drive", "robot": "c1", "route": [[x, 1] for x in range(2, 14)]}
    reports, commands = [], [away]
    while not reports or "r1" not in reports[-1].in_contact:
        report = team.report({"n": len(reports), "until_ms": 100_000, "commands": commands})
        assert report is not None
        reports.append(report)
        commands = [after] if report.out_of_contact else []
    assert [report.lost for report in reports if report.lost] == []
    assert [(one.id, one.reason) for report in reports for one in report.failed] == [(1, "failed")]

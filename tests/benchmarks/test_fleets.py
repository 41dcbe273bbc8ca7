from __future__ import annotations

import json
from dataclasses import asdict

from benchmarks.trial.fleets import Load, Speaker, TickingTeam, together
from benchmarks.trial.pressing import Press, brief, reports
from marsupial.generators.builtin import builtin_scenario
from marsupial.mission.placement import place_team
from marsupial.model.runs import cells_in
from marsupial_service.intake.missions import brief_of, reports_of
from marsupial_service.missions.frames import MissionFrame
from marsupial_service.schemas.missions import MissionBody, ReportsBody
from marsupial_service.settings import ServiceLimits


def team() -> TickingTeam:
    world = builtin_scenario("lobby")
    return TickingTeam(world.grid, {kind.name: kind for kind in world.robot_types}, place_team(world, 1))


def seen(report: dict[str, object]) -> set[int]:
    return {int(cell) for one in report["revealed"] for cell in cells_in(one["runs"])[0]}  # type: ignore[attr-defined]


def test_time_passes_by_the_clock_and_each_drive_is_finished_once() -> None:
    robots = team()
    said = robots.at(0)
    name, first = next((name, one) for name, one in said.items() if one["robots"])
    x, y = first["robots"][0]["cell"]
    assert not seen(together(robots.at(100)))
    route = [[x, y], [x + 1, y]]
    assert robots.obey({"commands": [{"id": 7, "robot": name, "name": "drive", "route": route}]}) == 1
    told = [robots.at(t_ms) for t_ms in range(200, 5000, 100)]
    assert [one[name]["t_ms"] for one in told] == list(range(200, 5000, 100))
    assert [number for one in told for number in one[name]["finished"]] == [7]
    assert told[-1][name]["robots"][0]["cell"] == route[-1]


def test_a_team_says_what_its_robots_say() -> None:
    said = team().at(0)
    whole = together(said)
    assert seen(whole) == set().union(*(seen(one) for one in said.values())) != set()
    assert [note["name"] for note in whole["robots"]] == [name for name, one in said.items() if one["robots"]]


def test_reports_that_are_sent_as_fast_as_they_are_taken_are_right() -> None:
    mission = brief_of(MissionBody.model_validate_json(brief()), ServiceLimits(), {})
    for of_team in (True, False):
        told = reports(of_team)
        body = ReportsBody.model_validate({"reports": [next(told) for _ in range(60)]})
        assert len(reports_of(body, mission, MissionFrame.of(mission.grid), ServiceLimits())) == 60


def test_a_load_is_described_to_another_process() -> None:
    load = Load(port=1, fleets=2, hz=3.0, seconds=4.0, speaker=Speaker.ROBOTS)
    assert Load(**json.loads(load.text)) == load
    assert load.robots == 24
    press = Press(port=1, missions=2, seconds=3.0, batch=4, of_team=True)
    assert json.loads(press.text) == asdict(press)

"""Missions of teams with two types of carriers and of rovers, each of which fits only on some."""

from pathlib import Path

import pytest
from support.missions.mixed_team import BARGE, FITTING, TRACKED, TRUCK, WHEELED, stored

import marsupial
from marsupial.model import ActionEnded, ActionName, Planned
from marsupial.model.mission import ActionEnd

STRATEGIES = ("temporal", "wurm2010", "heuristic", "heuristic-plus", "assignment", "clairvoyant")


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_explores_with_rovers_on_the_carriers_they_fit_on(strategy: str, tmp_path: Path) -> None:
    team = [TRUCK, BARGE, WHEELED, WHEELED | {"name": "w2"}, TRACKED]
    result = marsupial.explore(stored(tmp_path, team), strategy, "greedy", steps=4)
    assert (result.status, result.coverage) == ("complete", pytest.approx(1.0, abs=0.01))
    planned = [action for event in result.events if isinstance(event, Planned) for action in event.actions]
    assert {(a.robot, a.carrier) for a in planned if a.name is ActionName.DOCK} <= FITTING
    assert result.deployments >= 2


def test_a_rover_that_no_carrier_takes_is_left_and_the_report_says_so(tmp_path: Path) -> None:
    team = [TRUCK, WHEELED, TRACKED | {"start": [7.75, 1.25]}]
    del team[-1]["carrier"]
    result = marsupial.explore(stored(tmp_path, team), "temporal", "greedy", steps=4)
    assert result.status == "stalled"
    assert "k1" in result.reason


def test_a_slow_rover_still_takes_a_seat_of_its_type(tmp_path: Path) -> None:
    faults = [{"fault": "slows", "robot": name, "at_s": 1, "speed_share": 0.5} for name in ("w1", "k1")]
    team = [TRUCK, BARGE, WHEELED, WHEELED | {"name": "w2"}, TRACKED]
    result = marsupial.explore(stored(tmp_path, team, faults=faults), "temporal", "anytime", steps=4)
    assert result.status == "complete"
    ended = [event.action for event in result.events if isinstance(event, ActionEnded) and event.end is ActionEnd.DONE]
    assert {"w1", "k1"} <= {action.robot for action in ended if action.name is ActionName.DOCK}

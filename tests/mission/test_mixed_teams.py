"""Missions of teams with two types of carriers and of rovers, each of which fits only on some."""

from pathlib import Path

import pytest
import yaml

import marsupial
from marsupial.model import ActionEnded, ActionName, Planned
from marsupial.model.mission import ActionEnd

ROWS = (
    "####################",
    "#......#~~~~~#mmmmm#",
    "#......#~~~~~#mmmmm#",
    "#......~~~~~~#mmmmm#",
    "#......#######mmmmm#",
    "#............#mmmmm#",
    "#.............mmmmm#",
    "####################",
)
KIND = {"sensor_range_m": 1.2, "radius_m": 0.1}
CARRIER = KIND | {"role": "carrier", "speed_mps": 1.0, "terrains": ["floor"]}
ROVER = KIND | {"role": "rover", "speed_mps": 0.5, "dock_s": 5, "undock_s": 3}


def stored(folder: Path, team: list[dict[str, object]], **fields: object) -> Path:
    """Store a scenario: trucks carry wheeled rovers only, barges one wheeled and one tracked rover."""
    scenario = {
        "format": "marsupial-scenario",
        "version": 1,
        "map": {"resolution_m": 0.5, "rows": list(ROWS), "legend": {"m": "mud"}},
        "terrains": [{"name": "mud", "blocks_sight": False}],
        "robot_types": [
            CARRIER | {"name": "truck", "seats": {"wheeled": 2}},
            CARRIER | {"name": "barge", "capacity": 2, "seats": {"tracked": 1, "wheeled": 1}},
            ROVER | {"name": "wheeled", "terrains": ["rough"]},
            ROVER | {"name": "tracked", "terrains": ["mud"]},
        ],
        "team": team,
        "goal": {"recover_rovers": True},
        "limits": {"time_s": 600},
        **fields,
    }
    file = folder / "team.yaml"
    file.write_text(yaml.safe_dump(scenario))
    return file


TRUCK = {"name": "truck1", "type": "truck", "start": [1.25, 1.25]}
BARGE = {"name": "barge1", "type": "barge", "start": [1.75, 2.25]}
WHEELED = {"name": "w1", "type": "wheeled", "carrier": "truck1"}
TRACKED = {"name": "k1", "type": "tracked", "carrier": "barge1"}
FITTING = {("w1", "truck1"), ("w1", "barge1"), ("w2", "truck1"), ("w2", "barge1"), ("k1", "barge1")}


@pytest.mark.parametrize(
    "strategy", ["temporal", "wurm2010", "heuristic", "heuristic-plus", "assignment", "clairvoyant"]
)
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

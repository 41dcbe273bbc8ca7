"""Robots that report one by one by a map that changes and grows: nobody drives into what is reported as an obstacle."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mission_house import Hosted, again
from roaming import RoamingTeam, brief_of_a_part

from marsupial.formats.missionlog import parse_log
from marsupial.mission.playback import Playback
from marsupial_service.missions.ledger import Ledger
from marsupial_service.missions.values import Due, EventType, Report, Turn, Wish

SEEDS = [1, 2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 40))]


def fly(team: RoamingTeam, most: int = 150) -> tuple[list[Report | Wish], list[Turn]]:
    """Return the inputs of a mission and its turns, looked at one by one."""
    inputs: list[Report | Wish] = []
    with Hosted(team.brief) as hosted:
        turns = [hosted.turn(Due(input=None))]
        team.obey(turns[-1])
        while not turns[-1].over:
            going = {name for name, _ in team.driving()}
            report = team.report()
            team.ledger.check(report)
            team.tell(report)
            barred = {name for name, _ in team.driving() if name in going and team.barred(name)}
            inputs.append(report if len(turns) < most else Wish.CANCEL)
            turns.append(hosted.turn(Due(input=inputs[-1])))
            team.obey(turns[-1])
            if not turns[-1].over:
                look_at(team, turns[-1], going, barred)
    return inputs, turns


def look_at(team: RoamingTeam, turn: Turn, going: set[str], barred: set[str]) -> None:
    """Nobody goes on to where it can't stand; without a new plan only those are stopped who would.

    Cells that are lost over and over bar nobody, if they did not before.
    """
    assert not [name for name, _ in team.driving() if team.barred(name, lost=False)]
    stopped = {name for name in going if team.robots[name].stopped}
    planned = any(e.type is EventType.LOG and e.data.startswith('{"event":"plan"') for e in turn.events)
    assert planned or stopped <= barred


@pytest.mark.parametrize("seed", SEEDS)
def test_whatever_the_map_does_nobody_drives_into_an_obstacle_and_the_log_goes_on(seed: int) -> None:
    team = RoamingTeam(*brief_of_a_part(), seed)
    inputs, turns = fly(team)
    lines = [event.data for turn in turns for event in turn.events if event.type is EventType.LOG]
    log = parse_log("".join(f"{line}\n" for line in lines).encode())
    assert log.ended is not None
    told = {json.loads(line)["event"] for line in lines}
    assert {"change", "frame", "drive", "plan"} <= told
    assert np.array_equal(Playback(log.events).cells_at(log.events[-1].t_ms), told_map(team, inputs))
    assert again(team.brief, inputs, turns) == turns


def told_map(team: RoamingTeam, inputs: list[Report | Wish]) -> np.ndarray:  # type: ignore[type-arg]
    """Return the map by a ledger made from what is stored: commands before reports."""
    ledger = Ledger(team.brief)
    for one in inputs:
        if isinstance(one, Report):
            ledger.draw(one)
    return ledger.cells

"""Robots that report one by one by a map that changes and grows: nobody drives into what is reported as an obstacle."""

import json

import numpy as np
import pytest
from mission_house import Hosted, again
from roaming import RoamingTeam, brief_of_a_part

from marsupial.formats.missionlog import parse_log
from marsupial.mission.playback import Playback
from marsupial_service.missions.state import MissionState
from marsupial_service.missions.values import Control, MissionBatch, MissionReport, PendingInput
from marsupial_service.schemas.words import EventType

SEEDS = [1, 2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 40))]


def fly(team: RoamingTeam, most: int = 150) -> tuple[list[MissionReport | Control], list[MissionBatch]]:
    """Return the inputs of a mission and its batches, looked at one by one."""
    inputs: list[MissionReport | Control] = []
    with Hosted(team.brief) as hosted:
        batches = [hosted.batch(PendingInput(input=None))]
        team.obey(batches[-1])
        while not batches[-1].over:
            going = {name for name, _ in team.driving()}
            report = team.report()
            team.state.check(report)
            team.tell(report)
            barred = {name for name, _ in team.driving() if name in going and team.barred(name)}
            inputs.append(report if len(batches) < most else Control.CANCEL)
            batches.append(hosted.batch(PendingInput(input=inputs[-1])))
            team.obey(batches[-1])
            if not batches[-1].over:
                look_at(team, batches[-1], going, barred)
    return inputs, batches


def look_at(team: RoamingTeam, batch: MissionBatch, going: set[str], barred: set[str]) -> None:
    """Nobody goes on to where it can't stand; without a new plan only those are stopped who would.

    Cells that are lost over and over bar nobody, if they did not before.
    """
    assert not [name for name, _ in team.driving() if team.barred(name, lost=False)]
    stopped = {name for name in going if team.robots[name].stopped}
    planned = any(e.type is EventType.LOG and e.data.startswith('{"event":"plan"') for e in batch.events)
    assert planned or stopped <= barred


@pytest.mark.parametrize("seed", SEEDS)
def test_whatever_the_map_does_nobody_drives_into_an_obstacle_and_the_log_goes_on(seed: int) -> None:
    team = RoamingTeam(*brief_of_a_part(), seed)
    inputs, batches = fly(team)
    lines = [event.data for batch in batches for event in batch.events if event.type is EventType.LOG]
    log = parse_log("".join(f"{line}\n" for line in lines).encode())
    assert log.ended is not None
    told = {json.loads(line)["event"] for line in lines}
    assert {"change", "frame", "drive", "plan"} <= told
    assert np.array_equal(Playback(log.events).cells_at(log.events[-1].t_ms), told_map(team, inputs))
    assert again(team.brief, inputs, batches) == batches


def told_map(team: RoamingTeam, inputs: list[MissionReport | Control]) -> np.ndarray:  # type: ignore[type-arg]
    """Return the map by a state made from what is stored: commands before reports."""
    state = MissionState(team.brief)
    for one in inputs:
        if isinstance(one, MissionReport):
            state.map.grow(one)
            state.map.draw(one)
    return state.cells

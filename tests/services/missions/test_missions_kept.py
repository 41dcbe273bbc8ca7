from __future__ import annotations

from pathlib import Path

import pytest
from mission_house import Driver, open_missions, run, started, team, undisturbed


@pytest.mark.parametrize(
    ("scenario", "planner", "strategy"),
    [("lobby", "anytime", "temporal"), ("rooms", "greedy", "temporal"), ("lobby", "none", "heuristic")],
)
def test_a_mission_by_reports_is_the_mission_in_process(
    tmp_path: Path, scenario: str, planner: str, strategy: str
) -> None:
    async def fly() -> str:
        async with open_missions(tmp_path) as missions:
            record = await started(missions, scenario, planner=planner, strategy=strategy)
            assert await Driver(team(scenario)).drive(missions, record)
            return await missions.log(record)

    assert run(fly()) == undisturbed(scenario, planner, strategy)

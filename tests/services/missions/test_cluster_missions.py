"""Missions on a Ray cluster have the same logs as local ones, whatever is killed there."""

import asyncio
from pathlib import Path

import pytest
from mission_setup import Driver, kill_now_and_then, open_missions, started, team
from support.missions.reference_missions import reference_log
from support.processes.ray_nodes import Nodes, needs_ray

from marsupial.cluster.runner import ClusterRunner

pytestmark = needs_ray


@pytest.mark.parametrize(
    ("word", "times"), [("fork_server", 4), pytest.param("ray::NodeAgent", 4, marks=pytest.mark.slow)]
)
async def test_a_mission_on_a_cluster_has_the_same_log_after_kills(
    tmp_path: Path, nodes: Nodes, cluster: ClusterRunner, word: str, times: int
) -> None:
    async with open_missions(tmp_path, cluster) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert not await driver.drive(missions, record, 3)
        killing = asyncio.create_task(kill_now_and_then(lambda: nodes.processes(word), 1, times))
        assert await driver.drive(missions, record)
        await killing
        assert await missions.log(record) == reference_log("lobby")

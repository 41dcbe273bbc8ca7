"""Missions on a Ray cluster: they come out as on this machine, whatever is killed there."""

import asyncio
import contextlib
import random
from pathlib import Path

import psutil
import pytest
from mission_house import Driver, open_missions, started, team
from ray_nodes import Nodes, needs_ray
from undisturbed import undisturbed

from marsupial.cluster.runner import ClusterRunner

pytestmark = needs_ray


async def kill_now_and_then(nodes: Nodes, seed: int, times: int, word: str) -> None:
    draw = random.Random(seed)
    for _ in range(times):
        await asyncio.sleep(draw.uniform(0.1, 0.6))
        found = await asyncio.to_thread(nodes.processes, word)
        if found:
            with contextlib.suppress(psutil.NoSuchProcess):
                draw.choice(found).kill()


@pytest.mark.parametrize(
    ("word", "times"), [("fork_server", 4), pytest.param("ray::NodeAgent", 4, marks=pytest.mark.slow)]
)
async def test_a_mission_on_a_cluster_goes_on_as_if_nothing_had_happened(
    tmp_path: Path, nodes: Nodes, cluster: ClusterRunner, word: str, times: int
) -> None:
    async with open_missions(tmp_path, cluster) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert not await driver.drive(missions, record, 3)
        killing = asyncio.create_task(kill_now_and_then(nodes, 1, times, word))
        assert await driver.drive(missions, record)
        await killing
        log = await missions.log(record)
    assert log == undisturbed("lobby")

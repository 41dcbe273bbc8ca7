"""Jobs on a Ray cluster, whose actors, launchers and connection are killed."""

import asyncio
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import pytest
from job_setup import ended, events_of, open_jobs, planned, request, start_waiting_job, submit
from misbehaving_tasks import Waits, pid_in
from support.processes.process_tree import is_alive, is_gone
from support.processes.ray_nodes import Nodes, needs_ray, settings_in
from support.waiting import HANG_S

from marsupial.cluster.ray_cluster import cluster_at, usable
from marsupial.cluster.runner import ClusterRunner
from marsupial_service.schemas.enums import JobOutcome

pytestmark = needs_ray


def actors(nodes: Nodes, job: int) -> list[psutil.Process]:
    """Return the actor above process `job`; the next attempt may go to any other one."""
    agents = nodes.processes("ray::NodeAgent")
    return [one for one in agents if job in [process.pid for process in one.children(recursive=True)]]


def gateways(nodes: Nodes, job: int) -> list[psutil.Process]:
    below = psutil.Process().children(recursive=True)
    return [process for process in below if "marsupial.cluster.gateway" in " ".join(process.cmdline())]


@pytest.mark.parametrize("find", [actors, pytest.param(gateways, marks=pytest.mark.slow)])
async def test_a_job_continues_elsewhere_when_its_processes_are_killed(
    tmp_path: Path, nodes: Nodes, cluster: ClusterRunner, find: Callable[[Nodes, int], list[psutil.Process]]
) -> None:
    async with open_jobs(tmp_path, cluster, slots=4) as jobs:
        job, first = await start_waiting_job(jobs, tmp_path)
        assert first in [process.pid for process in nodes.planning()]
        found = find(nodes, first)
        assert found
        for process in found:
            process.kill()
        second = await pid_in(tmp_path)
        assert is_gone(first)
        assert second != first
        (tmp_path / "go").touch()
        done = await ended(jobs, job)
        assert (done.outcome, done.attempts) == (JobOutcome.SATISFICING, 2)


@pytest.fixture
def own_cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[ClusterRunner]:
    """A runner with its own cluster, as with `serve --ray local`."""
    with TemporaryDirectory(prefix="ray-", dir="/tmp") as folder:  # paths of sockets must be short
        for name, value in settings_in(Path(folder)).items():
            monkeypatch.setenv(name, value)
        runner = ClusterRunner(usable(cluster_at("local")), ("marsupial", "marsupial_service"))
        yield runner
        runner.shutdown()


@pytest.mark.slow
@pytest.mark.parametrize("lost", [["raylet"], ["gcs_server"], ["raylet", "gcs_server", "python"]])
async def test_an_own_cluster_is_restarted_when_it_is_lost_and_jobs_continue_there(
    tmp_path: Path, own_cluster: ClusterRunner, lost: list[str]
) -> None:
    async with open_jobs(tmp_path, own_cluster) as jobs:
        job, first = await start_waiting_job(jobs, tmp_path)
        gateway = psutil.Process(own_cluster._gateway.pid)  # other tests may have a cluster below this process
        before = [gateway, *gateway.children(recursive=True)]
        for process in before:
            if process.name() in lost:
                process.kill()
        second = await pid_in(tmp_path)
        assert second != first
        assert psutil.wait_procs(before, HANG_S)[1] == []
        (tmp_path / "go").touch()
        done = await ended(jobs, job)
        assert (done.outcome, done.attempts) == (JobOutcome.SATISFICING, 2)


async def test_as_many_jobs_run_as_there_are_processors_and_the_rest_wait_in_the_queue(
    tmp_path: Path, cluster: ClusterRunner
) -> None:
    folders = [tmp_path / str(number) for number in range(3)]
    async with open_jobs(tmp_path, cluster, slots=8) as jobs:
        waiting = []
        for folder in folders:
            folder.mkdir()
            waiting.append(await submit(jobs, request(Waits(folder), digest=folder.name.encode())))
        for folder in folders[:2]:
            await pid_in(folder)
        states = [record.state.value for record in await jobs.list("me")]
        assert sorted(states) == ["queued", "running", "running"]
        cancelled = await jobs.cancel(waiting[0])
        assert cancelled.outcome is JobOutcome.CANCELLED
        await pid_in(folders[2])
        for folder in folders:
            (folder / "go").touch()
        assert [(await ended(jobs, job)).outcome for job in waiting[1:]] == [JobOutcome.SATISFICING] * 2


async def test_waiting_for_a_cluster_ends_with_the_service(tmp_path: Path, cluster: ClusterRunner) -> None:
    async with open_jobs(tmp_path / "other", cluster, slots=2) as others:
        for number in range(2):
            (tmp_path / str(number)).mkdir()
            await submit(others, request(Waits(tmp_path / str(number)), digest=bytes([number])))
            await pid_in(tmp_path / str(number))
        async with open_jobs(tmp_path / "store", cluster) as jobs:
            job = await submit(jobs)
            await asyncio.sleep(0.3)
            await jobs.stop()
            (record,) = await jobs.list("me")
            assert (record.id, record.state.value, record.attempts) == (job, "queued", 0)


async def test_plans_come_from_a_cluster_as_they_are_found(tmp_path: Path, cluster: ClusterRunner) -> None:
    async with open_jobs(tmp_path, cluster) as jobs:
        job = await submit(jobs)
        await planned(jobs, job)
        assert (await ended(jobs, job)).outcome in (JobOutcome.SATISFICING, JobOutcome.OPTIMAL)
        assert [event.type for event in await events_of(jobs, job)][-1] == "end"


@pytest.mark.slow
async def test_a_stopped_actor_counts_as_dead_and_its_processes_end(
    tmp_path: Path, nodes: Nodes, cluster: ClusterRunner
) -> None:
    async with open_jobs(tmp_path, cluster) as jobs:
        job, first = await start_waiting_job(jobs, tmp_path)
        stopped = actors(nodes, first)
        try:
            for process in stopped:
                process.suspend()
            second = await pid_in(tmp_path)
        finally:
            for process in stopped:
                if is_alive(process.pid):
                    os.kill(process.pid, signal.SIGCONT)
        assert second != first
        assert is_gone(first)
        (tmp_path / "go").touch()
        assert (await ended(jobs, job)).attempts == 2

"""The gateway's link to the agent of one node."""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Any

from marsupial.cluster.node_agent import LEASE_S, LOST, Envelope, NodeAgent
from marsupial.cluster.versions import WorkerMismatch

if TYPE_CHECKING:
    from marsupial.cluster.gateway import Gateway, RelayedRun

_PREPARE_S = 300.0
"""Wall-clock time for a node agent to load what jobs need; where nothing is precompiled that takes half a minute."""

_RETRY_S = 2.0
_REFUSED_S = 30.0


class Link:
    """A node agent that is restarted whenever it is lost, as long as its node exists."""

    def __init__(self, gateway: Gateway, node: str) -> None:
        self._gateway = gateway
        self._node = node
        self.runs: dict[int, RelayedRun] = {}
        self.ready = False  # whether it accepts jobs
        self.fault = ""  # its fault in words; empty if it works
        self._gone = False
        self._agent: Any = None
        self._unsent: list[Envelope] = []
        self._is_sending = False

    async def run(self) -> None:
        """Start the agent and relay its messages; restart it until the node is gone."""
        while not self._gone:
            pause_s = _RETRY_S
            try:
                await self._run_agent()
            except Exception as error:  # any error: an agent that is silent or sends invalid data is lost
                refused = getattr(error, "cause", None)
                if isinstance(refused, WorkerMismatch):
                    pause_s = _REFUSED_S
                self._end_runs(str(refused or error).strip().rpartition("\n")[2] or type(error).__name__)
            if not self._gone:
                await asyncio.sleep(pause_s)

    async def _run_agent(self) -> None:
        self._agent = self._new_agent()
        gateway = self._gateway
        loaded = len(gateway.preload)
        await asyncio.wait_for(_result(self._agent.prepare.remote(gateway.requirements, gateway.preload)), _PREPARE_S)
        self.ready, self.fault = True, ""
        gateway.changed.set()
        if len(gateway.preload) > loaded:
            self.load()
        while not self._gone:
            for run, tag, payload in await asyncio.wait_for(_result(self._agent.collect.remote()), LEASE_S):
                if run in self.runs:
                    self.runs[run].from_agent(tag, payload)

    def _new_agent(self) -> Any:
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

        actor = self._gateway.ray.remote(num_cpus=0, max_restarts=0, max_task_retries=0)(NodeAgent)
        return actor.options(scheduling_strategy=NodeAffinitySchedulingStrategy(self._node, soft=False)).remote()

    def send(self, run: int, tag: bytes, payload: bytes = b"") -> None:
        """Send to a run."""
        self._unsent.append(Envelope(run, tag, payload))
        if not self._is_sending:
            self._is_sending = True
            self._gateway.start(self._send_queued())

    def load(self) -> None:
        """Make the agent load the latest additions to the preload list."""
        if self.ready:
            self._agent.load.remote(self._gateway.preload)

    def close(self, fault: str) -> None:
        """End it for good."""
        self._gone = True
        self._end_runs(fault)

    async def _send_queued(self) -> None:
        """Send all queued messages in one call."""
        try:
            while self._unsent:
                envelopes, self._unsent = self._unsent, []
                await asyncio.wait_for(_result(self._agent.deliver.remote(envelopes)), LEASE_S)
        except Exception as error:
            self._end_runs(str(error))
        finally:
            self._is_sending = False

    def _end_runs(self, fault: str) -> None:
        """Notify all runs that they are over; the agent, if it still exists, ends them."""
        self.ready, self.fault = False, fault
        self._gateway.changed.set()
        for run in list(self.runs.values()):
            run.from_agent(LOST, b"")
        self._unsent.clear()
        agent, self._agent = self._agent, None
        if agent is not None:
            self._gateway.start(self._end(agent))

    async def _end(self, agent: Any) -> None:
        with contextlib.suppress(Exception):  # it is gone already, or cannot be reached
            await self._gateway.call(self._gateway.ray.kill, agent)


async def _result(reference: Any) -> Any:
    """Wait for the result of an actor's method; also through Ray Client."""
    return await reference

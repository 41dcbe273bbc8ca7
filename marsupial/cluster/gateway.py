"""The gateway to a cluster: the process of a server that is connected to Ray, and relays its runs.

It is a separate process because Ray ends the process that uses it once the cluster is lost; the server then starts
another gateway. Like a fork server, it receives requests over a socket, with a channel for each. For room it makes Ray
reserve processors (a placement group) on a node with a node agent; then it relays the channel.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import pickle
import signal
import socket
import sys
import threading
import time
from collections.abc import Coroutine, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count
from typing import Any

from marsupial.cluster.node_agent import CANCEL, LEASE_S, LOST, ORDER, Envelope, NodeAgent
from marsupial.cluster.placements import Placement, PlacementPool
from marsupial.cluster.ray_cluster import Cluster, cluster_at, connected, reach
from marsupial.cluster.relay import Relay
from marsupial.cluster.versions import Requirements, WorkerMismatch, versions
from marsupial.processes import channel as frames
from marsupial.processes.channel import Channel

ROOM, PRELOAD, STATE = b"R", b"P", b"S"
"""Requests, each over a channel of its own: room for a run, functions to call once on every node, and its state. It
replies to a request for room with `channel.START` once there is room, receives the order, and replies again once the
run has begun."""

_POLL_S = 1.0
_SILENCE_S = 90.0
"""Time without an answer after which the connection is given up; Ray nearly always gives up after a minute."""

_THREADS = 70
_LEAVE_S = 2.0
_PREPARE_S = 300.0
"""Wall-clock time for a node agent to load what jobs need; where nothing is precompiled that takes half a minute."""

_RETRY_S = 2.0
_REFUSED_S = 30.0


def main(fd: int, client: int, _: int, address: str, *packages: str) -> None:
    """Serve the requests of process `client` over the socket `fd`, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    cluster = cluster_at(address)
    with socket.socket(fileno=fd) as line:
        reach(cluster)
        with connected(cluster) as ray:
            try:
                asyncio.run(_serve(ray, line, client, cluster, packages))
            except Exception as error:  # its last output; another gateway may succeed
                print(str(error) or type(error).__name__, file=sys.stderr, flush=True)
            hurry = threading.Timer(_LEAVE_S, os._exit, (0,))
            hurry.daemon = True
            hurry.start()
    os._exit(0)


async def _serve(ray: Any, line: socket.socket, client: int, cluster: Cluster, packages: tuple[str, ...]) -> None:
    loop = asyncio.get_running_loop()
    requirements = Requirements(versions=versions(packages), token=not cluster.is_local, packages=packages)
    gateway = Gateway(ray, line, requirements)
    loop.add_signal_handler(signal.SIGTERM, gateway.ended.set)
    loop.add_reader(line, gateway.accept)
    while not gateway.ended.is_set() and os.getppid() == client:
        await gateway.update_nodes()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(gateway.ended.wait(), _POLL_S)


class Gateway:
    """The connection to a cluster, and the requests for room in it."""

    def __init__(self, ray: Any, line: socket.socket, requirements: Requirements) -> None:
        self.ray = ray
        self.requirements = requirements
        self.preload: list[bytes] = []
        self.links: dict[str, Link] = {}
        self.changed = asyncio.Event()
        self.ended = asyncio.Event()
        self.placements = PlacementPool(self.call, self.start)
        self.numbers = count(1)
        self._threads = ThreadPoolExecutor(_THREADS)
        self._line = line
        self._seen_s = time.monotonic()
        self._node: str = ray.get_runtime_context().get_node_id()
        self._tasks: set[asyncio.Task[Any]] = set()

    def accept(self) -> None:
        request, fds, _, _ = socket.recv_fds(self._line, 1, 1)
        if not request:
            self.ended.set()
        for fd in fds:
            channel = Channel(socket.socket(fileno=fd))
            if request == ROOM:
                RelayedRun(self, channel)
            else:
                self._reply_at_once(channel, request)

    def _reply_at_once(self, channel: Channel, request: bytes) -> None:
        def take(_tag: bytes, payload: bytes) -> None:
            relay.send(frames.START, self.answer(request, payload))
            relay.close()

        relay = Relay(channel, take, lambda: relay.close())

    def answer(self, request: bytes, payload: bytes) -> bytes:
        """Handle a request other than for room, and return the reply."""
        if request == PRELOAD:
            self.preload += [one for one in pickle.loads(payload) if one not in self.preload]
            for link in self.links.values():
                link.load()
        return json.dumps(self._unusable_reason()).encode()

    def start(self, work: Coroutine[Any, Any, Any]) -> None:
        """Run a coroutine concurrently with all others."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def call(self, function: Any, *arguments: Any) -> Any:
        """Call a blocking function of Ray."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, function, *arguments)

    async def update_nodes(self) -> None:
        """Keep a node agent on every node that has processors, and drop those of nodes that are gone.

        Raises ConnectionError if the node of this connection is dead, TimeoutError if the cluster does not answer.
        """
        nodes = [node for node in await asyncio.wait_for(self.call(self.ray.nodes), _SILENCE_S) if node["Alive"]]
        self._seen_s = time.monotonic()
        if all(node["NodeID"] != self._node for node in nodes):
            raise ConnectionError("the Ray node of this connection is dead")
        alive = {node["NodeID"] for node in nodes if node["Resources"].get("CPU", 0) > 0}
        for gone in self.links.keys() - alive:
            self.links.pop(gone).close("the node is gone")
        for new in alive - self.links.keys():
            self.links[new] = Link(self, new)
            self.start(self.links[new].run())

    def ready(self) -> dict[str, Link]:
        """Return the links to node agents that take jobs, by the node."""
        return {node: link for node, link in self.links.items() if link.ready}

    def _unusable_reason(self) -> tuple[str, str] | None:
        """Return why no job can run, if so, and further details."""
        if time.monotonic() - self._seen_s > LEASE_S:
            return "the head of the cluster does not answer", ""
        if self.ready():
            return None
        faults = sorted({link.fault for link in self.links.values() if link.fault})
        return "no cluster node is ready", "; ".join(faults)


class RelayedRun:
    """A run from its request for room to its end."""

    def __init__(self, gateway: Gateway, channel: Channel) -> None:
        self.number = next(gateway.numbers)
        self._gateway = gateway
        self._link: Link | None = None
        self._placement: Placement | None = None
        self._wanted = self._ordered = self._client_gone = self._over = False
        self._relay = Relay(channel, self._from_client, self._client_left)

    def _from_client(self, tag: bytes, payload: bytes) -> None:
        if not self._wanted:
            self._wanted = True
            self._gateway.start(self._begin(pickle.loads(payload)))
        elif self._link is not None:
            self._link.send(self.number, tag if self._ordered else ORDER, payload)
            self._ordered = True

    def _client_left(self) -> None:
        self._client_gone = True
        if self._ordered and self._link is not None:
            self._link.send(self.number, CANCEL)
        elif self._link is not None or not self._wanted:
            self.end()

    def from_agent(self, tag: bytes, payload: bytes) -> None:
        if not self._over and tag != LOST:
            self._relay.send(tag, payload)
        if tag in (frames.ENDED, LOST):
            self.end()

    def end(self) -> None:
        """Close the channel, and release the processors."""
        if self._over:
            return
        self._over = True
        self._relay.close()
        placements, placement, link = self._gateway.placements, self._placement, self._link
        if link is not None:
            link.runs.pop(self.number, None)
        if placement is not None:
            (placements.release if link is not None and link.ready else placements.remove)(placement)

    async def _begin(self, cpus: float) -> None:
        """Find a placement and reply to the client, unless it hangs up first; after a failure it may ask again."""
        try:
            self._placement = await self._find_placement(cpus)
        finally:
            if self._client_gone or self._placement is None:
                self.end()
        if self._over or self._placement is None:
            return
        self._link = self._gateway.links.get(self._placement.node)
        if self._link is None or not self._link.ready:
            self.end()
            return
        self._link.runs[self.number] = self
        self._relay.send(frames.START)

    async def _find_placement(self, cpus: float) -> Placement | None:
        gateway = self._gateway
        while not self._client_gone:
            ready = gateway.ready()
            if not ready:
                gateway.changed.clear()
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(gateway.changed.wait(), _POLL_S)
            elif cpus == 0:
                return Placement(0, min(ready.items(), key=lambda item: len(item[1].runs))[0])
            else:
                placement = await gateway.placements.find(cpus, ready, partial(self._is_wanted, ready))
                if placement is not None:
                    return placement
        return None

    def _is_wanted(self, ready: Mapping[str, Link]) -> bool:
        """Return whether a placement on these nodes is wanted: no other nodes are ready yet."""
        return not self._client_gone and self._gateway.ready().keys() == ready.keys()


class Link:
    """A connection to the agent of one node, that is restarted whenever it is lost, as long as its node exists."""

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

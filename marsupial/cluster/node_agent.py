"""The agent on a node: an actor that runs jobs there with its own launcher, for one gateway.

It ends with the gateway: Ray ends it when its owner is gone, and it ends itself when the gateway has been silent for so
long that others consider its server dead. However it ends, all processes that it launched end with it.
"""

import asyncio
import contextlib
import os
import pickle
import platform
import sys
import time
from functools import partial
from typing import NamedTuple

from marsupial.cluster.relay import Relay
from marsupial.cluster.versions import Requirements, check_requirements
from marsupial.errors import InternalError
from marsupial.processes import channel as frames
from marsupial.processes import launcher, reaper
from marsupial.processes.jobs import GRACE_S, JobOrder

ORDER, CANCEL = b"O", b"C"
"""A gateway's orders besides messages: begin the run, end it."""

LOST = b"L"
"""Reply in place of `channel.ENDED`: the run is over, and its ending is unknown."""

POLL_S = 2.0
"""How long `collect` waits for messages."""

LEASE_S = 10.0
"""A gateway or agent that is silent for this long counts as gone; servers hold entries of a store equally long."""

_KILL_S = 2.0
_MOST_BYTES = 32 << 20


class Envelope(NamedTuple):
    """One frame of a run, or an order about it, on its way between gateway and agent."""

    run: int
    tag: bytes
    payload: bytes = b""


class NodeAgent:
    """An actor; all its methods run in one event loop."""

    def __init__(self) -> None:
        self._runs: dict[int, _AgentRun] = {}
        self._outbox: list[Envelope] = []
        self._outbox_bytes = 0
        self._paused: set[Relay] = set()
        self._contact_s = time.monotonic()

    async def prepare(self, requirements: Requirements, preload: list[bytes]) -> str:
        """Get ready for jobs, and return the name of this machine. Raises WorkerMismatch, InternalError."""
        check_requirements(requirements)
        self._has_messages = asyncio.Event()
        await self.load(preload)
        self._contact_s = time.monotonic()
        self._watching = asyncio.create_task(self._exit_when_silent())
        return platform.node()

    async def load(self, preload: list[bytes]) -> None:
        """Call pickled functions once, for all jobs."""
        calls = tuple(pickle.loads(one) for one in preload)
        await asyncio.to_thread(partial(launcher.warm_up, preload=calls))

    async def collect(self) -> list[Envelope]:
        """Return the messages of the runs, or none after a while."""
        self._contact_s = time.monotonic()
        if not self._outbox:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._has_messages.wait(), POLL_S)
        self._has_messages.clear()
        found, self._outbox, self._outbox_bytes = self._outbox, [], 0
        for relay in self._paused:
            relay.listen(on=True)
        self._paused.clear()
        self._contact_s = time.monotonic()
        return found

    async def deliver(self, envelopes: list[Envelope]) -> None:
        """Accept messages to the runs."""
        for run, tag, payload in envelopes:
            if tag == ORDER:
                self._runs[run] = _AgentRun(self, run, pickle.loads(payload)._replace(path=sys.path))
            elif run in self._runs:
                self._runs[run].deliver(tag, payload)

    def enqueue(self, envelope: Envelope, relay: Relay | None = None) -> None:
        """Queue an envelope for `collect`; a run that sends more than the gateway takes has to wait."""
        self._outbox.append(envelope)
        self._outbox_bytes += len(envelope.payload)
        self._has_messages.set()
        if envelope.tag in (frames.ENDED, LOST):
            self._runs.pop(envelope.run, None)
        elif relay is not None and self._outbox_bytes > _MOST_BYTES:
            relay.listen(on=False)
            self._paused.add(relay)

    async def _exit_when_silent(self) -> None:
        while time.monotonic() - self._contact_s < LEASE_S:
            await asyncio.sleep(LEASE_S / 10)
        os._exit(1)  # the launcher detects it


class _AgentRun:
    """A run on this node; messages to it wait until it has begun."""

    def __init__(self, agent: NodeAgent, number: int, order: JobOrder) -> None:
        self._agent = agent
        self._number = number
        self._order = order
        self._queued: list[tuple[bytes, bytes]] = []
        self._relay: Relay | None = None
        self._over = False
        self._beginning = asyncio.create_task(self._begin())

    def deliver(self, tag: bytes, payload: bytes) -> None:
        if self._relay is None:
            self._queued.append((tag, payload))
        elif tag == CANCEL:
            self._relay.end()
            asyncio.get_running_loop().call_later(GRACE_S + _KILL_S, self._kill)
        else:
            self._relay.send(tag, payload)

    async def _begin(self) -> None:
        try:
            channel, self._supervisor = await asyncio.to_thread(launcher.begin, self._order)
        except InternalError as error:
            self._end(LOST, str(error).encode())
            return
        self._agent.enqueue(Envelope(self._number, frames.START))
        self._relay = Relay(channel, self._relay_frame, lambda: self._end(LOST))
        for tag, payload in self._queued:
            self.deliver(tag, payload)
        if self._over:  # everything arrived at once
            self._relay.close()

    def _relay_frame(self, tag: bytes, payload: bytes) -> None:
        if tag == frames.ENDED:
            self._end(tag, payload)
        else:
            self._agent.enqueue(Envelope(self._number, tag, payload), self._relay)

    def _end(self, tag: bytes, payload: bytes = b"") -> None:
        if not self._over:
            self._over = True
            self._agent.enqueue(Envelope(self._number, tag, payload))
            if self._relay is not None:
                asyncio.get_running_loop().call_soon(self._relay.close)

    def _kill(self) -> None:
        if not self._over:
            reaper.kill(self._supervisor)

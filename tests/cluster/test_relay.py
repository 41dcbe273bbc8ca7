"""Channels in an event loop."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from support.waiting import wait_until_async

from marsupial.cluster.relay import Relay
from marsupial.processes.channel import MAX_BYTES, MESSAGE, Channel


@asynccontextmanager
async def open_relay(early: bytes = b"") -> AsyncIterator[tuple[Any, ...]]:
    """Return a relay whose end has read `early`, the other end, the received frames, and the event set at the end."""
    ours, theirs = map(Channel, socket.socketpair())
    theirs._line.send(early)
    ours.fill()
    taken: list[tuple[bytes, bytes]] = []
    over = asyncio.Event()
    relay = Relay(ours, lambda tag, payload: taken.append((tag, payload)), over.set)
    yield relay, theirs, taken, over
    relay.close()
    theirs.close()


async def test_frames_larger_than_what_goes_at_once_arrive_whole_both_ways() -> None:
    large = bytes(range(256)) * 20_000
    async with open_relay() as (relay, other, taken, _over):
        relay.send(MESSAGE, large)
        relay.send(MESSAGE, b"last")
        frames = [await asyncio.to_thread(other.receive_frame) for _ in range(2)]
        assert frames == [(MESSAGE, large), (MESSAGE, b"last")]
        await asyncio.to_thread(other.send_frame, MESSAGE, large)
        await wait_until_async(lambda: taken)
        assert taken == [(MESSAGE, large)]


async def test_data_sent_before_the_end_arrives_and_the_other_direction_stays_open() -> None:
    async with open_relay() as (relay, other, taken, over):
        relay.send(MESSAGE, bytes(1_000_000))
        relay.end()
        assert await asyncio.to_thread(other.receive_frame) == (MESSAGE, bytes(1_000_000))
        assert await asyncio.to_thread(other.receive_frame) is None
        assert not over.is_set()
        other.send_frame(MESSAGE, b"still")
        other.close()
        await over.wait()
        assert taken == [(MESSAGE, b"still")]


async def test_closing_waits_for_what_is_not_sent() -> None:
    async with open_relay() as (relay, other, _taken, over):
        relay.send(MESSAGE, bytes(1_000_000))
        relay.close()
        assert await asyncio.to_thread(other.receive_frame) == (MESSAGE, bytes(1_000_000))
        assert await asyncio.to_thread(other.receive_frame) is None
        assert not over.is_set()


async def test_a_peer_that_announces_a_too_large_frame_counts_as_gone() -> None:
    too_much = MESSAGE + (MAX_BYTES + 1).to_bytes(4, "big")
    for early in (too_much, b""):
        async with open_relay(early) as (_relay, other, taken, over):
            other._line.send(b"" if early else too_much)
            await over.wait()
            assert taken == []


async def test_a_sender_without_a_reader_waits() -> None:
    async with open_relay() as (relay, other, taken, _over):
        relay.listen(on=False)
        other.send_frame(MESSAGE, b"early")
        await asyncio.sleep(0.05)
        assert taken == []
        relay.listen(on=True)
        await wait_until_async(lambda: taken)

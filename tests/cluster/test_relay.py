"""Channels in an event loop."""

import asyncio
import socket
from collections.abc import Callable
from typing import Any

from patience import HANG_S

from marsupial.cluster.relay import Relay
from marsupial.processes.channel import MAX_BYTES, MESSAGE, Channel


def with_relay(use: Callable[[Relay, Channel, list[tuple[bytes, bytes]], asyncio.Event], Any]) -> None:
    """Call `use` with a relay, the other end of its channel, what the relay takes, and what it sets when it is over."""

    async def run() -> None:
        ours, theirs = map(Channel, socket.socketpair())
        taken: list[tuple[bytes, bytes]] = []
        over = asyncio.Event()
        relay = Relay(ours, lambda tag, payload: taken.append((tag, payload)), over.set)
        async with asyncio.timeout(HANG_S):
            await use(relay, theirs, taken, over)
        relay.close()
        theirs.close()

    asyncio.run(run())


def test_frames_larger_than_what_goes_at_once_arrive_whole_both_ways() -> None:
    large = bytes(range(256)) * 20_000

    async def use(relay: Relay, other: Channel, taken: list[tuple[bytes, bytes]], over: asyncio.Event) -> None:
        relay.send(MESSAGE, large)
        relay.send(MESSAGE, b"last")
        frames = [await asyncio.to_thread(other.receive_frame) for _ in range(2)]
        assert frames == [(MESSAGE, large), (MESSAGE, b"last")]
        await asyncio.to_thread(other.send_frame, MESSAGE, large)
        while not taken:
            await asyncio.sleep(0.01)
        assert taken == [(MESSAGE, large)]

    with_relay(use)


def test_what_was_sent_before_the_end_arrives_and_the_other_way_stays_open() -> None:
    async def use(relay: Relay, other: Channel, taken: list[tuple[bytes, bytes]], over: asyncio.Event) -> None:
        relay.send(MESSAGE, bytes(1_000_000))
        relay.end()
        assert await asyncio.to_thread(other.receive_frame) == (MESSAGE, bytes(1_000_000))
        assert await asyncio.to_thread(other.receive_frame) is None
        assert not over.is_set()
        other.send_frame(MESSAGE, b"still")
        other.close()
        await over.wait()
        assert taken == [(MESSAGE, b"still")]

    with_relay(use)


def test_closing_waits_for_what_is_not_sent() -> None:
    async def use(relay: Relay, other: Channel, taken: list[tuple[bytes, bytes]], over: asyncio.Event) -> None:
        relay.send(MESSAGE, bytes(1_000_000))
        relay.close()
        assert await asyncio.to_thread(other.receive_frame) == (MESSAGE, bytes(1_000_000))
        assert await asyncio.to_thread(other.receive_frame) is None
        assert not over.is_set()

    with_relay(use)


def test_one_that_announces_too_much_is_taken_for_gone() -> None:
    async def use(relay: Relay, other: Channel, taken: list[tuple[bytes, bytes]], over: asyncio.Event) -> None:
        other._line.send(MESSAGE + (MAX_BYTES + 1).to_bytes(4, "big"))
        await over.wait()
        assert taken == []

    with_relay(use)


def test_one_that_is_not_listened_to_waits() -> None:
    async def use(relay: Relay, other: Channel, taken: list[tuple[bytes, bytes]], over: asyncio.Event) -> None:
        relay.listen(on=False)
        other.send_frame(MESSAGE, b"early")
        await asyncio.sleep(0.05)
        assert taken == []
        relay.listen(on=True)
        while not taken:
            await asyncio.sleep(0.01)

    with_relay(use)

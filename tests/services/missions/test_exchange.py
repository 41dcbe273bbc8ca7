"""No line of a mission's process is left open, whenever the service ends."""

import asyncio
import gc
import socket

from services.missions.keeper import Exchange


def test_a_line_that_has_not_said_whose_it_is_is_closed_when_the_service_ends() -> None:
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(10)
        asyncio.run(_connected(line))
        assert line.recv(1) == b""
    gc.collect()  # where a warning of an open socket would come to light


async def _connected(line: socket.socket) -> None:
    exchange = Exchange()
    await exchange.start()
    try:
        line.connect(exchange.address)
        line.sendall(b"half")
        await asyncio.sleep(0.1)
    finally:
        await exchange.stop()

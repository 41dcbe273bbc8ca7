"""One end of a channel in an event loop: no method blocks."""

import asyncio
from collections.abc import Callable

from marsupial.processes.channel import Channel, FrameTooBig


class Relay:
    """Passes every received frame to `on_frame`, then calls `on_end` once, when the other end is closed.

    The constructor may already call `on_frame`, for frames that have arrived before.
    """

    def __init__(self, channel: Channel, on_frame: Callable[[bytes, bytes], None], on_end: Callable[[], None]) -> None:
        self._channel = channel
        self._on_frame = on_frame
        self._on_end = on_end
        self._loop = asyncio.get_running_loop()
        self._listening = self._sending = self._ending = self._closing = False
        self.listen(on=True)
        if not self._dispatch():
            self._loop.call_soon(self._read)  # reports the invalid frame once the caller has this object

    def send(self, tag: bytes, payload: bytes = b"") -> None:
        """Send a frame as soon as the other end accepts it."""
        if self._channel.fileno() >= 0:
            self._channel.put(tag, payload)
            self._flush()

    def end(self) -> None:
        """Signal the end of data once all of it is sent."""
        self._ending = True
        self._flush()

    def listen(self, *, on: bool) -> None:
        """Resume or pause reading; the other end has to wait during a pause."""
        if on == self._listening or self._channel.fileno() < 0:
            return
        self._listening = on
        if on:
            self._loop.add_reader(self._channel.fileno(), self._read)
        else:
            self._loop.remove_reader(self._channel.fileno())

    def close(self) -> None:
        """Close this end, once all is sent."""
        self.listen(on=False)
        self._closing = True
        self._flush()

    def _read(self) -> None:
        is_open = self._channel.fill()
        if not (self._dispatch() and is_open) and self._listening:
            self.listen(on=False)
            self._on_end()

    def _dispatch(self) -> bool:
        """Pass the received frames on; return whether they are valid."""
        try:
            for tag, payload in self._channel.frames():
                self._on_frame(tag, payload)
        except FrameTooBig:
            return False
        return True

    def _flush(self) -> None:
        channel, left = self._channel, -1
        if channel.fileno() < 0:
            return
        while channel.unsent not in (0, left):
            left = channel.unsent
            channel.flush()  # if the other end is closed, nothing is left to send
        if bool(channel.unsent) != self._sending:
            self._sending = bool(channel.unsent)
            if self._sending:
                self._loop.add_writer(channel.fileno(), self._flush)
            else:
                self._loop.remove_writer(channel.fileno())
        if self._sending:
            return
        if self._closing:
            channel.close()
        elif self._ending:
            channel.end()

"""The channel between the processes of a job: frames over a socket, both ways.

A frame is a one-byte tag, the length in four bytes, and that many bytes. Its size is bounded, so that a runaway job
can't fill the memory of its receivers.
"""

import pickle
import select
import socket
import struct
from collections.abc import Iterator

START = b"S"  # the initial order; in reply, the process id of the supervisor
MESSAGE = b"M"  # a pickled value, either way
DONE = b"D"  # from the worker: no more messages follow
FAILED = b"F"  # from the worker: pickled (ending, detail)
ENDED = b"E"  # from the supervisor: the pickled `Ended`

MAX_BYTES = 64 << 20
"""Largest payload of a frame; the mission log of a map of 4 million cells without equal neighbours has 50 MB."""

_HEADER = struct.Struct("!cI")
_CHUNK = 1 << 16  # bytes sent or received in one call
_POLL_S = 0.2  # closing a channel does not wake a thread blocked on sending over it


class FrameTooBig(ValueError):
    """A frame above the size bound, or bytes that are not a frame."""


class Channel:
    """One end of a channel. `send` and `receive` block; the other methods serve event loops.

    One thread may send while another one receives.
    """

    def __init__(self, line: socket.socket) -> None:
        line.setblocking(False)
        self._line = line
        self._unsent = bytearray()
        self._unread = bytearray()

    def send(self, value: object) -> None:
        """Send a value; block until the socket has accepted it. Raises BrokenPipeError if the other end is closed."""
        self.put_value(value)
        if not self.drain():
            raise BrokenPipeError("the other end of the channel is closed")

    def receive(self) -> object:
        """Wait for the next value. Raises EOFError if the other end is closed."""
        frame = self.receive_frame()
        if frame is None:
            raise EOFError("the other end of the channel is closed")
        return pickle.loads(frame[1])

    def receive_frame(self, timeout_s: float | None = None) -> tuple[bytes, bytes] | None:
        """Wait for the next (tag, payload); None if the other end is closed.

        Raises TimeoutError if no frame arrives within the timeout.
        """
        while True:
            for frame in self.frames():
                return frame
            if not self._wait_for(select.POLLIN, timeout_s):
                raise TimeoutError
            if not self.fill():
                return None

    def send_frame(self, tag: bytes, payload: bytes = b"") -> bool:
        """Send a frame and all queued ones, blocking as long as necessary; False if an end is closed."""
        self.put(tag, payload)
        return self.drain()

    def drain(self) -> bool:
        """Send all queued frames, blocking as long as necessary; False if an end is closed."""
        while self._unsent:
            if self.fileno() < 0:  # this end is closed
                return False
            self._wait_for(select.POLLOUT, _POLL_S)
            if not self.flush():
                return False
        return True

    def put(self, tag: bytes, payload: bytes = b"") -> None:
        """Queue a frame for `flush`. Raises FrameTooBig if it is above the bound."""
        if len(payload) > MAX_BYTES:
            raise FrameTooBig(f"a message has {len(payload)} bytes, at most {MAX_BYTES} are allowed")
        self._unsent += _HEADER.pack(tag, len(payload))
        self._unsent += payload

    def put_value(self, value: object) -> None:
        """Queue a value for `flush`. Raises FrameTooBig."""
        self.put(MESSAGE, pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL))

    @property
    def unsent(self) -> int:
        """Number of queued bytes."""
        return len(self._unsent)

    def flush(self) -> bool:
        """Send as much as possible without blocking; False if the other end is closed."""
        try:
            del self._unsent[: self._line.send(self._unsent[:_CHUNK])]
        except BlockingIOError:
            return True
        except OSError:
            self._unsent.clear()
            return False
        return True

    def fill(self) -> bool:
        """Read the available bytes, for `frames`; False if the other end is closed."""
        try:
            chunk = self._line.recv(_CHUNK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        self._unread += chunk
        return bool(chunk)

    def frames(self) -> Iterator[tuple[bytes, bytes]]:
        """Yield and remove every complete (tag, payload) that was read.

        Raises FrameTooBig if a header announces a frame above the bound.
        """
        while len(self._unread) >= _HEADER.size:
            tag, length = _HEADER.unpack_from(self._unread)
            if length > MAX_BYTES:
                raise FrameTooBig(f"a message of {length} bytes was announced, at most {MAX_BYTES} are allowed")
            end = _HEADER.size + length
            if len(self._unread) < end:
                return
            payload = bytes(self._unread[_HEADER.size : end])
            del self._unread[:end]
            yield tag, payload

    def fileno(self) -> int:
        return self._line.fileno()

    def end(self) -> None:
        """Signal the other end that no more data follows."""
        try:
            self._line.shutdown(socket.SHUT_WR)
        except OSError:  # already closed
            return

    def close(self) -> None:
        self._line.close()

    def _wait_for(self, event: int, timeout_s: float | None) -> bool:
        poll = select.poll()
        poll.register(self._line, event)
        return bool(poll.poll(None if timeout_s is None else max(0, timeout_s * 1000)))

"""The channel between the processes of a job: frames over a socket, both ways.

A frame is a one-byte tag, the length in four bytes, and that many bytes. Its size is bounded, so that a job gone wild
can't fill the memory of its listeners.
"""

import pickle
import select
import socket
import struct
from collections.abc import Iterator

START = b"S"  # the order to begin with; in answer, the process id of the supervisor
MESSAGE = b"M"  # a pickled value, either way
DONE = b"D"  # from the worker: nothing more comes
FAILED = b"F"  # from the worker: pickled (ending, detail)
ENDED = b"E"  # from the supervisor: the pickled `Ended`

MAX_BYTES = 64 << 20
"""Of a frame; the mission log of a map of 4 million cells without any two alike has 50 MB."""

_HEADER = struct.Struct("!cI")
_CHUNK = 1 << 16  # bytes a socket takes or gives at a time
_POLL_S = 0.2  # closing a channel does not wake a thread that waits to send over it


class FrameTooBig(ValueError):
    """A frame above the bound, or bytes that are no frame at all."""


class Channel:
    """One end of a channel. `send` and `receive` wait; the rest serves event loops.

    One thread may send while another one receives.
    """

    def __init__(self, line: socket.socket) -> None:
        line.setblocking(False)
        self._line = line
        self._unsent = bytearray()
        self._unread = bytearray()

    def send(self, value: object) -> None:
        """Send a value and wait until it is on its way. Raises BrokenPipeError if the other end is closed."""
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

        Raises TimeoutError if nothing comes for so long.
        """
        while True:
            for frame in self.frames():
                return frame
            if not self._wait_for(select.POLLIN, timeout_s):
                raise TimeoutError
            if not self.fill():
                return None

    def send_frame(self, tag: bytes, payload: bytes = b"") -> bool:
        """Send a frame and all that was put before, waiting as long as it takes; False if an end is closed."""
        self.put(tag, payload)
        return self.drain()

    def drain(self) -> bool:
        """Send all that was put, waiting as long as it takes; False if an end is closed."""
        while self._unsent:
            if self.fileno() < 0:  # this end is closed
                return False
            self._wait_for(select.POLLOUT, _POLL_S)
            if not self.flush():
                return False
        return True

    def put(self, tag: bytes, payload: bytes = b"") -> None:
        """Add a frame to what is to be sent by `flush`. Raises FrameTooBig if it is above the bound."""
        if len(payload) > MAX_BYTES:
            raise FrameTooBig(f"a message has {len(payload)} bytes, at most {MAX_BYTES} are allowed")
        self._unsent += _HEADER.pack(tag, len(payload))
        self._unsent += payload

    def put_value(self, value: object) -> None:
        """Add a value to what is to be sent by `flush`. Raises FrameTooBig."""
        self.put(MESSAGE, pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL))

    @property
    def unsent(self) -> int:
        """How many bytes wait to be sent."""
        return len(self._unsent)

    def flush(self) -> bool:
        """Send what goes without waiting; False if the other end is closed."""
        try:
            del self._unsent[: self._line.send(self._unsent[:_CHUNK])]
        except BlockingIOError:
            return True
        except OSError:
            self._unsent.clear()
            return False
        return True

    def fill(self) -> bool:
        """Read what is there, for `frames`; False if the other end is closed."""
        try:
            chunk = self._line.recv(_CHUNK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        self._unread += chunk
        return bool(chunk)

    def frames(self) -> Iterator[tuple[bytes, bytes]]:
        """Yield and drop every whole (tag, payload) that was read.

        Raises FrameTooBig if one is announced that is above the bound.
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
        """Return the file descriptor."""
        return self._line.fileno()

    def end(self) -> None:
        """Signal the other end that nothing more is sent."""
        try:
            self._line.shutdown(socket.SHUT_WR)
        except OSError:  # it is closed
            return

    def close(self) -> None:
        """Close this end."""
        self._line.close()

    def _wait_for(self, event: int, timeout_s: float | None) -> bool:
        poll = select.poll()
        poll.register(self._line, event)
        return bool(poll.poll(None if timeout_s is None else max(0, timeout_s * 1000)))

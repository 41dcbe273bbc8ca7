"""Misbehaving jobs for tests of `marsupial.processes.launcher`; run them in child processes only."""

import ctypes
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from marsupial.processes.channel import Channel
from marsupial.processes.jobs import ToolDied
from marsupial.processes.loading import report_compiling


def count(n: int) -> Iterator[int]:
    yield from range(n)


def nothing(_: object) -> Iterator[int]:
    return iter(())


def whoami(_: object) -> Iterator[dict[str, object]]:
    yield {"session": os.getsid(0) == os.getpid(), "core": resource.getrlimit(resource.RLIMIT_CORE)[0]}


def raise_error(text: str) -> Iterator[int]:
    yield 1
    raise ValueError(text)


def exit_with(code: int) -> Iterator[int]:
    yield 1
    os._exit(code)


def segfault(_: object) -> Iterator[int]:
    yield 1
    ctypes.string_at(0)


def sleep(_: object) -> Iterator[int]:
    yield os.getpid()
    time.sleep(3600)


def ignore_term(_: object) -> Iterator[int]:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    yield os.getpid()
    while True:
        time.sleep(3600)


def spin_in_native_code(_: object) -> Iterator[int]:
    """Block the interpreter in C forever, so that no Python signal handler can run."""
    yield os.getpid()
    yield sum(1 for _ in iter(int, 1))


def escape(_: object) -> Iterator[int]:
    """Start a child that starts a grandchild in its own session, which ignores TERM, and end the child."""
    code = (
        "import os, signal, time\n"
        "if os.fork(): os._exit(0)\n"
        "os.setsid(); signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print(os.getpid(), flush=True); time.sleep(3600)\n"
    )
    child = subprocess.Popen([sys.executable, "-S", "-c", code], stdout=subprocess.PIPE, text=True)
    yield int(child.stdout.readline())


def escape_and_sleep(_: object) -> Iterator[int]:
    yield from escape(None)
    time.sleep(3600)


def rest_and_allocate(block_bytes: int) -> Iterator[int]:
    """Sleep for longer than the sampling interval of idle jobs, then allocate."""
    time.sleep(1.0)
    yield from allocate(block_bytes)


def allocate(block_bytes: int) -> Iterator[int]:
    yield os.getpid()
    blocks = []
    while True:
        blocks.append(bytearray(os.urandom(1)) * block_bytes)
        time.sleep(0.005)


def allocate_at_once(n_bytes: int) -> Iterator[int]:
    yield os.getpid()
    yield len(bytearray(n_bytes))


def flood_output(n_bytes: int) -> Iterator[int]:
    line = b"x" * 9999 + b"\n"
    for _ in range(n_bytes // len(line)):
        os.write(1, line)
    os.write(2, b"the end\n")
    yield 1


def yield_big(n_bytes: int) -> Iterator[bytes]:
    yield b"x" * n_bytes


def yield_much(n: int) -> Iterator[bytes]:
    for _ in range(n):
        yield b"x" * 100_000


def tool_killed(_: object) -> Iterator[int]:
    yield 1
    raise ToolDied("the tool", -signal.SIGKILL)


def echo(greeting: str, channel: Channel) -> None:
    """Send the greeting, then every received value doubled, until None."""
    channel.send(greeting)
    while (value := channel.receive()) is not None:
        channel.send(value + value)  # type: ignore[operator]


def listen_late(folder: str, channel: Channel) -> None:
    """Return the number of values before None; start to listen once the file `go` exists."""
    while not (Path(folder) / "go").exists():
        time.sleep(0.01)
    n = 0
    while channel.receive() is not None:
        n += 1
    channel.send(n)


def listen_never(_: object, channel: Channel) -> None:
    channel.send(os.getpid())
    time.sleep(3600)


loaded: list[int] = []


def load() -> None:
    loaded.append(os.getpid())


def fail_to_load() -> None:
    raise ValueError("boiler pressure")


def tell_loaded(_: object) -> Iterator[list[int]]:
    yield loaded


GATE = "MARSUPIAL_TEST_GATE"


def compile_slowly() -> None:
    """Report that a function is being compiled until the file named in the environment is there."""
    report_compiling(15, 41)
    while not Path(os.environ[GATE]).exists():
        time.sleep(0.01)

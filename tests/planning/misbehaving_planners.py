"""Misbehaving searches for tests of engines in child processes; run them in child processes only."""

import ctypes
import os
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

from marsupial.model.plan import Plan
from marsupial.model.planning import Finished
from marsupial.planning.external import aries
from marsupial.planning.external.encodings import SearchRequest
from marsupial.planning.greedy import serve
from marsupial.processes.jobs import ToolDied


def eat_memory(_: SearchRequest) -> Iterator[Plan]:
    blocks = []
    while True:
        blocks.append(bytearray(os.urandom(1)) * (16 << 20))
    yield Plan(actions=())


def crash_after_a_plan(request: SearchRequest) -> Iterator[Plan]:
    plan, _ = serve(request.situation)
    yield plan
    os.abort()


def give_up(_: SearchRequest) -> Iterator[Plan]:
    yield from ()


def never_answer(_: SearchRequest) -> Iterator[Plan]:
    """Block the interpreter in C forever."""
    sum(1 for _ in iter(int, 1))
    yield Plan(actions=())


def raise_error(_: SearchRequest) -> Iterator[Plan]:
    yield from ()
    raise ValueError("no steam")


def segfault(_: SearchRequest) -> Iterator[Plan]:
    yield from ()
    ctypes.string_at(0)


def lose_its_tool(_: SearchRequest) -> Iterator[Plan]:
    yield from ()
    raise ToolDied("the tool", -signal.SIGKILL)


def aries_panicking_at_times(request: SearchRequest) -> Iterator[Plan | Finished]:
    """Search with Aries, whose first servers all panic."""
    yield from _panicking(request, aries.PANICS)


def aries_panicking_always(request: SearchRequest) -> Iterator[Plan | Finished]:
    yield from _panicking(request, aries.PANICS + 1)


def _panicking(request: SearchRequest, panics: int) -> Iterator[Plan | Finished]:
    from up_aries import solver

    folder = Path(tempfile.mkdtemp())
    script = folder / "server"
    script.write_text(
        f"""#!/bin/sh
        echo again >> {folder}/starts
        [ $(wc -l < {folder}/starts) -gt {panics} ] || exit 1
        exec {solver._find_executable()} "$@"
        """
    )
    script.chmod(0o755)
    solver._find_executable = lambda: str(script)
    yield from aries.search(request)

"""Misbehaving searches for tests of engines in child processes; run them in child processes only."""

import ctypes
import os
import signal
from collections.abc import Iterator

from marsupial.model.plan import Plan
from marsupial.planning.external.encodings import SearchRequest
from marsupial.planning.list_scheduling.greedy import serve
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

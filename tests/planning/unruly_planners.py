"""Searches that misbehave, for the tests of engines in child processes: run in child processes only."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Iterator

from marsupial.model.plan import Plan
from marsupial.planning.external.encodings import Task
from marsupial.processes.jobs import ToolDied


def eat_memory(_: Task) -> Iterator[Plan]:
    blocks = []
    while True:
        blocks.append(bytearray(os.urandom(1)) * (16 << 20))
    yield Plan(actions=())


def crash_after_a_plan(_: Task) -> Iterator[Plan]:
    yield Plan(actions=())
    os.abort()


def give_up(_: Task) -> Iterator[Plan]:
    yield from ()


def never_answer(_: Task) -> Iterator[Plan]:
    """Hold the interpreter in C for ever."""
    sum(1 for _ in iter(int, 1))
    yield Plan(actions=())


def raise_error(_: Task) -> Iterator[Plan]:
    yield from ()
    raise ValueError("no steam")


def segfault(_: Task) -> Iterator[Plan]:
    yield from ()
    ctypes.string_at(0)


def lose_its_tool(_: Task) -> Iterator[Plan]:
    yield from ()
    raise ToolDied("the tool", -signal.SIGKILL)

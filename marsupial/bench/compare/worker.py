"""A worker of the local pool: a process that carries out one mission after another.

Imports, compiled code and scenarios are there once for all its missions. It ignores Ctrl-C, which is for the process
that gives it work, and ends with that.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from multiprocessing.connection import Connection

from marsupial.bench.compare.plan import Case
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario

READY = None
"""What a worker says first."""

STOP = None
"""What ends a worker."""


def serve(line: Connection, scenarios: Mapping[Case, Scenario], budget: Budget) -> None:
    """Take trials from `line` and send their results back, until `STOP` comes or nobody is there."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from marsupial.bench.compare.trial import carry_out

    parent = os.getppid()
    try:
        line.send(READY)
        while (trial := line.recv()) is not STOP:
            line.send(carry_out(trial, scenarios[trial.case], budget, lambda: os.getppid() != parent))
    except (EOFError, OSError):  # the other end is closed
        return

"""The worker: the process that does one job, forked by its supervisor."""

from __future__ import annotations

import math
import os
import pickle
import resource
import sys
import tempfile
import traceback
from typing import NamedTuple, NoReturn

from marsupial.processes import channel as frames
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import Ending, Job, JobLimits, ToolDied, ending_of

_FILE_BYTES = 1 << 30


class JobOrder(NamedTuple):
    """What a supervisor gets; only the worker opens the pickled job, which imports its function by that path."""

    limits: JobLimits
    path: list[str]
    job: bytes


def work(channel: Channel, folder: str, order: JobOrder) -> NoReturn:
    """Do the job and leave the process; its files go into `folder`."""
    sys.path[:] = order.path
    os.environ["TMPDIR"] = tempfile.tempdir = folder
    _set_limits(order.limits)
    tag, payload = frames.DONE, b""
    try:
        job: Job = pickle.loads(order.job)
        if job.talks:
            job.function(job.argument, channel)
        else:
            for value in job.function(job.argument) or ():
                channel.send(value)
    except BaseException as error:
        traceback.print_exc()
        tag, payload = frames.FAILED, pickle.dumps(_failure(error))
    sys.stdout.flush()
    sys.stderr.flush()
    channel.send_frame(tag, payload)
    os._exit(0)


def _failure(error: BaseException) -> tuple[Ending, str]:
    if isinstance(error, ToolDied):
        return ending_of(error.returncode), str(error)
    if isinstance(error, MemoryError):
        return Ending.MEMORY, "ran out of the memory it was allowed"
    return Ending.CRASHED, f"{type(error).__name__}: {error}"


def _set_limits(limits: JobLimits) -> None:
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_FSIZE, _FILE_BYTES)
    if limits.memory_bytes is not None:
        _lower(resource.RLIMIT_DATA, 2 * limits.memory_bytes)
    if limits.cpu_s is not None:
        soft = max(1, math.ceil(limits.cpu_s))
        resource.setrlimit(resource.RLIMIT_CPU, (soft, soft + 1))


def _lower(kind: int, value: int) -> None:
    _, hard = resource.getrlimit(kind)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(kind, (value, value))

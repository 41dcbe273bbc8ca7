"""Open files: enough of them for all connections, and one line in the log when they run out."""

from __future__ import annotations

import asyncio
import logging
import resource
import time
from typing import Any

from marsupial_service.settings import ServiceLimits

# open files of a server besides its connections
OTHER_FILES = 512

_LOG_PAUSE_S = 10.0

log = logging.getLogger("marsupial.service")


class LoopErrorHandler:
    """The exception handler of an event loop: logs faults."""

    def __init__(self) -> None:
        self._logged_s = -_LOG_PAUSE_S

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if "socket.accept()" not in context.get("message", ""):
            loop.default_exception_handler(context)
        # the loop tries again at once, and fails again, as long as all files are in use
        elif time.monotonic() - self._logged_s >= _LOG_PAUSE_S:
            self._logged_s = time.monotonic()
            log.error("connections can't be accepted", extra={"reason": str(context.get("exception"))})


def allow_files(limits: ServiceLimits) -> None:
    """Raise the limit of open files to what all connections need, if the system allows it."""
    needed = limits.connections + OTHER_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    if most < needed:
        log.warning("the limit of open files allows fewer connections", extra={"connections": most - OTHER_FILES})

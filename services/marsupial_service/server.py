"""The server process: one event loop, a socket bound before anything starts, shutdown within seconds."""

import asyncio
import gc
import json
import logging
import socket
import sys
from collections.abc import Callable
from types import FrameType

import uvicorn

from marsupial.errors import UsageError
from marsupial.processes import launcher
from marsupial_service.app import create_app
from marsupial_service.http.openfiles import OTHER_FILES, LoopErrorHandler, allow_files
from marsupial_service.keys import open_keys
from marsupial_service.planners import planner_infos
from marsupial_service.settings import ServiceSettings
from marsupial_service.state import state_of
from marsupial_service.store import Store, StoreError, open_store
from marsupial_service.timestamps import timestamp

# how long requests may take at shutdown; jobs and missions then take at most as long again
_GRACE_S = 1
# connections that may wait to be accepted
_BACKLOG = OTHER_FILES // 2


class _Server(uvicorn.Server):
    """A server that reports when it is ready, and ends streams as soon as it is asked to stop."""

    def __init__(self, config: uvicorn.Config, on_exit: Callable[[], None], ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_exit = on_exit
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().set_exception_handler(LoopErrorHandler())
        await super().startup(sockets)
        if self.started:
            gc.freeze()  # otherwise the garbage collector keeps scanning all imported modules
            self._ready()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        self._on_exit()  # uvicorn waits for answers, and streams don't end by themselves
        super().handle_exit(sig, frame)


def serve(settings: ServiceSettings, *, level: str, tell: Callable[[str], None]) -> bool:
    """Serve until a signal asks to end, and return whether it could start; `tell` gets the address once it answers.

    Raises UsageError if the address or the folder can't be used, keys are needed and there is none, or a planner of
    the operator's can't be offered.
    """
    planner_infos(settings.planners)
    if settings.needs_keys:
        _check_keys(settings)
    set_up_logs(level)
    allow_files(settings.limits)
    with _listening(settings) as line:
        app = create_app(settings)
        state_of(app).store = _opened(settings)
        config = uvicorn.Config(
            app,
            http="httptools",
            limit_concurrency=settings.limits.connections + 1,  # it refuses the last one that it counts
            ws="none",
            backlog=_BACKLOG,
            log_config=None,
            access_log=False,
            timeout_graceful_shutdown=_GRACE_S,
            timeout_keep_alive=5,
            server_header=False,
            lifespan="on",
        )
        host = f"[{settings.host}]" if ":" in settings.host else settings.host
        address = f"http://{host}:{line.getsockname()[1]}"
        server = _Server(config, state_of(app).begin_shutdown, lambda: tell(address))
        try:
            server.run(sockets=[line])
        finally:
            launcher.shutdown()
            gc.freeze()  # nor before it ends
        return server.started


def _check_keys(settings: ServiceSettings) -> None:
    try:
        with open_keys(settings.place) as keys:
            if keys.all():
                return
    except StoreError as error:
        raise UsageError(str(error)) from error
    where = f"--data {settings.data}" if settings.store is None else "--store ..."
    raise UsageError(
        f"listening at {settings.host} requires API keys; create one with 'marsupial serve keys add NAME {where}'"
    )


def _opened(settings: ServiceSettings) -> Store:
    try:
        return open_store(settings.place)
    except StoreError as error:
        place = "" if settings.store is not None or str(error).startswith(str(settings.data)) else f"{settings.data}: "
        raise UsageError(f"{place}{error}") from error


def _listening(settings: ServiceSettings) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        line = socket.socket(family, kind, protocol)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind(address)
        line.listen(_BACKLOG)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"can't listen at {settings.host}, port {settings.port}: {reason}") from error
    return line


_OWN = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName", "color_message"}


class JsonLines(logging.Formatter):
    """A record as JSON: moment, level, logger, message, and whatever was given with it (``job``, ``status``)."""

    def format(self, record: logging.LogRecord) -> str:
        document = {
            "at": timestamp(int(1000 * record.created)),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **{key: value for key, value in vars(record).items() if key not in _OWN},
        }
        if record.exc_info:
            document["traceback"] = self.formatException(record.exc_info)
        return json.dumps(document, default=str)


def set_up_logs(level: str) -> None:
    """Send all logs to stderr as JSON lines."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)

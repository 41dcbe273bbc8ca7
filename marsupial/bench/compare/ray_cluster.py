"""A Ray cluster: its address, whether it may be used, and the connection to it.

Any process that may talk to a Ray cluster may run any code on it. So remote clusters are used only if they demand a
token, and processes started here listen on the loopback interface only. Ray is imported only once a cluster is
requested, as its settings are environment variables that it reads when it is imported.
"""

import ipaddress
import os
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from marsupial.errors import UsageError
from marsupial.processes.launcher import ONE_THREAD

LOCAL, AUTO, CLIENT = "local", "auto", "ray://"

REACH_S = 5.0
"""Wall-clock time within which the address must answer."""

JOIN_S = 120.0
"""Wall-clock time within which the cluster must accept the connection, on a busy machine too."""

OLDEST = (2, 52)
"""The first version of Ray with tokens."""

_INSTALL_HINT = "install it with: pip install 'marsupial[ray]' (in a checkout: pip install '.[ray]')"
_CLIENT_PORT = 10001
_STORE_BYTES = 200_000_000
_OUTPUT_BYTES = 1_000_000
_HANG_S = 15.0
_POLL_S = 0.2
_HEAD_S = 10
"""Time without its head after which a cluster of our own is given up: no process restarts that head."""

_TOKENS = ("RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH")
_TRY = "import sys, ray; ray.init(address=sys.argv[1], logging_level='DEBUG', log_to_driver=False); ray.shutdown()"
_AUTHENTICATION_ERRORS = ("InvalidAuthToken", "AuthenticationError", "missing authentication token")
_FEW_RETRIES = {"RAY_NUM_REDIS_GET_RETRIES": "5", "RAY_CLIENT_INITIAL_CONNECTION_TIMEOUT_S": "2"}


@dataclass(frozen=True, slots=True)
class Cluster:
    """A cluster's location: `address` in Ray's form, its `host` and `port`, None if Ray finds them itself."""

    address: str
    host: str | None = None
    port: int | None = None

    @property
    def is_local(self) -> bool:
        """Whether other machines can't reach it by this address."""
        return self.address == LOCAL or (self.host is not None and _is_loopback(self.host))


def ray_error(text: str) -> UsageError:
    """Return a one-line error that names the option."""
    return UsageError(f"--ray: {' '.join(text.split())}")


def cluster_at(address: str) -> Cluster:
    """Return the cluster at an address: ``HOST:PORT`` of its head, ``ray://HOST:PORT``, ``auto`` or ``local``.

    ``auto`` is the one that a node on this machine belongs to; ``local`` one of its own, for as long as it is needed.

    Raises UsageError if this is not an address.
    """
    if address in (LOCAL, AUTO):
        return Cluster(address)
    is_client = address.startswith(CLIENT)
    try:
        parts = urlsplit("//" + address.removeprefix(CLIENT))
        host, port = parts.hostname, parts.port or (_CLIENT_PORT if is_client else None)
    except ValueError:
        host = port = None
    if host is None or port is None or parts.path or parts.query or parts.username is not None:
        raise ray_error(f"must be HOST:PORT, ray://HOST:PORT, auto or local, got {address!r}")
    written = f"[{host}]" if ":" in host else host
    return Cluster(f"{CLIENT if is_client else ''}{written}:{port}", host, port)


def usable(cluster: Cluster) -> Cluster:
    """Return the cluster once it is known to be usable, with the settings of Ray made for it.

    Raises UsageError if Ray is missing, or the cluster can't be reached, refuses the connection, or demands no token.
    """
    _check_ray()
    _reach(cluster)
    _set_defaults(cluster)
    if not cluster.is_local and os.environ.get("RAY_AUTH_MODE", "").lower() != "token":
        raise ray_error(
            f"{cluster.address} may be another machine, where anybody can run code on a cluster without tokens; set "
            "RAY_AUTH_MODE=token on all machines and here, and put the cluster's token into RAY_AUTH_TOKEN or "
            "~/.ray/auth_token (`ray get-auth-token --generate` creates one)"
        )
    if cluster.address != LOCAL:
        _test_connection(cluster)
    return cluster


@contextmanager
def connected(cluster: Cluster) -> Iterator[Any]:
    """Connect to a usable cluster and yield the module `ray`; numerical libraries get one thread in its workers.

    The output of Ray goes to stderr.
    """
    import ray

    threads = {name: os.environ.get(name, "1") for name in ONE_THREAD}
    settings: dict[str, Any] = {"include_dashboard": False, "object_store_memory": _STORE_BYTES}
    with _restored_handlers():
        try:
            ray.init(
                address=cluster.address,
                runtime_env={"env_vars": threads},
                log_to_driver=False,
                logging_level="ERROR",
                **(settings if cluster.address == LOCAL else {}),
            )
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise ray_error(f"{cluster.address}: {error}") from error
    with redirect_stdout(sys.stderr):
        try:
            yield ray
        finally:
            ray.shutdown()


def _check_ray() -> None:
    try:
        found = version("ray")
    except PackageNotFoundError:
        raise ray_error(f"Ray is not installed; {_INSTALL_HINT}") from None
    if tuple(int(part) for part in found.split(".")[:2]) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise ray_error(f"Ray must be version {oldest} or newer, got {found}; {_INSTALL_HINT}")


def _reach(cluster: Cluster) -> None:
    """Raise UsageError if no process answers at the address."""
    host, port = cluster.host, cluster.port
    if host is None or port is None:
        return
    try:
        socket.create_connection((host, port), timeout=REACH_S).close()
    except OSError as error:
        why = f"no answer in {REACH_S:g} s" if isinstance(error, TimeoutError) else error.strerror or str(error)
        raise ray_error(f"can't reach {host}:{port}: {why}; is the head of the cluster running there?") from error


def _set_defaults(cluster: Cluster) -> None:
    """Set the settings of Ray that the user has not set."""
    settings = os.environ
    settings.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if cluster.is_local:
        settings.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # Ray then uses 127.0.0.1, on any system
    if cluster.address == LOCAL:
        settings.setdefault("RAY_gcs_rpc_server_reconnect_timeout_s", str(_HEAD_S))
        # Ray runs workers at nice 15, at which other work on this machine would starve the missions
        settings.setdefault("RAY_worker_niceness", "0")
    if cluster.address == LOCAL and "RAY_AUTH_MODE" not in settings and not any(name in settings for name in _TOKENS):
        settings["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
    has_token = any(settings.get(name) for name in _TOKENS) or (Path.home() / ".ray" / "auth_token").is_file()
    if "RAY_AUTH_MODE" not in settings and has_token:
        settings["RAY_AUTH_MODE"] = "token"


def _test_connection(cluster: Cluster) -> None:
    """Connect once in a separate process: Ray retries for minutes when refused, and reports the reason on stderr."""
    # Ray's client server forks while it has threads, and the child may hang: a second one is tried soon
    for seconds in (_HANG_S, JOIN_S - _HANG_S):
        code, output = _run_test([sys.executable, "-c", _TRY, cluster.address], seconds)
        if code == 0:
            return
        last = "" if code is None else output.strip().rpartition("\n")[2] or f"exit code {code}"
        if why := _known_fault(output) or last:
            raise ray_error(f"{cluster.address}: {why}")
    raise ray_error(f"{cluster.address}: no Ray cluster answers in {JOIN_S:g} s")


def _run_test(command: list[str], seconds: float) -> tuple[int | None, str]:
    """Return a program's exit code and stderr; it is ended, without a code, after a time or a known fault."""
    with tempfile.TemporaryFile() as stderr:
        program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=stderr, env=os.environ | _FEW_RETRIES)
        end_s = time.monotonic() + seconds
        code, output = None, ""
        while code is None and time.monotonic() < end_s and not _known_fault(output):
            with suppress(subprocess.TimeoutExpired):
                code = program.wait(_POLL_S)
            output = os.pread(stderr.fileno(), _OUTPUT_BYTES, 0).decode(errors="replace")
        program.kill()
        program.wait()
    return code, output


def _known_fault(output: str) -> str | None:
    """Return the fault in words, if the output of Ray shows it."""
    if "Version mismatch" in output:
        return output[output.index("Version mismatch") :]
    if any(word in output for word in _AUTHENTICATION_ERRORS):
        return (
            "the token of the cluster is missing or wrong; put it into RAY_AUTH_TOKEN or ~/.ray/auth_token, and set "
            "RAY_AUTH_MODE=token"
        )
    return None


def _is_loopback(host: str) -> bool:
    """Return whether a host name or number refers to this machine only."""
    try:
        numbers = {str(info[4][0]) for info in socket.getaddrinfo(host, None)}
    except OSError:
        return False
    return bool(numbers) and all(ipaddress.ip_address(number.partition("%")[0]).is_loopback for number in numbers)


@contextmanager
def _restored_handlers() -> Iterator[None]:
    """Restore the signal handlers: Ray installs its own, which exit on SIGTERM."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = [(number, signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)

"""A PostgreSQL server for tests and benchmarks, from the system's package; each test has its own database."""

import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any

import psutil
import psycopg
import pytest
from support.waiting import HANG_S, wait_until

DATABASES = ("sqlite", "postgres")
_NUMBERS = count(1)


class NoPostgres(Exception):
    """No server is installed."""


class PostgresServer:
    """A server in a folder of its own that listens on a socket there only. Raises NoPostgres.

    The folder is not below pytest's: each session of pytest closes these to other users, and root's server runs as one.
    """

    def __init__(self) -> None:
        self.home = _programs()
        self.folder = Path(tempfile.mkdtemp(prefix="marsupial-postgres-"))
        self._settings: tuple[str, ...] = ()
        self._user = "postgres" if os.geteuid() == 0 else None  # it refuses to run as root
        if self._user is not None:
            shutil.chown(self.folder, self._user)
        words = ("--pgdata", f"{self.folder}/data", "--username", "marsupial", "--auth", "trust", "--no-sync")
        subprocess.run([self.home / "initdb", *words], check=True, capture_output=True, timeout=HANG_S, **self._how())

    @property
    def pid(self) -> int:
        """The id of the server's main process."""
        return self._process.pid

    def start(self, *settings: str) -> None:
        """Start it, with the previous settings if none are given, and wait until it answers."""
        self._settings = settings or self._settings
        self._launch()
        wait_until(self._answers, self.folder / "log")

    def _answers(self) -> bool:
        try:
            psycopg.connect(self.url()).close()
        except psycopg.OperationalError:
            if self._process.poll() is not None:  # files left by a crash prevented the start
                self._launch()
            return False
        return True

    def _launch(self) -> None:
        words = ["-D", f"{self.folder}/data", "-c", "listen_addresses=", "-c", f"unix_socket_directories={self.folder}"]
        for setting in self._settings:
            words += ["-c", setting]
        with open(self.folder / "log", "ab") as log:
            self._process = subprocess.Popen([self.home / "postgres", *words], stdout=log, stderr=log, **self._how())

    def start_again(self) -> None:
        """Start it again if it has ended although nobody stopped it, and print how and its log."""
        if self._process.poll() is not None:
            log = (self.folder / "log").read_text(errors="replace")
            print(f"the database server ended with {self._process.returncode}; the end of its log:\n{log[-2000:]}")
            self.start()

    def stop(self, how: signal.Signals = signal.SIGQUIT) -> None:
        """Stop it; by default at once, as in a crash."""
        self._process.send_signal(how)
        self._process.wait(HANG_S)

    def remove(self) -> None:
        """End it and remove its folder."""
        if self._process.poll() is None:
            self.crash()
        shutil.rmtree(self.folder)

    def crash(self) -> None:
        """Kill all its processes as by ``kill -9``, so that none of them writes anything more."""
        below = psutil.Process(self.pid).children(recursive=True)
        self._process.kill()
        self._process.wait()
        for process in below:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        psutil.wait_procs(below, timeout=HANG_S)

    def _how(self) -> dict[str, Any]:
        return {
            "user": self._user,
            "cwd": self.folder,
            "env": {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"},
            "stdin": subprocess.DEVNULL,
            "start_new_session": True,
        }

    def url(self, name: str = "postgres") -> str:
        return f"postgresql://marsupial@/{name}?host={self.folder}"

    def database(self) -> str:
        """Return the address of a new database."""
        name = f"d{next(_NUMBERS)}"
        with psycopg.connect(self.url(), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}".encode())
        return self.url(name)


def _programs() -> Path:
    """Return the folder of the newest server that is installed. Raises NoPostgres."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    on_path = shutil.which("initdb")
    if not found and on_path is None:
        raise NoPostgres("no PostgreSQL server is installed (Debian: apt-get install postgresql)")
    return found[-1].parent if found else Path(str(on_path)).resolve().parent


@contextmanager
def postgres_server(*settings: str) -> Iterator[PostgresServer]:
    """Yield a running server; tests are skipped if none is installed."""
    try:
        server = PostgresServer()
    except NoPostgres as error:
        pytest.skip(str(error))
    server.start(*settings)
    try:
        yield server
    finally:
        server.remove()

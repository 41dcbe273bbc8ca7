"""A PostgreSQL server for tests, from the system's package; every test has a database of its own in it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import psycopg
import pytest

DATABASES = ("sqlite", "postgres")
_NUMBERS = count(1)


class PostgresServer:
    """A server in a folder, which only listens there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.home = _programs()
        self._user = "postgres" if os.geteuid() == 0 else None  # it refuses to be run by root
        if self._user is not None:
            shutil.chown(folder, self._user)
            for parent in folder.parents:
                if parent.stat().st_uid == 0 and not parent.stat().st_mode & 0o001:
                    parent.chmod(parent.stat().st_mode | 0o011)
        words = ("--pgdata", f"{folder}/data", "--username", "marsupial", "--auth", "trust", "--no-sync")
        subprocess.run([self.home / "initdb", *words], check=True, capture_output=True, timeout=120, **self._how())

    def start(self, *settings: str) -> None:
        """Start it, and wait until it answers."""
        words = ["-D", f"{self.folder}/data", "-c", "listen_addresses=", "-c", f"unix_socket_directories={self.folder}"]
        for setting in settings:
            words += ["-c", setting]
        with open(self.folder / "log", "ab") as log:
            self._process = subprocess.Popen([self.home / "postgres", *words], stdout=log, stderr=log, **self._how())
        until = time.monotonic() + 60
        while True:
            try:
                psycopg.connect(self.url()).close()
                return
            except psycopg.OperationalError:
                assert time.monotonic() < until, (self.folder / "log").read_text()
                time.sleep(0.02)

    def stop(self, how: signal.Signals = signal.SIGQUIT) -> None:
        """End it: at once, as in a crash, unless told otherwise."""
        self._process.send_signal(how)
        self._process.wait(60)

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
    """Return the folder of the newest server that is installed; tests that need one are skipped where there is none."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    on_path = shutil.which("initdb")
    if not found and on_path is None:
        pytest.skip("no PostgreSQL server is installed (Debian: apt-get install postgresql)")
    return found[-1].parent if found else Path(str(on_path)).resolve().parent


@contextmanager
def postgres_server(folder: Path, *settings: str) -> Iterator[PostgresServer]:
    server = PostgresServer(folder)
    server.start(*settings)
    try:
        yield server
    finally:
        server.stop()

"""A PostgreSQL server for tests, from the system's package; every test has a database of its own in it."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

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
        self._run("initdb", "--pgdata", f"{folder}/data", "--username", "marsupial", "--auth", "trust", "--no-sync")

    def start(self, *settings: str) -> None:
        words = ["-c listen_addresses=", f"-c unix_socket_directories={self.folder}", *(f"-c {s}" for s in settings)]
        log = f"{self.folder}/log"
        self._run(
            "pg_ctl", "--pgdata", f"{self.folder}/data", "--log", log, "--wait", "--options", " ".join(words), "start"
        )

    def stop(self, how: str = "immediate") -> None:
        self._run("pg_ctl", "--pgdata", f"{self.folder}/data", "--mode", how, "--wait", "stop")

    def url(self, name: str = "postgres") -> str:
        return f"postgresql://marsupial@/{name}?host={self.folder}"

    def database(self) -> str:
        """Return the address of a new database."""
        name = f"d{next(_NUMBERS)}"
        with psycopg.connect(self.url(), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}".encode())
        return self.url(name)

    def _run(self, program: str, *words: str) -> None:
        done = subprocess.run(
            [str(self.home / program), *words],
            user=self._user,
            cwd=self.folder,
            env={"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL if program == "pg_ctl" else subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stdout


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

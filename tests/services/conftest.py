"""A shared server, and locations for stores."""

import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from mission_setup import body
from service_requests import client
from support.services.databases import DATABASES, PostgresServer, postgres_server
from support.services.servers import Server

SCRIPTED = shlex.join([sys.executable, "-SE", str(Path(__file__).with_name("scripted_planner.py"))])
SCRIPTED += " {domain} {problem}"


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    limits = ("--limit", "body_bytes=200000", "--limit", "cells=10000", "--limit", "robots=30", "--limit", "streams=3")
    planners = (f"--planner=scripted={SCRIPTED}", "--planner=gone=./nowhere {domain} {problem}")
    with Server(tmp_path_factory.mktemp("service"), *limits, *planners) as found:
        yield found


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server for browsers, which simulates many missions."""
    with Server(tmp_path_factory.mktemp("page"), "--limit", "simulations=20") as server:
        server.wait_ready()
        yield server


@pytest.fixture
def http(server: Server) -> Iterator[httpx.Client]:
    with client(server) as found:
        yield found


@pytest.fixture
def mission(server: Server) -> Iterator[str]:
    """The path of a mission before its first report."""
    status, _, created = server.ask("POST", "/v1/missions", body())
    assert status == 201
    yield created["links"]["self"]
    server.ask("POST", created["links"]["cancel"])


@pytest.fixture(scope="session")
def shared_postgres() -> Iterator[PostgresServer]:
    """A database server without fsync."""
    with postgres_server("fsync=off", "max_connections=300") as found:
        yield found


@pytest.fixture
def postgres(shared_postgres: PostgresServer) -> Iterator[PostgresServer]:
    """That server, running; how it ended is printed beside the test that it ended in, and it is started again."""
    shared_postgres.start_again()
    yield shared_postgres
    shared_postgres.start_again()


@pytest.fixture
def shared(postgres: PostgresServer) -> str:
    """The address of a new database of that server."""
    return postgres.database()


@pytest.fixture(params=DATABASES)
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The location of a store: once a folder, once a shared database."""
    if request.param == "sqlite":
        return str(tmp_path / "store")
    server: PostgresServer = request.getfixturevalue("postgres")
    return server.database()

"""One server for all tests that don't need one of their own."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest
from servers import Server
from service_house import client


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    limits = ("--limit", "body_bytes=200000", "--limit", "cells=10000", "--limit", "robots=30", "--limit", "streams=3")
    with Server(tmp_path_factory.mktemp("service"), *limits) as found:
        yield found


@pytest.fixture
def http(server: Server) -> Iterator[httpx.Client]:
    with client(server) as found:
        yield found

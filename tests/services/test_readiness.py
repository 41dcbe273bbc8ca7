"""`/readyz` shows at once whether the service has started, and within seconds whether the store accepts writes."""

import sqlite3
import time
from contextlib import closing
from pathlib import Path

import httpx
import psycopg
from service_requests import client, problem
from support.services.databases import PostgresServer
from support.services.servers import Server
from support.waiting import wait_until

from marsupial_service.store.sqlite import FILE


def refused(http: httpx.Client) -> str:
    """Wait until the service is not ready, and return its answer."""
    wait_until(lambda: http.get("/readyz").status_code != 200, "a store that can't be written")
    answer = http.get("/readyz")
    assert int(answer.headers["retry-after"]) > 0
    detail: str = problem(answer, 503, "not-ready")["detail"]
    return detail


def test_a_service_says_how_far_it_is_with_its_start_and_is_not_ready_while_its_database_is_locked(
    tmp_path: Path,
) -> None:
    with Server(tmp_path) as server, client(server) as http:
        starting = []
        while (answer := http.get("/readyz")).status_code != 200:
            starting.append(problem(answer, 503, "not-ready")["detail"])
            assert answer.headers["retry-after"] == "1"
            time.sleep(0.05)
        assert any(text.startswith("starting: ") for text in starting)
        assert all(text.startswith(("starting: ", "planning and the store are being checked")) for text in starting)
        with closing(sqlite3.connect(tmp_path / FILE, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            assert refused(http) == "the store does not answer within 5 s"
            assert http.get("/v1/jobs").status_code == 200
        server.wait_ready()


def test_a_service_with_a_read_only_database_is_not_ready_and_shows_no_addresses(
    tmp_path: Path, postgres: PostgresServer
) -> None:
    url = postgres.database()
    sql = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s"

    def allow_writes(allowed: str) -> None:
        name = psycopg.conninfo.conninfo_to_dict(url)["dbname"]
        with psycopg.connect(postgres.url(), autocommit=True) as connection:
            connection.execute(f"ALTER DATABASE {name} SET default_transaction_read_only = {allowed}".encode())
            connection.execute(sql, (name,))

    with Server(tmp_path, "--store", url) as server, client(server) as http:
        server.wait_ready()
        allow_writes("on")
        assert refused(http) == "nothing was stored; see the server log"
        answer = problem(http.post("/v1/jobs", json=http.get("/v1/demo-data/office-2x2").json()), 503, "not-ready")
        assert answer["detail"] == "nothing was stored; see the server log"
        assert "read-only transaction" in server.log
        allow_writes("off")
        server.wait_ready()

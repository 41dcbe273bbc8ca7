"""Attacks by strangers: small requests for much work, and connections without a request."""

from __future__ import annotations

import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

from support.services.attacks import ATTACKS, MOST_MB, MOST_S, REPORTS, Cost, cost_of, mission
from support.services.plain_client import HOST, ask
from support.services.proxies import Proxy

from benchmarks.trial.rows import TrialRow, judged, times
from benchmarks.trial.trial_server import running_server

ATTACK = "attack"
HEALTH_GOAL_S = 0.1

_FILES = 512
_PATIENT = {"client_header_timeout": "60s"}


def small_rows(say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Send every known small request, and measure its cost to the server's process."""
    say(f"attack: {len(ATTACKS) + len(REPORTS)} small requests")
    with running_server() as server:
        for name, attack in ATTACKS.items():
            yield _small_row(name, cost_of(server, "POST", attack.path, attack.body()), attack.statuses)
        links = ask(server.port, "POST", "/v1/missions", mission()).document["links"]
        for name, (body, status) in REPORTS.items():
            yield _small_row(name, cost_of(server, "POST", links["reports"], body), (status,))


def _small_row(name: str, cost: Cost, statuses: tuple[int, ...]) -> TrialRow:
    held = cost.cpu_s <= MOST_S and cost.memory_mb <= MOST_MB and cost.reply.status in statuses
    return TrialRow(
        part=ATTACK,
        requirement=name,
        figure=f"{1000 * cost.cpu_s:.0f} ms, {cost.memory_mb:.0f} MB in the server; status {cost.reply.status}",
        goal=f"{1000 * MOST_S:.0f} ms, {MOST_MB} MB",
        judgement=judged(held),
        values={"cpu_s": cost.cpu_s, "memory_mb": cost.memory_mb, "status": cost.reply.status},
    )


def half_open_rows(connections: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Open connections to the proxy that send nothing or half a request, and check the server's health over others."""
    say(f"attack: {connections} half-open connections")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, max(soft, connections + _FILES)), hard))
    seconds = []
    with running_server() as server, Proxy(server.data, [server.port], _PATIENT) as proxy, ExitStack() as kept:
        for i in range(connections):
            connection = kept.enter_context(socket.create_connection((HOST, proxy.port), timeout=30))
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: l" * (i % 2))
        for _ in range(100):
            begun = time.monotonic()
            ask(proxy.port, "GET", "/healthz")
            seconds.append(time.monotonic() - begun)
    yield times(ATTACK, f"/healthz among {connections} half-open connections", seconds, HEALTH_GOAL_S)

"""Missions to which our simulator reports through all kills: each must end as if nothing had been killed."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

import httpx2
from support.missions import reference_missions
from support.missions.reference_missions import STEPS, LogLines
from support.services import plain_client

from benchmarks.trial.rows import TrialRow, none_of
from marsupial.errors import UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial_client import Client, Mission
from marsupial_client.mission_documents import Brief
from marsupial_service.simulation import simulate_mission

SCENARIO, STRATEGY, PLANNER = "lobby", "temporal", "greedy"
SEEDS = 5
_UNREACHED = "can't be reached"
_PATIENCE_S = 60.0
_URL = f"http://{plain_client.HOST}"


class AnyServer(httpx2.HTTPTransport):
    """Sends each request to any of the servers at `ports`."""

    def __init__(self, ports: Sequence[int]) -> None:
        super().__init__()
        self._ports = ports

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request."""
        request.url = request.url.copy_with(port=random.choice(self._ports))
        return super().handle_request(request)


def client_of(ports: Sequence[int]) -> httpx2.Client:
    """Return a client that sends each request to any of the servers, so a retry reaches another one if one is dead."""
    return httpx2.Client(transport=AnyServer(ports), trust_env=False)


class Reporter(Client):
    """A client that remembers its missions and their acknowledged reports; `begun` gets their ids."""

    def __init__(self, ports: Sequence[int], begun: Callable[[str], None], key: str | None) -> None:
        super().__init__(_URL, key=key, patience_s=_PATIENCE_S, http=client_of(ports))
        self.missions: list[Mission] = []
        self._begun = begun

    def begin(self, brief: Brief, idempotency_key: str | None = None) -> Mission:
        """Start a mission and remember it."""
        self.missions.append(super().begin(brief, idempotency_key))
        self._begun(self.missions[-1].id)
        return self.missions[-1]


@dataclass(slots=True)
class MissionResults:
    """The results of missions.

    Attributes
    ----------
    reports, lost
        Numbers of acknowledged reports, and of those that the service has lost.
    differ
        Missions whose log, or the service's own log, differs from that of the reference_log mission.
    odd
        The ways in which missions failed.
    """

    missions: int = 0
    reports: int = 0
    lost: int = 0
    differ: int = 0
    odd: list[str] = field(default_factory=list)

    def rows(self, part: str) -> list[TrialRow]:
        """Return rows of failures that must not have happened."""
        said = "".join(f"; {reason}" for reason in sorted(set(self.odd)))
        return [
            none_of(part, "acknowledged reports of missions lost", self.lost, f" of {self.reports}"),
            none_of(part, "missions unlike the reference_log one", self.differ, f" of {self.missions}"),
            none_of(part, "missions that broke off", len(self.odd), f" of {self.missions}{said}"),
        ]


class ExplorerClient:
    """Runs one mission after the other until `stop`."""

    def __init__(
        self,
        ports: Sequence[int],
        results: MissionResults,
        begun: Callable[[str], None],
        first: int = 0,
        key: str | None = None,
    ) -> None:
        self._ports = ports
        self._results = results
        self._begun = begun
        self._first = first
        self._key = key
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._go, daemon=True)
        self._thread.start()

    def stop(self, within_s: float) -> None:
        """Let the current mission finish, then end."""
        self._over.set()
        self._thread.join(within_s)
        if self._thread.is_alive():
            self._results.odd.append("it does not end")

    def _go(self) -> None:
        number = self._first
        while not self._over.is_set():
            number += 1
            try:
                self._explore(1 + number % SEEDS)
            except Exception as error:
                if _UNREACHED not in str(error):
                    self._results.odd.append(f"{error}")

    def _explore(self, seed: int) -> None:
        expected, seen = reference_log(seed), LogLines()
        client = Reporter(self._ports, self._begun, self._key)
        self._results.missions += 1
        try:
            simulate_mission(
                client,
                builtin_scenario(SCENARIO),
                strategy=STRATEGY,
                planner=PLANNER,
                budget=STEPS,
                seed=seed,
                observer=seen,
                stopping=lambda: nullcontext(lambda: False),
            )
        except UsageError as error:
            if _UNREACHED in str(error):
                self._results.missions -= 1
            raise
        with Client(_URL, key=self._key, patience_s=_PATIENCE_S, http=client_of(self._ports)) as afterwards:
            for mission in client.missions:
                self._results.reports += mission.n
                self._results.lost += max(0, mission.n - afterwards.mission(mission.id).n)
        self._results.differ += seen.text != expected


def reference_log(seed: int) -> str:
    """Return the log of the mission when run in this process."""
    return reference_missions.reference_log(SCENARIO, PLANNER, STRATEGY, seed)

"""Metrics for Prometheus: requests, jobs and missions, slots, streams, the store, the server's process."""

import asyncio
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    Info,
    ProcessCollector,
    disable_created_metrics,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily
from prometheus_client.registry import Collector

from marsupial_service.missions.codeversion import code_version

disable_created_metrics()  # the moments at which counters began: as many series again, which nobody asks for

GAUGES = (
    ("jobs", "Stored jobs, by state.", "state"),
    ("job_outcomes", "Stored jobs that have ended, by outcome.", "outcome"),
    ("missions", "Stored missions, by state.", "state"),
    ("jobs_waiting", "Waiting jobs, by owner.", "owner"),
    ("missions_open", "Open missions, by owner.", "owner"),
    ("backlog", "Reports and controls that wait for an answer."),
    ("missions_left", "Open missions that a server could not continue, and no other has continued."),
    ("report_age_seconds", "Seconds since the last report or control of the open mission that waits for longest."),
    ("commands_age_seconds", "Seconds since the last events of the open mission that waits for longest."),
    ("requests_waiting", "Requests that wait for a process: to read a large body, or for an analysis.", "kind"),
    ("planning_seconds_left", "Seconds left of the planning quota, by owner who has used some.", "owner"),
    ("slots", "Slots for planning."),
    ("slots_in_use", "Slots in use."),
    ("store_bytes", "Bytes of jobs and missions."),
    ("store_disk_bytes", "Bytes of the store on disk."),
    ("event_streams", "Open event streams."),
)
"""Name, meaning and label, if any, of the metrics that are read when they are asked for."""


_DELAY_S = 0.25
# buckets of the delay of the event loop, in seconds
_DELAYS_S = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


async def measure_delay(observe: Callable[[float], None]) -> None:
    """Observe for ever how much later than asked for the event loop wakes a task: requests wait as long."""
    while True:
        due_s = time.monotonic() + _DELAY_S
        await asyncio.sleep(_DELAY_S)
        observe(max(0.0, time.monotonic() - due_s))


class _StoreErrors(Collector):
    """The failures that the store has counted."""

    def __init__(self) -> None:
        self.counts: Mapping[str, int] = {}

    def collect(self) -> Iterator[CounterMetricFamily]:
        family = CounterMetricFamily("marsupial_store_errors", "Failed writes and reads of the store.", labels=["kind"])
        for kind, count in self.counts.items():
            family.add_metric([kind], count)
        yield family


class HttpMetrics:
    """Counts of one service."""

    def __init__(self) -> None:
        self._registry = own = CollectorRegistry()
        self._requests = Counter("marsupial_requests", "Requests.", ("method", "route", "status"), registry=own)
        seconds = "Seconds to the end of the answer."
        self._seconds = Histogram("marsupial_request_seconds", seconds, ("route",), registry=own)
        seconds = "Seconds from storing a report to storing its commands, for missions of this server."
        self._lag = Histogram("marsupial_command_lag_seconds", seconds, registry=own)
        seconds = "Seconds of planning and related work in this server, by owner."
        self._planned = Counter("marsupial_planning_seconds", seconds, ("owner",), registry=own)
        failures = "Failures of background tasks, which are restarted."
        self._failures = Counter("marsupial_background_failures", failures, ("task",), registry=own)
        resumed = "Missions that got another process: restarted, or taken over from another server."
        self._resumed = Counter("marsupial_missions_resumed", resumed, ("why",), registry=own)
        for why in ("restart", "takeover"):
            self._resumed.labels(why=why)
        seconds = "Seconds by which the server's event loop is late."
        self._delay = Histogram("marsupial_event_loop_delay_seconds", seconds, buckets=_DELAYS_S, registry=own)
        Info("marsupial_build", "The version of the code.", registry=own).info({"version": code_version()})
        ProcessCollector(registry=own)
        self._store_errors = _StoreErrors()
        own.register(self._store_errors)
        self._gauges = {
            name: Gauge(f"marsupial_{name}", meaning, label, registry=own) for name, meaning, *label in GAUGES
        }

    def request(self, method: str, route: str, status: int, seconds: float) -> None:
        self._requests.labels(method=method, route=route, status=str(status)).inc()
        self._seconds.labels(route=route).observe(seconds)

    def lag(self, seconds: float) -> None:
        """Record how long after a report the commands that answer it were stored."""
        self._lag.observe(seconds)

    def planned(self, owner: str, seconds: float) -> None:
        """Count the seconds that planning for an owner has taken."""
        self._planned.labels(owner=owner).inc(seconds)

    def failed(self, task: str) -> None:
        self._failures.labels(task=task).inc()

    def resumed(self, why: str) -> None:
        self._resumed.labels(why=why).inc()

    def delay(self, seconds: float) -> None:
        self._delay.observe(seconds)

    def text(self, values: Mapping[str, Any]) -> bytes:
        """Return everything in Prometheus' text format; `values` of `GAUGES`, those with a label by its values."""
        self._store_errors.counts = values["store_errors"]
        for name, gauge in self._gauges.items():
            if isinstance(values[name], Mapping):
                gauge.clear()  # drop owners who no longer have any
                for label, count in values[name].items():
                    gauge.labels(label).set(count)
            else:
                gauge.set(values[name])
        return generate_latest(self._registry)

"""Metrics for Prometheus: requests by route and status, jobs and missions, slots, streams."""

from collections.abc import Mapping
from typing import Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

GAUGES = (
    ("jobs", "Stored jobs, by state.", "state"),
    ("job_outcomes", "Stored jobs that have ended, by outcome.", "outcome"),
    ("missions", "Stored missions, by state.", "state"),
    ("jobs_waiting", "Waiting jobs, by owner.", "owner"),
    ("missions_open", "Open missions, by owner.", "owner"),
    ("backlog", "Reports and controls that wait for an answer."),
    ("planning_seconds_left", "Seconds left of the planning quota, by owner who has used some.", "owner"),
    ("slots", "Slots for planning."),
    ("slots_in_use", "Slots in use."),
    ("store_bytes", "Bytes of jobs and missions."),
    ("store_disk_bytes", "Bytes of the store on disk."),
    ("event_streams", "Open event streams."),
)
"""Name, meaning and label, if any, of the metrics that are read when they are asked for."""


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

    def text(self, values: Mapping[str, Any]) -> bytes:
        """Return everything in Prometheus' text format; `values` of `GAUGES`, those with a label by its values."""
        for name, gauge in self._gauges.items():
            if isinstance(values[name], Mapping):
                gauge.clear()  # drop owners who no longer have any
                for label, count in values[name].items():
                    gauge.labels(label).set(count)
            else:
                gauge.set(values[name])
        return generate_latest(self._registry)

"""Metrics for Prometheus: requests by route and status, jobs and missions, slots, streams."""

from collections.abc import Mapping
from typing import Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from marsupial_service.entries.capacity import Sizes
from marsupial_service.jobs.records import Metrics
from marsupial_service.missions.records import MissionCounts


class HttpMetrics:
    """Counts of one service."""

    def __init__(self) -> None:
        self._registry = own = CollectorRegistry()
        self._requests = Counter("marsupial_requests", "Requests.", ("method", "route", "status"), registry=own)
        seconds = "Seconds to the end of the answer."
        self._seconds = Histogram("marsupial_request_seconds", seconds, ("route",), registry=own)
        self._jobs = Gauge("marsupial_jobs", "Stored jobs, by state.", ("state",), registry=own)
        self._outcomes = Gauge(
            "marsupial_job_outcomes", "Stored jobs that have ended, by outcome.", ("outcome",), registry=own
        )
        self._missions = Gauge("marsupial_missions", "Stored missions, by state.", ("state",), registry=own)
        self._waiting = Gauge("marsupial_jobs_waiting", "Waiting jobs, by owner.", ("owner",), registry=own)
        self._open = Gauge("marsupial_missions_open", "Open missions, by owner.", ("owner",), registry=own)
        self._backlog = Gauge("marsupial_backlog", "Reports and controls that wait for an answer.", registry=own)
        seconds = "Seconds from storing a report to storing its commands, for missions of this server."
        self._lag = Histogram("marsupial_command_lag_seconds", seconds, registry=own)
        seconds = "Seconds of planning and related work in this server, by owner."
        self._planned = Counter("marsupial_planning_seconds", seconds, ("owner",), registry=own)
        failures = "Failures of background tasks, which are restarted."
        self._failures = Counter("marsupial_background_failures", failures, ("task",), registry=own)
        seconds = "Seconds left of the planning quota, by owner who has used some."
        self._left = Gauge("marsupial_planning_seconds_left", seconds, ("owner",), registry=own)
        self._slots = Gauge("marsupial_slots", "Slots for planning.", registry=own)
        self._slots_used = Gauge("marsupial_slots_in_use", "Slots in use.", registry=own)
        self._stored = Gauge("marsupial_store_bytes", "Bytes of jobs and missions.", registry=own)
        self._disk = Gauge("marsupial_store_disk_bytes", "Bytes of the store on disk.", registry=own)
        self._streams = Gauge("marsupial_event_streams", "Open event streams.", registry=own)

    def request(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count an answered request."""
        self._requests.labels(method=method, route=route, status=str(status)).inc()
        self._seconds.labels(route=route).observe(seconds)

    def lag(self, seconds: float) -> None:
        """Record how long after a report the commands that answer it were stored."""
        self._lag.observe(seconds)

    def planned(self, owner: str, seconds: float) -> None:
        """Count the seconds that planning for an owner has taken."""
        self._planned.labels(owner=owner).inc(seconds)

    def failed(self, task: str) -> None:
        """Count a failure of a background task."""
        self._failures.labels(task=task).inc()

    def text(
        self, jobs: Metrics, missions: MissionCounts, left_s: Mapping[str, float], streams: int, sizes: Sizes
    ) -> bytes:
        """Return everything in Prometheus' text format; `left_s` is what owners have left of their planning time."""
        by_label: tuple[tuple[Gauge, Mapping[Any, float]], ...] = (
            (self._jobs, jobs.states),
            (self._outcomes, jobs.outcomes),
            (self._missions, missions.states),
            (self._waiting, jobs.waiting),
            (self._open, missions.owners),
            (self._left, left_s),
        )
        for gauge, counts in by_label:
            gauge.clear()  # drop owners who no longer have any
            for label, count in counts.items():
                gauge.labels(label).set(count)
        self._backlog.set(missions.backlog)
        self._slots.set(jobs.slots)
        self._slots_used.set(jobs.slots_in_use)
        self._streams.set(streams)
        self._stored.set(sizes.stored)
        self._disk.set(sizes.on_disk)
        return generate_latest(self._registry)

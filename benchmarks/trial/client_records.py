"""What a service has acknowledged to its clients, and a final check that nothing of it was lost."""

from __future__ import annotations

import json
import random
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import cycle, islice, pairwise
from typing import Any

from support.services.plain_client import ACCEPTED, BUSY, Frame, Reply, ask, frames

from benchmarks.trial.tasks import read_situation, scored
from marsupial.model.objective import Value
from marsupial.model.situation import Situation

FINAL = ("succeeded", "failed", "cancelled")
GIVEN_UP = "given up after"
_PAGE = 200
_POLL_S = 0.1


@dataclass(slots=True)
class ClientRecords:
    """What clients received, recorded by several threads.

    Attributes
    ----------
    jobs
        Ids of acknowledged jobs by the key of their request.
    ends
        The first final state, outcome and time of each job that any client received.
    plans
        The makespan of every improvement that any client received, in ms, by job and revision.
    missions
        Ids of acknowledged missions.
    streams
        The events received by clients that followed a job or mission through all breaks, by the stream's path.
    resumed
        How often a stream was resumed, and how often with another server than before.
    made_twice, ended_again
        Keys that got a second job, and jobs that ended a second time.
    odd
        Unexpected answers.
    """

    jobs: dict[str, str] = field(default_factory=dict)
    ends: dict[str, tuple[str, str, str]] = field(default_factory=dict)
    plans: dict[tuple[str, int], int] = field(default_factory=dict)
    missions: list[str] = field(default_factory=list)
    streams: dict[str, list[Frame]] = field(default_factory=dict)
    resumed: Counter[str] = field(default_factory=Counter)
    made_twice: int = 0
    ended_again: int = 0
    odd: Counter[str] = field(default_factory=Counter)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def acknowledge(self, key: str, answer: Reply) -> None:
        """Record the answer to a request for a job."""
        if self._is_done(answer, "a job"):
            job = answer.document["id"]
            with self.lock:
                self.made_twice += self.jobs.setdefault(key, job) != job
            self.see(answer.document)

    def look(self, answer: Reply, what: str) -> None:
        """Record the answer to another request for `what`, which is answered with a job."""
        if self._is_done(answer, what):
            self.see(answer.document)

    def _is_done(self, answer: Reply, what: str) -> bool:
        """Return whether a request was granted; otherwise it may only have been deferred."""
        if answer.status not in (*BUSY, *ACCEPTED):
            self.note_odd(f"status {answer.status} for {what}")
        return answer.status in ACCEPTED

    def see(self, document: Any) -> None:
        """Record a job document: its best plan must not get lost, and a finished job must not change."""
        best = document.get("best")
        if best is not None:
            self.see_plan(document["id"], best)
        if document["state"] not in FINAL:
            return
        with self.lock:
            self.ended_again += self.ends.setdefault(document["id"], _end(document)) != _end(document)

    def see_plan(self, job: str, plan: Any) -> None:
        """Record a revision of a job's plan."""
        with self.lock:
            self.plans[job, plan["revision"]] = plan["makespan_ms"]

    def note_odd(self, what: str) -> None:
        """Count an unexpected answer."""
        with self.lock:
            self.odd[what] += 1

    def any_job(self, draw: random.Random) -> str | None:
        """Return the id of some acknowledged job."""
        with self.lock:
            known = list(self.jobs.values())
        return draw.choice(known) if known else None

    def any_stream(self, draw: random.Random) -> str | None:
        """Return the path of the events of some job or of the last mission."""
        job = self.any_job(draw)
        paths = [f"/v1/jobs/{job}/events"] if job is not None else []
        paths += [f"/v1/missions/{mission}/events" for mission in self.missions[-1:]]
        return draw.choice(paths) if paths else None


@dataclass(slots=True)
class Findings:
    """The counts of each finding after all jobs ended."""

    lost: int = 0
    unfinished: int = 0
    made_twice: int = 0
    ended_again: int = 0
    bad_events: int = 0
    bad_plans: int = 0
    not_better: int = 0
    streams_differ: int = 0
    plans: int = 0
    plans_lost: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)


def audit(ports: Sequence[int], records: ClientRecords, within_s: float) -> Findings:
    """Wait at most `within_s` until every acknowledged job has ended, and check all of them through any server."""
    found = Findings(ended_again=records.ended_again, made_twice=records.made_twice)
    until = time.monotonic() + within_s
    known = set(records.jobs.values())
    for job, port in zip(known, cycle(ports), strict=False):
        _audit_job(port, job, records, until, found)
    for path, told in records.streams.items():
        found.streams_differ += any(told != list(islice(frames(port, path), len(told))) for port in ports)
    for port in ports:
        found.made_twice += len(set(_all_ids(port)) - known)
    return found


def _audit_job(port: int, job: str, records: ClientRecords, until: float, found: Findings) -> None:
    document = _final(port, job, until)
    if document is None:
        found.lost += 1
        return
    if document["state"] not in FINAL:
        found.unfinished += 1
        return
    found.ended_again += records.ends.get(job, _end(document)) != _end(document)
    found.outcomes[_how(document)] += 1
    events = list(frames(port, f"/v1/jobs/{job}/events"))
    found.bad_events += not in_order(events, document)
    found.plans_lost += _lost_plans(job, events, records)
    if document["plans"]:
        situation = read_situation(ask(port, "GET", f"/v1/jobs/{job}/situation").document["situation"])
        scores = list(_scores(situation, events))
        found.plans += len(scores)
        found.bad_plans += sum(one is None for one in scores)
        found.not_better += not improving(scores)


def _lost_plans(job: str, events: Sequence[Frame], records: ClientRecords) -> int:
    """Return the number of improvements received by any client that are now missing or different."""
    kept = {plan["revision"]: plan["makespan_ms"] for plan in map(_read, events) if "revision" in plan}
    told = {revision: makespan for (of, revision), makespan in records.plans.items() if of == job}
    return sum(kept.get(revision) != makespan for revision, makespan in told.items())


def _read(event: Frame) -> Any:
    return json.loads(event.data)


def _end(document: Any) -> tuple[str, str, str]:
    return document["state"], document["outcome"], document["finished_at"]


def _how(document: Any) -> str:
    """Return how a job ended; `GIVEN_UP` if its processes were killed at every attempt."""
    return "given up" if document["detail"].startswith(GIVEN_UP) else document["outcome"]


def _final(port: int, job: str, until: float) -> Any:
    """Return the document of a job once it has ended or time is up; None if there is no such job."""
    while True:
        answer = ask(port, "GET", f"/v1/jobs/{job}")
        if answer.status != 200:
            return None
        if answer.document["state"] in FINAL or time.monotonic() > until:
            return answer.document
        time.sleep(_POLL_S)


def in_order(events: list[Frame], document: Any) -> bool:
    """Return whether events are numbered from 1, end once, as the job does, and report the revisions in order."""
    ends = [event for event in events if event.type == "end"]
    revisions = [json.loads(event.data)["revision"] for event in events if event.type == "plan"]
    return (
        [event.id for event in events] == list(range(1, len(events) + 1))
        and len(ends) == 1
        and events[-1] is ends[0]
        and json.loads(ends[0].data)["outcome"] == document["outcome"]
        and revisions == list(range(1, document["plans"] + 1))
    )


def _scores(situation: Situation, events: Iterable[Frame]) -> Iterator[Value | None]:
    for event in events:
        if event.type == "plan":
            yield scored(situation, json.loads(event.data)["actions"])


def improving(scores: Iterable[Value | None]) -> bool:
    """Return whether each score is better than the one before; plans without a score are left out."""
    return all(later < earlier for earlier, later in pairwise(one for one in scores if one is not None))


def _all_ids(port: int) -> Iterator[str]:
    following: str | None = f"/v1/jobs?limit={_PAGE}"
    while following:
        page = ask(port, "GET", following).document
        yield from (job["id"] for job in page["jobs"])
        following = page["next"]

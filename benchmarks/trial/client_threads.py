"""Clients that send, query, cancel and follow jobs, and follow missions, whether a server runs or not.

Each talks to any of the servers, and to another one if that one is dead.
"""

from __future__ import annotations

import json
import random
import threading
import time
import uuid
from collections.abc import Callable, Sequence

from support.services.plain_client import ACCEPTED, BROKEN, BUSY, Frame, PlainClient, Refusal, Reply, frames

from benchmarks.trial.client_records import ClientRecords
from benchmarks.trial.tasks import short_jobs

SENDERS, FOLLOWERS = 2, 6
_PAUSE_S = 0.05
_SENDER_S = 0.4
"""Senders pause this long, so that most jobs start soon and can be followed."""

_CANCELLED = 0.1
_END_S = 600.0


class ClientThreads:
    """Client threads that run until `stop`; `ports` are those of the servers."""

    def __init__(self, ports: Sequence[int], records: ClientRecords, draw: random.Random) -> None:
        self.records = records
        self._ports = ports
        self._draw = draw
        self._over = threading.Event()
        acts = [self._send] * SENDERS + [self._look] + [self._follow] * FOLLOWERS
        self._threads = [threading.Thread(target=self._repeat, args=(act,), daemon=True) for act in acts]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Let the threads finish their current action, then end."""
        self._over.set()
        for thread in self._threads:
            thread.join(_END_S)

    def _repeat(self, act: Callable[[], None]) -> None:
        while not self._over.is_set():
            try:
                act()
            except Exception as error:
                self.records.note_odd(f"client failed: {error!r}")

    def _ask(self, method: str, path: str, body: object = None, key: str | None = None) -> Reply | None:
        """Send a request to any server once; return None if it does not answer."""
        time.sleep(_PAUSE_S)
        client = PlainClient(self._draw.choice(self._ports))
        try:
            answer = client.ask(method, path, body, {} if key is None else {"Idempotency-Key": key})
        except BROKEN:
            return None
        finally:
            client.close()
        if answer.status in BUSY and client.retry_after is None:
            self.records.note_odd(f"status {answer.status} without Retry-After")
        return answer

    def _send(self) -> None:
        """Send a job repeatedly until it is acknowledged; sometimes cancel it."""
        time.sleep(_SENDER_S)
        key, body = uuid.uuid4().hex, self._draw.choice(short_jobs())
        while not self._over.is_set():
            answer = self._ask("POST", "/v1/jobs", body, key)
            if answer is None:
                continue
            self.records.acknowledge(key, answer)
            if answer.status in ACCEPTED and self._draw.random() < _CANCELLED:
                cancelled = self._ask("POST", f"/v1/jobs/{answer.document['id']}/cancel")
                if cancelled is not None:
                    self.records.look(cancelled, "a cancellation")
            if answer.status not in BUSY:
                break

    def _look(self) -> None:
        """Query some job."""
        job = self.records.any_job(self._draw)
        if job is None:
            time.sleep(_PAUSE_S)
            return
        answer = self._ask("GET", f"/v1/jobs/{job}")
        if answer is not None:
            self.records.look(answer, "a look at a job")

    def _follow(self) -> None:
        """Follow some job or mission to its end, reconnecting after breaks."""
        path = self.records.any_stream(self._draw)
        if path is None or path in self.records.streams:
            time.sleep(_PAUSE_S)
            return
        told = self.records.streams.setdefault(path, [])
        last = None
        while not self._over.is_set() and not (told and told[-1].type == "end"):
            port = self._draw.choice(self._ports)
            before = len(told)
            self._listen(port, path, told)
            if len(told) > before and before:
                self.records.resumed["in all"] += 1
                self.records.resumed["elsewhere"] += last not in (None, port)
            last = port if len(told) > before else last
            time.sleep(_PAUSE_S)

    def _listen(self, port: int, path: str, told: list[Frame]) -> None:
        """Resume a stream where it broke, and add its events until it breaks again."""
        _, _, kind, entry, _ = path.split("/")
        try:
            for frame in frames(port, path, after=len(told)):
                told.append(frame)
                if kind == "jobs" and frame.type == "plan":
                    self.records.see_plan(entry, json.loads(frame.data))
                if self._over.is_set():
                    return
        except Refusal as refusal:
            if refusal.status not in (*BUSY, 204):
                self.records.note_odd(f"status {refusal.status} for a stream")
        except BROKEN:
            pass

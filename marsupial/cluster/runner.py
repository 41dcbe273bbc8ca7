"""A runner whose jobs run on a cluster: it maintains a gateway, and assigns the room that the gateway finds."""

import json
import pickle
import threading
import time
from collections.abc import Callable

from marsupial.cluster import gateway
from marsupial.cluster.ray_cluster import Cluster
from marsupial.cluster.versions import OURS
from marsupial.errors import InternalError
from marsupial.processes import channel as frames
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import Job
from marsupial.processes.launcher import JobRun, Launcher, Preload, call, order_of
from marsupial.processes.runner import Reservation

_START_S = 120.0
"""Wall-clock time within which a gateway must connect, on a busy machine too."""

_ANSWER_S = 15.0
_RETRY_S = 2.0
_POLL_S = 0.2
_LOST = "the connection to the cluster was lost"


class ClusterRunner:
    """Runs jobs on a usable cluster (`ray_cluster.usable`), to which it connects at the first `warm_up`.

    While the cluster is unusable, requests for room wait; active runs end as killed. `packages` of ours must be the
    same on all nodes; `warn` receives a message when the cluster can't be used, with Ray's reason.
    """

    def __init__(
        self, cluster: Cluster, packages: tuple[str, ...] = OURS, warn: Callable[[str], None] = lambda text: None
    ) -> None:
        self._arguments = (cluster.address, *packages)
        self._warn = warn
        self._preload: dict[bytes, None] = {}
        self._gateway: Launcher | None = None
        self._fault: tuple[str, str] | None = ("the cluster is not connected yet", "")
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._maintaining = threading.Thread(target=self._maintain_gateway, name="cluster", daemon=True)

    @property
    def ended(self) -> bool:
        """Whether it was shut down."""
        return self._ended.is_set()

    def warm_up(self, preload: tuple[Preload, ...] = (), *, wait: bool = False) -> None:
        # a node accepts no jobs before it has loaded their libraries, so there is nothing to wait for
        with self._lock:
            self._preload.update(dict.fromkeys(pickle.dumps(call(one)) for one in preload))
            if self._maintaining.ident is None:
                self._maintaining.start()
        self._send_preload()

    def reserve(self, cpus: float = 1.0) -> Reservation:
        return _NodeReservation(self, cpus)

    def fault(self) -> str | None:
        # in our own words, without addresses or files
        return None if self._fault is None else self._fault[0]

    def shutdown(self) -> None:
        self._ended.set()
        found, self._gateway = self._gateway, None
        if found is not None:
            found.close()
        if self._maintaining.is_alive():
            self._maintaining.join(_POLL_S)

    def ask(self, request: bytes, order: object) -> Channel | None:
        """Send a request to the gateway, if there is one; if it dies, the channel is closed."""
        found = self._gateway
        return None if found is None or self.ended else found.ask(request, order)

    def _send_preload(self) -> None:
        channel = self.ask(gateway.PRELOAD, list(self._preload))
        if channel is not None:
            channel.close()

    def _maintain_gateway(self) -> None:
        """Keep a gateway running, restarting it when lost."""
        while not self.ended:
            try:
                self._run_gateway()
            except Exception as error:  # it can't even be started: no memory, no more processes or files
                self._set_fault(_LOST, str(error))
            self._ended.wait(_RETRY_S)

    def _run_gateway(self) -> None:
        """Start a gateway, and ask for its state until it is lost."""
        found = self._gateway = Launcher(gateway.__name__, *self._arguments)
        try:
            self._send_preload()
            patience_s = _START_S
            while found.usable() and self._poll_state(patience_s) and not self._ended.wait(_POLL_S):
                patience_s = _ANSWER_S
            if not self.ended:
                words = found.last_output().strip().rpartition("\n")[2]
                self._set_fault(_LOST, "it does not answer" if found.usable() else words)
        finally:
            self._gateway = None
            found.close()

    def _poll_state(self, patience_s: float) -> bool:
        """Ask the gateway for its state; return whether it answers."""
        channel = self.ask(gateway.STATE, None)
        if channel is None:
            return False
        try:
            frame = channel.receive_frame(patience_s)
        except TimeoutError:
            frame = None
        finally:
            channel.close()
        if frame is None:
            return False
        found = json.loads(frame[1])
        if found is None:
            self._fault = None
        else:
            self._set_fault(*found)
        return True

    def _set_fault(self, fault: str, reason: str) -> None:
        """Record that the cluster is unusable; warn once."""
        if self._fault != (fault, reason):
            self._warn(f"{fault}: {reason}" if reason else fault)
        self._fault = (fault, reason)


class _NodeReservation:
    """Room on some node, requested again whenever the gateway is lost during the wait."""

    def __init__(self, runner: ClusterRunner, cpus: float) -> None:
        self._runner = runner
        self._cpus = cpus
        self._channel: Channel | None = None
        self._lock = threading.Lock()
        self._closed = False

    def wait(self) -> bool:
        while not (self._closed or self._runner.ended):
            channel = self._runner.ask(gateway.ROOM, self._cpus)
            if channel is not None:
                if self._granted(channel):
                    return True
                channel.close()
            time.sleep(_POLL_S)
        return False

    def _granted(self, channel: Channel) -> bool:
        while not self._closed:
            try:
                if channel.receive_frame(_POLL_S) is None:
                    return False
            except TimeoutError:
                continue
            with self._lock:
                self._channel = channel
                return not self._closed
        return False

    def run(self, job: Job) -> JobRun:
        with self._lock:
            channel, self._channel = self._channel, None
        if channel is None:
            raise InternalError("its reservation was released")
        channel.send_frame(frames.START, pickle.dumps(order_of(job)))
        channel.receive_frame()
        return JobRun(channel, job.limits, kill=lambda: None)

    def close(self) -> None:
        with self._lock:
            self._closed = True
            if self._channel is not None:
                self._channel.close()
                self._channel = None

"""Tasks that wait, crash, daemonise or allocate memory in the worker. Workers can import this module."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from support.planning.situations import job_source, one_room

from marsupial.errors import Problem, SituationError
from marsupial.model.situation import Situation
from marsupial_service.jobs import attempt, work
from marsupial_service.jobs.records import WorkerTask


@dataclass(frozen=True)
class Ordinary:
    """Finishes at once."""

    def situation(self) -> Situation:
        return one_room()

    def places(self) -> dict[str, object]:
        return {"t1": {"rover": [3, 4]}}


@dataclass(frozen=True)
class Waits(Ordinary):
    """Writes its process id to `folder`/pid and waits until there is a file `folder`/go."""

    folder: Path

    def situation(self) -> Situation:
        tell_pid(self.folder)
        while not (self.folder / "go").exists():
            time.sleep(0.01)
        return one_room()


@dataclass(frozen=True)
class Escapes(Ordinary):
    """Starts a grandchild in its own session that ignores TERM and writes its process id, and sleeps."""

    folder: Path

    def situation(self) -> Situation:
        code = (
            "import os, signal, sys, time\n"
            "if os.fork(): os._exit(0)\n"
            "os.setsid(); signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
            "open(sys.argv[1] + '/part', 'w').write(str(os.getpid()))\n"
            "os.rename(sys.argv[1] + '/part', sys.argv[1] + '/pid'); time.sleep(3600)\n"
        )
        subprocess.run([sys.executable, "-S", "-c", code, str(self.folder)], check=True)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(3600)
        return one_room()


@dataclass(frozen=True)
class Paralyses(Ordinary):
    """Stops its supervisor (SIGSTOP), writes its own process id, and sleeps."""

    folder: Path

    def situation(self) -> Situation:
        os.kill(os.getppid(), signal.SIGSTOP)
        tell_pid(self.folder)
        time.sleep(3600)
        return one_room()


@dataclass(frozen=True)
class Dies(Ordinary):
    """Kills itself in the first `times` attempts, which it counts in `folder`."""

    folder: Path
    times: int

    def situation(self) -> Situation:
        tried = len(list(self.folder.glob("try*")))
        (self.folder / f"try{tried}").touch()
        if tried < self.times:
            os.kill(os.getpid(), signal.SIGKILL)
        return one_room()


@dataclass(frozen=True)
class Wrong(Ordinary):
    def situation(self) -> Situation:
        raise SituationError([Problem("robots[0].place", "is on an obstacle"), Problem("robots[1].type", "unknown")])


@dataclass(frozen=True)
class Crashes(Ordinary):
    def situation(self) -> Situation:
        raise ValueError("boiler pressure")


@dataclass(frozen=True)
class Hungry(Ordinary):
    def situation(self) -> Situation:
        blocks = []
        while True:
            blocks.append(b"x" * (4 << 20))
            time.sleep(0.005)


def source_of(task: Situation | Ordinary) -> dict[str, object]:
    """Return a request for a task; workers can read it if `install_misbehaving_tasks` was called in their parent."""
    if isinstance(task, Situation):
        return job_source(task)
    return {"strange": pickle.dumps(task).hex()}


def solve(asked: WorkerTask) -> Iterator[object]:
    """Run a misbehaving task, or any other task."""
    source = json.loads(zlib.decompress(asked.source))
    if "strange" in source:
        work.task_in = lambda *_: pickle.loads(bytes.fromhex(source["strange"]))  # type: ignore[assignment]
    yield from work.solve(asked)


def install_misbehaving_tasks() -> None:
    """Let the workers that this process starts run misbehaving tasks."""
    attempt.solve = solve  # type: ignore[assignment]


def tell_pid(folder: Path) -> None:
    (folder / "part").write_text(str(os.getpid()))
    (folder / "part").rename(folder / "pid")


async def pid_in(folder: Path) -> int:
    """Return the process id that a task wrote, once it has."""
    from support.waiting import wait_until_async

    await wait_until_async((folder / "pid").exists, folder / "pid")
    return int((folder / "pid").read_text())

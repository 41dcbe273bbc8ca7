"""Any PDDL 2.1 planner as an engine: a command line with places for the files, `cmd:optic-clp {domain} {problem}`.

The command runs in a child process without a shell, in a private folder that holds the canonical domain and the
problem. Its plans are taken from what it prints and the files it writes there (`marsupial.planning.external.output`),
as they come. At the end of its time it gets SIGTERM, its output is read to the end, and it is killed.
"""

import os
import re
import selectors
import shlex
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from marsupial.errors import UsageError
from marsupial.formats.pddl.text import domain_of, domain_text, problem_text
from marsupial.model import EngineInfo, Finished, Outcome, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.external.encodings import SearchRequest
from marsupial.planning.external.output import PLAN_PREFIX, TAIL_BYTES, PlanFiles, PlanReader, Printed, last_words
from marsupial.planning.external.process_engine import ProcessEngine
from marsupial.processes.jobs import GIB, Job, JobLimits, ending_of, exit_text

PREFIX = "cmd:"  # prefix of these engines' names; the rest is the command line
BATTERIES = "{problem_batteries}"  # the place for a problem with batteries
GRACE_S = 0.2  # time between TERM and KILL for a planner at the end of its budget; a tenth of a budget below 2 s

_SLACK_S = 0.5  # beyond its own time limit, before the supervisor ends a planner that ignores it
_POLL_S = 0.02
_CHUNK = 1 << 16


class External(ProcessEngine):
    """The engine called `name`, which is `PREFIX` and a command line with places for {domain} and {problem}.

    A place may be part of an argument. {plan}, if present, becomes the prefix of plan files' names. With
    {problem_batteries} instead of {problem} the planner gets the batteries too, if there are any.

    Raise `UsageError` if the command line can't be split, or a place is missing.
    """

    def __init__(self, name: str, *, memory_bytes: int = 2 * GIB) -> None:
        program, *self._arguments = split_command(name.removeprefix(PREFIX))
        self.knows_batteries = any(BATTERIES in word for word in self._arguments)
        info = EngineInfo(name=name, summary="external planner", licence="its own", anytime=True)
        super().__init__(info, search, (), memory_bytes=memory_bytes)
        found = shutil.which(program)
        if found is None and self.info.missing is None:
            self.info = replace(self.info, missing=f"there is no executable {program!r}")
        self._program = program if found is None else os.path.abspath(found)

    def job(self, request: SearchRequest) -> Job:
        """Return the job that runs the command; it keeps its time limit itself, its supervisor only if it fails to."""
        limits = JobLimits(
            wall_s=request.seconds + _SLACK_S,
            memory_bytes=self._memory_bytes,
            cpu_s=(request.seconds + _SLACK_S) * (os.cpu_count() or 1),
        )
        run = CommandRun(words=(self._program, *self._arguments), request=request)
        return Job(function=search, argument=run, limits=limits)


def split_command(command: str) -> tuple[str, ...]:
    """Return the words of a command line, split as a shell does; raise a `UsageError` without {domain} or {problem}."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise UsageError(f"planner {PREFIX}{command}: {str(error).lower()}") from None
    given = [word.replace(BATTERIES, "{problem}") for word in words]
    missing = [place for place in ("{domain}", "{problem}") if not any(place in word for word in given)]
    if missing:
        example = f"{PREFIX}optic-clp {{domain}} {{problem}}"
        raise UsageError(f"planner {PREFIX}{command}: {' and '.join(missing)} is missing, as in '{example}'")
    return tuple(words)


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRun:
    """The child process's input: the command's words with unfilled places, and the request."""

    words: tuple[str, ...]
    request: SearchRequest


def search(run: CommandRun) -> Iterator[Plan | Finished]:
    """Run the planner in a child process; yield its plans, each better than the last, then how it ended."""
    request = run.request
    grace_s = min(GRACE_S, request.seconds / 10)
    until = time.monotonic() + request.seconds - grace_s
    folder = Path(tempfile.mkdtemp(prefix="pddl-"))
    (folder / "domain.pddl").write_text(domain_text(domain_of(request.situation)), encoding="utf-8")
    (folder / "problem.pddl").write_text(problem_text(request.situation, records=False), encoding="utf-8")
    printed, files = Printed(), PlanFiles(folder)
    reader = PlanReader(request.situation, request.start)
    try:
        child = _Child(fill(run.words, folder), folder, until, grace_s)
    except OSError as error:
        yield Finished(outcome=Outcome.CRASHED, detail=f"{run.words[0]} can't be run: {error.strerror}")
        return
    try:
        for chunk in child.chunks():
            yield from reader.better(printed.feed(chunk), complete=True)
            yield from reader.better([*printed.growing(chunk), *files.changed()], complete=False)
        yield from reader.better([*printed.rest(), *files.all()], complete=True)
        outcome, reason = _outcome(child, printed, reader, request.situation)
        yield Finished(outcome=outcome, detail=f"{reason}; {reader.summary}")
    finally:
        child.end()


def fill(words: Iterable[str], folder: Path) -> list[str]:
    """Return the words of a command with its places filled with files in `folder`."""
    places = {
        "{domain}": str(folder / "domain.pddl"),
        "{problem}": str(folder / "problem.pddl"),
        BATTERIES: str(folder / "problem.pddl"),
        "{plan}": str(folder / PLAN_PREFIX),
    }
    place = re.compile("|".join(map(re.escape, places)))
    return [place.sub(lambda match: places[match[0]], word) for word in words]


class _Child:
    """The planner's process in a session of its own, terminated at `until`; the end of its stderr is kept."""

    def __init__(self, words: list[str], folder: Path, until: float, grace_s: float) -> None:
        self.stopped = False
        self.errors = b""
        self._until = until
        self._kill_at = until + grace_s
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            words, cwd=folder, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, start_new_session=True
        )
        self._selector = selectors.DefaultSelector()
        for stream in (self._process.stdout, self._process.stderr):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)
            self._selector.register(stream, selectors.EVENT_READ)

    @property
    def returncode(self) -> int:
        """The return code of `subprocess`, once `chunks` has ended."""
        return self._process.wait()

    def chunks(self) -> Iterator[bytes]:
        """Yield its output until it ends, and an empty chunk whenever it pauses."""
        while self._process.poll() is None:
            self._judge_time()
            yield self._read(_POLL_S)
        # An orphaned process may hold the pipes open: do not wait for their end.
        while self._selector.get_map() and self._selector.select(0) and time.monotonic() < self._kill_at:
            yield self._read(0)

    def _read(self, wait_s: float) -> bytes:
        printed = b""
        for key, _ in self._selector.select(wait_s):
            data = os.read(key.fd, _CHUNK)
            if not data:
                self._selector.unregister(key.fileobj)
            elif key.fileobj is self._process.stdout:
                printed = data
            else:
                self.errors = (self.errors + data)[-TAIL_BYTES:]
        return printed

    def _judge_time(self) -> None:
        now = time.monotonic()
        if now >= self._kill_at:
            self.stopped = True
            self._signal(signal.SIGKILL)
        elif now >= self._until and not self.stopped:
            self.stopped = True
            self._signal(signal.SIGTERM)

    def end(self) -> None:
        """Kill it if it is running; the job's supervisor ends its descendants."""
        self._selector.close()
        self._signal(signal.SIGKILL)
        with self._process:
            self._process.wait()

    def _signal(self, signum: signal.Signals) -> None:
        if self._process.poll() is None:
            os.killpg(self._process.pid, signum)


def _outcome(child: _Child, printed: Printed, reader: PlanReader, situation: Situation) -> tuple[Outcome, str]:
    code = child.returncode
    words = "" if reader.accepted else last_words(child.errors, printed.tail)
    if child.stopped:
        return Outcome.TIMEOUT, f"stopped at the end of its time{words}"
    how = f"it {exit_text(code)}"
    ended = Outcome(ending_of(code, child.errors.decode(errors="replace")).value)
    if code < 0:
        return ended, how + last_words(child.errors, printed.tail)
    if reader.accepted:
        return Outcome.SATISFICING, how
    if printed.claim is not None and not reader.faults:
        if situation.batteries:
            return Outcome.NO_PLAN, f"it says {printed.claim!r}, no proof: batteries are approximate in PDDL"
        if reader.incumbent.plan is not None or _can_be_solved(situation):
            return Outcome.NO_PLAN, f"it says {printed.claim!r}, which is not so: marsupial has a plan"
        return Outcome.UNSOLVABLE, f"it says {printed.claim!r}"
    return ended if code > 0 else Outcome.NO_PLAN, how + words


def _can_be_solved(situation: Situation) -> bool:
    """Return whether a plan exists: planners also report problems as unsolvable that they can't handle."""
    from marsupial.planning.greedy import serve  # imports numba

    plan, _ = serve(situation)
    return check(situation, plan).valid

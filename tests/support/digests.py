"""Digests of the program's output, to prove that a refactoring changes no behaviour.

Missions, plans, exports, comparisons and the service's answers depend on nothing but their input where the
budget is in steps. Each is made anew here, through the command line and over HTTP only, stripped of wall-clock times,
paths and random names, and its sha256 is compared with the one kept in `digests.json`.
`python -m tests.support.digests` says what differs, `--write` stores the current digests; `--only PATTERN` selects
cases by name.
"""

import argparse
import hashlib
import http.client
import io
import itertools
import json
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.cli.main import main
from marsupial.formats.situation import situation_to_json

ROOT = Path(__file__).resolve().parents[2]
KEPT = Path(__file__).with_suffix(".json")
MAPS = ROOT.parent / "shared" / "maps"
"""Optional folder of real maps beside the checkout."""

Outputs = Iterator[tuple[str, str]]
"""The output of a case: name and text of each part."""

CLOCKED = {"wall_s", "planning_s", "analysis_s", "elapsed_s", "log", "output"}
"""Fields of `--json` that hold wall-clock times or paths."""

PASSING = {"id", "links", "instance", "found_after_ms", "found_at", "attempts"} | {
    f"{what}_at" for what in ("created", "queued", "started", "first_plan", "finished")
}
"""Fields of the service's answers that differ between jobs."""

GOOD_ENDS = (0, 2, 3, 4, 5, 6)
"""Exit codes that are results, not bugs."""


@dataclass(frozen=True, slots=True)
class Case:
    """A case whose output must not change; `work` is called with a new folder and `arguments`."""

    name: str
    work: Callable[..., Outputs]
    arguments: tuple[Any, ...] = ()


# What is run: missions


SCENARIOS = ("office", "maze", "rooms", "random", "cave", "lobby")

CONTENDERS = (
    ("temporal", "greedy", 8),
    ("temporal", "anytime", 4),
    ("temporal", "auto", 4),
    ("heuristic", None, None),
    ("heuristic-plus", None, None),
    ("assignment", None, None),
    ("clairvoyant", None, 6),
)
"""Strategy, planner, steps of each planning."""

TEAMS = ("2x1", "1x2", "2x2", "1x1", "3x1")

FURTHER = (
    "lobby --planner exact --steps 20 --carriers 1 --rovers 2",
    "cave --planner anytime --steps 40 --carriers 5 --rovers 2 --time-limit 40 --seed 6",
    "lobby --planner exact --steps 20 --carriers 2 --rovers 1 --seed 4",
    "lobby --planner anytime --steps 8 --carriers 4 --rovers 2 --seed 2",
    "lobby --strategy heuristic --carriers 1 --rovers 0",
    "rooms --planner greedy --steps 6 --carriers 6 --rovers 3 --time-limit 60",
    "maze --planner auto --steps 4 --carriers 4 --rovers 3 --time-limit 60 --seed 2",
    "yard.json --planner auto --steps 6",
    "yard.json --strategy heuristic",
    "yard.json --strategy clairvoyant --steps 6",
    "yard.json --planner anytime --steps 4 --carriers 2 --rovers 1 --seed 5",
    "hall.yaml --planner anytime --steps 6 --carriers 1 --rovers 1 --seed 2",
    "hall.yaml --strategy assignment --carriers 2 --rovers 1",
    "court.map --planner auto --steps 4 --carriers 1 --rovers 2",
    "court.map --strategy heuristic --seed 3",
    "generated.json --planner auto --steps 4",
    "lobby --strategy segmentation --carriers 3 --rovers 0",
    "lobby --strategy temporal --planner greedy --steps 4 --carriers 3 --rovers 2 --interference --seed 2",
    "lobby --strategy heuristic-plus --routes energy --seed 3",
)
"""`marsupial run` with other teams, planners, clocks and files of the folder that `write_inputs` fills."""

CHARGED = (
    "rooms --planner anytime --steps 4 --planning-time charged --carriers 1 --rovers 1",
    "lobby --strategy heuristic-plus --planning-time charged --seed 3",
    "yard.json --planner greedy --steps 4 --planning-time charged",
)
"""The same with charged planning time, on a clock that counts its reads."""

COUNTING_CLOCK = """
import sys, time
reads = 0
def clock():
    global reads
    reads += sys._getframe(1).f_globals.get("__name__", "").startswith("marsupial")
    return 0.2 * reads
time.perf_counter = clock
from {module} import main
sys.exit(main(sys.argv[1:]))
"""
"""Runs the program with such a clock, which ignores reads by libraries."""

REAL = (
    "tb3_sandbox.yaml --strategy assignment --carriers 1 --rovers 1 --time-limit 60",
    "movingai/arena.map --planner greedy --steps 4 --carriers 2 --rovers 1 --time-limit 60",
)
"""The same on real maps."""

VIEWED = 5
"""One in this many missions is exported at some moments too."""

COMPARISON = (
    "lobby rooms --strategies temporal:greedy,heuristic-plus,heuristic --carriers 1-2 --rovers 1 --runs 2 --steps 4"
)

PLANNINGS = {"greedy": 50, "anytime": 500, "auto": 30, "exact": 300}
"""Planners of the suite, with their steps."""

SMALL = ("rooms-1x1-3", "rooms-1x2-5", "pressure-1x1-3", "homes-1x2-5", "mission-lobby-1x2-5", "two-doors-2x1-6")
"""Instances for the exact planner too."""

YARD = (
    "####################",
    "#........#~~~~~~~~~#",
    "#........#~~~~~~~~~#",
    "#........~~~~~~~~~~#",
    "#........#mmmmm~~~~#",
    "#........#mmmmm~~~~#",
    "#........####mm#####",
    "#..................#",
    "#..................#",
    "#..................#",
    "####################",
)
CARRIER = {"name": "carrier", "role": "carrier", "speed_mps": 1.0, "sensor_range_m": 3.0, "radius_m": 0.4}
ROVER = {"name": "rover", "role": "rover", "speed_mps": 0.5, "sensor_range_m": 2.0, "radius_m": 0.1}
TYPES = (
    {**CARRIER, "terrains": ["floor"], "capacity": 2, "energy": {"idle_w": 20.0, "drive_w": 60.0}},
    {**ROVER, "terrains": ["floor", "rough", "mud"], "dock_s": 10.0, "undock_s": 5.0},
)
SCENARIO_HEAD = {"format": "marsupial-scenario", "version": 1, "robot_types": TYPES, "terrains": [{"name": "mud"}]}


def write_inputs(folder: Path) -> None:
    """Write scenario files and small maps in every format."""
    team = [{"name": "mother", "type": "carrier", "start": [1.75, 1.25]}]
    team += [{"name": name, "type": "rover", "carrier": "mother"} for name in ("joey1", "joey2")]
    ground = {"resolution_m": 0.5, "legend": {"m": "mud"}, "rows": YARD}
    yard = {**SCENARIO_HEAD, "name": "yard", "map": ground, "team": team, "goal": {"return_home": True}}
    (folder / "yard.json").write_text(json.dumps(yard))
    drawn = {"generator": "cave", "width_m": 20, "height_m": 16, "seed": 3}
    count = {"carriers": 2, "rovers_per_carrier": 2}
    generated = {**SCENARIO_HEAD, "name": "generated", "map": drawn, "team": count, "start_seed": 7}
    (folder / "generated.json").write_text(json.dumps(generated))
    fine = ["".join(mark * 4 for mark in row) for row in YARD for _ in range(4)]
    greys = "\n".join(" ".join({"#": "0", "m": "205"}.get(mark, "254") for mark in row) for row in fine)
    (folder / "hall.pgm").write_text(f"P2\n{len(fine[0])} {len(fine)}\n255\n{greys}\n")
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "hall.yaml").write_text(f"image: hall.pgm\nresolution: 0.2\norigin: [-3.0, -2.0, 0.0]\n{thresholds}")
    marks = "\n".join("".join({"#": "@", "~": ".", "m": "S"}.get(mark, mark) for mark in row) for row in fine)
    (folder / "court.map").write_text(f"type octile\nheight {len(fine)}\nwidth {len(fine[0])}\nmap\n{marks}\n")


def mission_options() -> Iterator[str]:
    """Yield the options of all missions but those on real maps."""
    teams = itertools.cycle(TEAMS)
    for number, (scenario, contender) in enumerate(itertools.product(SCENARIOS, CONTENDERS)):
        strategy, planner, steps = contender
        carriers, rovers = next(teams).split("x")
        options = f"{scenario} --strategy {strategy} --carriers {carriers} --rovers {rovers} --seed {1 + number % 4}"
        options += "" if planner is None else f" --planner {planner}"
        yield options + ("" if steps is None else f" --steps {steps}")
    yield from FURTHER


def mission(folder: Path, options: str, viewed: bool) -> Outputs:
    """Run a mission; return its log and summary and, if `viewed`, its exports."""
    source, *rest = options.split()
    write_inputs(folder)
    given = folder / source
    log = folder / "log.jsonl"
    summary = called_json("run", str(given) if given.exists() else source, *rest, "--json", "--log", str(log))
    yield "log", log.read_text()
    yield "summary", summary
    if viewed:
        yield from views(folder, log)


def charged(folder: Path, options: str) -> Outputs:
    """Run a mission in a new process with a counting clock; return its log."""
    source, *rest = options.split()
    write_inputs(folder)
    given = folder / source
    log = folder / "log.jsonl"
    command = [sys.executable, "-c", COUNTING_CLOCK.format(module=main.__module__), "run"]
    command += [str(given) if given.exists() else source, *rest, "--log", str(log)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode not in GOOD_ENDS:
        raise RuntimeError(ended.stderr)
    yield "log", log.read_text()


def views(folder: Path, log: Path) -> Outputs:
    """Return the exports of two moments of a log, and a plan for the second."""
    plans = [event["t_ms"] for event in map(json.loads, log.read_text().splitlines()) if event["event"] == "plan"]
    moments = {"at a plan": plans[len(plans) // 2], "between plans": (plans[0] + plans[-1]) // 2 + 7}
    for words, t_ms in moments.items():
        out = folder / words
        called("export", str(log), "--at", str(t_ms / 1000), "-o", str(out))
        for name in ("situation.json", "domain.pddl", "problem.pddl"):
            yield f"{name} {words}", (out / name).read_text()
    problem, plan = out / "problem.pddl", folder / "plan.txt"
    options = f"--planner greedy --steps 4 --json --output {plan}"
    yield "plan for the PDDL", called_json("plan", str(problem), *options.split())
    if plan.exists():
        yield "verdict on the plan", called("validate", str(out / "domain.pddl"), str(problem), str(plan))


# What is run: plans, comparisons


def plans(folder: Path, name: str, planner: str, steps: int) -> Outputs:
    """Plan for an instance of the planner suite; return the best plan, all makespans and the bound."""
    file = folder / "situation.json"
    file.write_text(situation_to_json(INSTANCES[name].situation()))
    yield "plan", called_json("plan", str(file), "--planner", planner, "--steps", str(steps), "--json")


def situations(folder: Path) -> Outputs:
    for name, instance in INSTANCES.items():
        yield name, situation_to_json(instance.situation())


def comparison(folder: Path, options: str) -> Outputs:
    out = folder / "out"
    called("compare", *options.split(), "--workers", "1", "--out", str(out))
    for name in ("rows.csv", "coverage.csv"):
        yield name, (out / name).read_text()


# What is run: the service


def service(folder: Path) -> Outputs:
    """Run jobs, an analysis and missions on a service in a new process."""
    with serving(folder / "data") as server:
        yield from jobs(server)
        for options in ("lobby --planner greedy --steps 4", "lobby --strategy heuristic --carriers 1 --rovers 2"):
            yield from steered(server, folder, options)
        for words, changes in (("robots that fail", False), ("robots whose map changes", True)):
            yield from foreign(server, words, changes)


@dataclass(frozen=True, slots=True)
class Server:
    """A service that answers at an address."""

    url: str

    def ask(self, path: str, body: object = None) -> Any:
        """Send a request, a POST if it has a body, and return the answer, parsed if it is JSON."""
        connection = http.client.HTTPConnection(urlsplit(self.url).netloc, timeout=120)
        headers = {} if body is None else {"Content-Type": "application/json", "Prefer": "wait=60"}
        connection.request("GET" if body is None else "POST", path, None if body is None else json.dumps(body), headers)
        answer = connection.getresponse()
        kind, text = answer.headers.get_content_type(), answer.read().decode()
        connection.close()
        return json.loads(text) if kind.endswith("json") else text

    def events(self, path: str) -> Iterator[tuple[str, Any]]:
        """Yield kind and data of a stream's events until it ends."""
        connection = http.client.HTTPConnection(urlsplit(self.url).netloc, timeout=120)
        connection.request("GET", path)
        answer, kind = connection.getresponse(), ""
        while line := answer.readline().decode():
            name, _, value = line.rstrip("\n").partition(": ")
            kind = value if name == "event" else kind
            if name == "data":
                yield kind, json.loads(value)
        connection.close()


@contextmanager
def serving(data: Path) -> Iterator[Server]:
    """Run `marsupial serve` until the end of the block; it is ready to plan."""
    command = [sys.executable, "-m", main.__module__, "serve", "--port", "0", "--data", str(data)]
    with (
        (data.parent / "service.log").open("w+") as log,
        subprocess.Popen([*command, "--log-level", "warning"], stderr=log) as process,
    ):
        try:
            yield ready(process, Path(log.name))
        finally:
            process.terminate()


def ready(process: subprocess.Popen[bytes], log: Path) -> Server:
    """Return a started service once it plans."""
    while not (found := re.search(r"serves at (\S+)", log.read_text())):
        if process.poll() is not None:
            raise RuntimeError(log.read_text())
        time.sleep(0.1)
    server = Server(found[1])
    while server.ask("/readyz").get("status") != "ready":
        time.sleep(0.2)
    return server


def jobs(server: Server) -> Outputs:
    """Return the answers to jobs, analyses and invalid requests."""
    office, yard = server.ask("/v1/demo-data/office-2x2"), server.ask("/v1/demo-data/yard")
    for words, body, planner in (("situation", office, "auto"), ("map", yard, "anytime"), ("map", yard, "exact")):
        name = f"job for a {words} by {planner}"
        job = server.ask("/v1/jobs", {**body, "planner": planner, "budget": {"steps": 6}})
        while job["state"] in ("queued", "running"):
            time.sleep(0.2)
            job = server.ask(job["links"]["self"])
        yield name, text_of(job, PASSING)
        for what in ("plans", "situation"):
            yield f"{what} of the {name}", text_of(server.ask(job["links"][what]), PASSING)
    plan = {"ipc": server.ask(job["links"]["self"])["best"]["ipc"]}
    situation = server.ask(job["links"]["situation"])["situation"]
    yield "validation", text_of(server.ask("/v1/validations", {"situation": situation, "plan": plan}), PASSING)
    yield "analysis", text_of(server.ask("/v1/analysis", {"map_state": yard["map_state"]}), PASSING)
    for words, wrong in (("seconds below 0", {"seconds": -1}), ("part of a step", {"steps": 1.5}), ("no budget", {})):
        yield f"refusal of {words}", text_of(server.ask("/v1/jobs", {**yard, "budget": wrong, "x": 1}), PASSING)


def steered(server: Server, folder: Path, options: str) -> Outputs:
    """Run a simulated mission planned by the service; return the logs of both sides and all commands."""
    log = folder / "log.jsonl"
    yield (
        f"summary of {options}",
        called_json("run", *options.split(), "--json", "--log", str(log), "--server", server.url),
    )
    yield f"log of {options}", log.read_text()
    links = server.ask("/v1/missions")["missions"][0]["links"]
    yield f"log kept of {options}", server.ask(links["log"])
    yield f"commands of {options}", event_lines(server.events(links["events"]))


def foreign(server: Server, words: str, changes: bool) -> Outputs:
    """Run a mission of external robots to its end."""
    robots = Robots(changes=changes)
    links = server.ask("/v1/missions", robots.request())["links"]
    events = []
    for kind, data in server.events(links["events"]):
        events.append((kind, data))
        report = robots.answer(data) if kind == "commands" else None
        if report is not None and "n" not in (answer := server.ask(f"{links['self']}/reports", report)):
            raise RuntimeError(f"report {report} is refused: {answer}")
    yield f"log of {words}", server.ask(links["log"])
    yield f"commands of {words}", event_lines(iter(events))
    yield f"map of {words}", text_of(server.ask(links["map"]), PASSING)


def event_lines(events: Iterator[tuple[str, Any]]) -> str:
    """Return a mission's events as text, without decision times."""
    return "\n".join(f"{kind} {text_of(data)}" for kind, data in events if kind != "decision")


@dataclass(slots=True)
class Robots:
    """Robots that end one command every 3 s, jump where they drive to and see a square; every sixth command fails.

    At the 25th report a rover is lost, or, with `changes`, a box stands in the yard.
    """

    changes: bool
    n: int = 0
    t_ms: int = 0
    ended: int = 0
    open: dict[int, dict[str, Any]] = field(default_factory=dict)
    truth: list[list[int]] = field(default_factory=lambda: [["#.~m".index(mark) for mark in row] for row in YARD[::-1]])
    known: set[tuple[int, int]] = field(default_factory=set)

    def request(self) -> dict[str, Any]:
        team = [{"name": name, "type": "carrier", "cell": cell} for name, cell in (("m1", [3, 2]), ("m2", [5, 3]))]
        team += [{"name": f"j{i}", "type": "rover", "carrier": f"m{i}"} for i in (1, 2)]
        frame = {"width": len(YARD[0]), "height": len(YARD), "resolution_m": 0.5, "origin_m": [0, 0, 0], "known": []}
        return {
            "name": "yard",
            "frame": frame,
            "map_may_grow": False,
            "terrains": [{"name": "mud", "code": 3}],
            "robot_types": TYPES,
            "team": team,
            "goal": {"recover_rovers": True, "return_home": not self.changes},
            "planner": "anytime",
            "budget": {"steps": 4},
            "time_limit_ms": 600_000,
        }

    def answer(self, batch: Mapping[str, Any]) -> dict[str, Any] | None:
        """Accept commands and return the next report; None if none is due."""
        for command in batch["commands"]:
            if command["name"] == "stop":
                self.open[command["id"]]["route"] = self.open[command["id"]]["route"][:1]
            else:
                self.open[command["id"]] = command
        if batch["n"] != self.n or batch["until_ms"] is None:
            return None
        self.n += 1
        if self.n == 1:
            return {"n": 1, "t_ms": 0, "revealed": [{"robot": "m1", "runs": self.seen([3, 2])}]}
        self.t_ms = min(self.t_ms + 3000, batch["until_ms"])
        return {"n": self.n, "t_ms": self.t_ms, **self.news()}

    def news(self) -> dict[str, Any]:
        """End the oldest command and apply due changes."""
        if self.n == 25 and self.changes:
            self.truth[2][12] = self.truth[3][12] = 0
            return {"map": {"runs": self.runs()}}
        if self.n == 25:
            self.open = {number: one for number, one in self.open.items() if one["robot"] != "j1"}
            return {"lost": [{"robot": "j1", "reason": "battery"}]}
        if not self.open:
            return {}
        number = min(self.open)
        command = self.open.pop(number)
        self.ended += 1
        return self.failed(number) if self.ended % 6 == 0 else self.done(number, command)

    def failed(self, number: int) -> dict[str, Any]:
        return {"failed": [{"id": number, "reason": "no contact"}]}

    def done(self, number: int, command: Mapping[str, Any]) -> dict[str, Any]:
        """Report a finished command and the cells seen from its robot's new place."""
        cell = command["route"][-1] if command["name"] == "drive" else command.get("cell")
        if cell is None:
            return {"finished": [number]}
        robot = command["robot"]
        seen = {"robot": robot, "runs": self.seen(cell)}
        return {"finished": [number], "robots": [{"name": robot, "cell": cell}], "revealed": [seen]}

    def seen(self, cell: Sequence[int]) -> list[int]:
        """Return the runs of all that is known with the square around a cell."""
        rows = range(max(0, cell[1] - 3), min(len(YARD), cell[1] + 4))
        self.known |= {(y, x) for y in rows for x in range(max(0, cell[0] - 3), min(len(YARD[0]), cell[0] + 4))}
        return self.runs()

    def runs(self) -> list[int]:
        """Return all that is known: start, length and terrain of each run of cells."""
        places = itertools.product(range(len(YARD)), range(len(YARD[0])))
        marks = [self.truth[y][x] if (y, x) in self.known else None for y, x in places]
        found, start = [], 0
        for mark, cells in itertools.groupby(marks):
            length = len(list(cells))
            found += [] if mark is None else [start, length, mark]
            start += length
        return found


# How it is run


def called(*arguments: str) -> str:
    """Run the program in this process; return stdout and the exit code, and stderr if it refuses."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(arguments)
    if code not in GOOD_ENDS:
        raise RuntimeError(f"marsupial {' '.join(arguments)} ended with {code}: {err.getvalue()}")
    return f"{out.getvalue()}{err.getvalue() if code in (2, 3) else ''}exit code {code}\n"


def called_json(*arguments: str) -> str:
    """Run a command with `--json`; its object without wall-clock times and paths, and the exit code."""
    text, _, code = called(*arguments).rpartition("exit code ")
    if not text.startswith("{"):
        raise RuntimeError(f"marsupial {' '.join(arguments)} gave no JSON: {text}")
    return text_of(json.loads(text), CLOCKED) + f"exit code {code}"


def text_of(value: object, without: Set[str] = frozenset()) -> str:
    """Return a value as JSON without the fields of these names, at any depth."""
    return json.dumps(stripped(value, without), indent=1) + "\n"


def stripped(value: Any, without: Set[str]) -> Any:
    """Return a JSON value without the fields of these names."""
    if isinstance(value, dict):
        return {name: stripped(one, without) for name, one in value.items() if name not in without}
    return [stripped(one, without) for one in value] if isinstance(value, list | tuple) else value


def cases(maps: Path) -> Iterator[Case]:
    yield Case("service", service)
    for number, options in enumerate(mission_options()):
        yield Case(f"run {options}", mission, (options, number % VIEWED == 0))
    for options in CHARGED:
        yield Case(f"run {options}", charged, (options,))
    for options in REAL if maps.is_dir() else ():
        name, _, rest = options.partition(" ")
        yield Case(f"run {options}", mission, (f"{maps.resolve() / name} {rest}", False))
    yield Case("compare", comparison, (COMPARISON,))
    yield Case("situations of the suite", situations)
    for name in INSTANCES:
        for planner, steps in PLANNINGS.items():
            if planner != "exact" or name in SMALL:
                yield Case(f"plan {name} by {planner}", plans, (name, planner, steps))


def digests(case: Case, texts: Path | None) -> tuple[dict[str, str], float]:
    """Run a case; return the digest of each part, or its error, and the seconds taken."""
    begun = time.perf_counter()
    found = {}
    try:
        with tempfile.TemporaryDirectory() as folder:
            for part, text in case.work(Path(folder), *case.arguments):
                name = f"{case.name}: {part}"
                found[name] = hashlib.sha256(text.encode()).hexdigest()
                if texts is not None:
                    (texts / f"{re.sub('[^a-zA-Z0-9_.:]+', '-', name)}.txt").write_text(text)
    except Exception:
        found[f"{case.name}: all of it"] = f"failed: {traceback.format_exc()}"
    return found, time.perf_counter() - begun


def settle() -> None:
    """Make a process independent of the terminal it was started from."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "LINES", "MARSUPIAL_KEY"):
        os.environ.pop(name, None)
    os.environ.update(COLUMNS="120", TERM="dumb", NO_COLOR="1")


def carried_out(chosen: Sequence[Case], processes: int, texts: Path | None) -> dict[str, str]:
    """Run cases in parallel, with a line of progress each."""
    context = multiprocessing.get_context("spawn")
    found: dict[str, str] = {}
    with ProcessPoolExecutor(processes, context, initializer=settle) as pool:
        for case, (parts, seconds) in zip(chosen, pool.map(partial(digests, texts=texts), chosen), strict=True):
            print(f"{seconds:6.1f} s  {case.name}", file=sys.stderr, flush=True)
            found |= parts
    return found


def differences(kept: Mapping[str, str], found: Mapping[str, str]) -> Iterator[str]:
    """Yield a line for each changed digest."""
    for name in sorted({*kept, *found}):
        if found.get(name, "").startswith("failed: "):
            yield f"{name}: {found[name]}"
        elif name not in kept:
            yield f"{name}: is new"
        elif name not in found:
            yield f"{name}: is gone"
        elif kept[name] != found[name]:
            yield f"{name}: differs"


def program() -> int:
    """Write or check the digests; 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="keep the digests of what there is now")
    parser.add_argument("--only", default="", metavar="PATTERN", help="regular expression that names of cases match")
    parser.add_argument("--maps", type=Path, default=MAPS, help="folder of real maps [default: %(default)s]")
    parser.add_argument(
        "--texts", type=Path, metavar="FOLDER", help="also write what the digests are of, to compare it"
    )
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    if not Path(sys.modules["marsupial"].__file__ or "").is_relative_to(ROOT):
        parser.error(f"this is not the marsupial of this checkout: set PYTHONPATH={ROOT}")
    if not options.maps.is_dir():
        print(f"skipped: {len(REAL)} missions on real maps, as there is no {options.maps}", file=sys.stderr)
    chosen = [case for case in cases(options.maps) if re.search(options.only, case.name)]
    if options.texts is not None:
        options.texts.mkdir(parents=True, exist_ok=True)
    found = carried_out(chosen, options.processes, options.texts)
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    return write(kept, found, chosen) if options.write else check(kept, found, chosen)


def of_these(kept: Mapping[str, str], chosen: Sequence[Case]) -> dict[str, str]:
    names = {case.name for case in chosen}
    return {name: digest for name, digest in kept.items() if name.partition(": ")[0] in names}


def check(kept: Mapping[str, str], found: Mapping[str, str], chosen: Sequence[Case]) -> int:
    wrong = list(differences(of_these(kept, chosen), found))
    print("".join(f"{line}\n" for line in wrong), end="")
    print(f"{len(chosen)} cases, {len(found)} digests, {len(wrong)} differences")
    return 1 if wrong else 0


def write(kept: Mapping[str, str], found: Mapping[str, str], chosen: Sequence[Case]) -> int:
    """Store new digests beside those of other cases."""
    failed = [line for line in found.values() if line.startswith("failed: ")]
    print("".join(failed), end="")
    stale = of_these(kept, chosen)
    merged = {**{name: digest for name, digest in kept.items() if name not in stale}, **found}
    if not failed:
        KEPT.write_text(json.dumps(dict(sorted(merged.items())), indent=0) + "\n")
        print(f"{len(chosen)} cases, {len(found)} digests written")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(program())

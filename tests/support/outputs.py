"""What the program makes of fixed input, as text files, to see that a refactoring changed nothing.

Missions, exports, plans and comparisons depend on nothing but their input where the budget is in steps.
`python -m tests.support.outputs FOLDER` writes them, without wall-clock times and paths, for the marsupial of this
checkout: do so before and after, then `diff -r`.
"""

import argparse
import io
import itertools
import json
import multiprocessing
import re
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.cli.main import main
from marsupial.formats.situation import situation_to_json

ROOT = Path(__file__).resolve().parents[2]

CLOCKED = {"wall_s", "planning_s", "analysis_s", "elapsed_s", "log", "output"}
"""Fields of `--json` that hold wall-clock times or paths."""

GOOD_ENDS = (0, 2, 3, 4, 5, 6)
"""Exit codes that are results, not bugs."""

SCENARIOS = ("office", "maze", "rooms", "random", "cave", "lobby")

CONTENDERS = (
    "temporal --planner greedy --steps 8",
    "temporal --planner anytime --steps 4",
    "temporal --planner auto --steps 4",
    "heuristic",
    "heuristic-plus",
    "assignment",
    "clairvoyant --steps 6",
)

TEAMS = ("2x1", "1x2", "2x2", "1x1", "3x1")

FURTHER = (
    "lobby --planner exact --steps 20 --carriers 1 --rovers 2",
    "cave --planner anytime --steps 40 --carriers 5 --rovers 2 --time-limit 40 --seed 6",
    "lobby --strategy heuristic --carriers 1 --rovers 0",
    "rooms --planner greedy --steps 6 --carriers 6 --rovers 3 --time-limit 60",
    "lobby --strategy segmentation --carriers 3 --rovers 0",
    "lobby --strategy temporal --planner greedy --steps 4 --carriers 3 --rovers 2 --interference --seed 2",
    "lobby --strategy heuristic-plus --routes energy --seed 3",
)
"""Missions with other teams, planners and rules."""

PLANNINGS = {"greedy": 50, "anytime": 500, "auto": 30}
"""Planners of the suite, with their steps."""

COMPARISON = (
    "lobby rooms --strategies temporal:greedy,heuristic-plus,heuristic --carriers 1-2 --rovers 1 --runs 2 --steps 4"
)


def missions() -> Iterator[str]:
    teams = itertools.cycle(TEAMS)
    for number, (scenario, contender) in enumerate(itertools.product(SCENARIOS, CONTENDERS)):
        carriers, rovers = next(teams).split("x")
        yield f"{scenario} --strategy {contender} --carriers {carriers} --rovers {rovers} --seed {1 + number % 4}"
    yield from FURTHER


def called(*arguments: str) -> str:
    """Run the program in this process; return stdout and the exit code, and stderr if it refuses."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(arguments)
    if code not in GOOD_ENDS:
        raise RuntimeError(f"marsupial {' '.join(arguments)} ended with {code}: {err.getvalue()}")
    told = out.getvalue()
    text = json.dumps(without_clocks(json.loads(told)), indent=1) + "\n" if told.startswith("{") else told
    return f"{text}{err.getvalue() if code in (2, 3) else ''}exit code {code}\n"


def without_clocks(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: without_clocks(one) for name, one in value.items() if name not in CLOCKED}
    return [without_clocks(one) for one in value] if isinstance(value, list) else value


def mission(folder: Path, options: str) -> None:
    """Run a mission; write its log, its summary, and what is exported of its middle plan."""
    log = folder / "log.jsonl"
    (folder / "summary").write_text(called("run", *options.split(), "--json", "--log", str(log)))
    plans = [event["t_ms"] for event in map(json.loads, log.read_text().splitlines()) if event["event"] == "plan"]
    called("export", str(log), "--at", str(plans[len(plans) // 2] / 1000), "-o", str(folder / "exported"))


def planning(folder: Path, name: str) -> None:
    """Plan for an instance of the planner suite; write it, the best plans, all makespans and the bounds."""
    file = folder / "situation.json"
    file.write_text(situation_to_json(INSTANCES[name].situation()))
    for planner, steps in PLANNINGS.items():
        (folder / planner).write_text(called("plan", str(file), "--planner", planner, "--steps", str(steps), "--json"))


def comparison(folder: Path, options: str) -> None:
    with tempfile.TemporaryDirectory() as out:
        called("compare", *options.split(), "--workers", "1", "--out", out)
        for name in ("rows.csv", "coverage.csv"):
            (folder / name).write_text((Path(out) / name).read_text())


def write(case: tuple[Any, str], out: Path) -> str:
    """Carry out a case in a folder of its name."""
    work, what = case
    folder = out / re.sub("[^a-zA-Z0-9_.]+", "-", f"{work.__name__} {what}")
    folder.mkdir(parents=True)
    work(folder, what)
    return folder.name


def program() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", metavar="PATTERN", help="regular expression that names of cases match")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    if not Path(sys.modules["marsupial"].__file__ or "").is_relative_to(ROOT):
        parser.error(f"this is not the marsupial of this checkout: set PYTHONPATH={ROOT}")
    cases = [(mission, one) for one in missions()] + [(planning, one) for one in INSTANCES]
    cases.append((comparison, COMPARISON))
    chosen = [(work, what) for work, what in cases if re.search(options.only, f"{work.__name__} {what}")]
    with ProcessPoolExecutor(options.processes, multiprocessing.get_context("spawn")) as pool:
        for name in pool.map(partial(write, out=options.folder), chosen):
            print(name, flush=True)


if __name__ == "__main__":
    program()

"""Stored results of commands with their commit: the packed rows of a comparison, or what was printed."""

import gzip
import json
import platform
import re
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.folder import HEADER, read_curves, read_header, read_rows, read_timings
from marsupial.errors import UsageError

ROOT = Path(__file__).resolve().parents[2]
ROWS = Path(__file__).with_name("rows")

# all opponents of a suite but the clairvoyant, which takes minutes on a large map
QUICK = "assignment,heuristic-plus,wurm2010,heuristic,temporal"

COMMANDS: Mapping[str, str] = {
    "demo": "marsupial demo",
    "footprint": "marsupial compare --suite footprint",
    "footprint-interference": "marsupial compare --suite footprint --interference --runs 1",
    "paper": "marsupial compare --suite paper --runs 1",
    "ablation": "marsupial compare --suite footprint --runs 1 --strategies "
    "temporal/guess=0,temporal/price=0,temporal/early=0,temporal/choice=0,temporal",
    "rovers": "marsupial compare office --strategies temporal:anytime,heuristic --carriers 2 --rovers 1-4 --runs 5",
    "laser": f"marsupial compare --suite laser --strategies {QUICK} --runs 2",
    "buildings": f"marsupial compare --suite buildings --strategies {QUICK} --runs 1",
    "wurm2010": "marsupial reproduce wurm2010",
    "wurm2008-clutter": "marsupial reproduce wurm2008-clutter --runs 20",
    "alkhawaldah": "marsupial reproduce alkhawaldah",
    "alkhawaldah-triples": "marsupial reproduce alkhawaldah-triples",
    "mei": "marsupial reproduce mei",
    "paths": "python -m benchmarks paths --size 1024 --size 2048",
    "analysis": "python -m benchmarks analysis --size 2048",
    "sim": "python -m benchmarks sim",
}
"""The command behind each of the stored results; the comparison in a folder F within its own is stored as NAME-F."""

FILES = (HEADER, "rows.csv", "timings.csv")
CURVES, CURVED = "coverage.csv", ("mei", "mei-corner")  # long, and only the findings of these need it
_CLOCK = re.compile(r" (?:planning, |analysis ).*")  # lines of a demo with wall-clock times


def is_kept(name: str) -> bool:
    """Return whether there are stored results of this name."""
    return (ROWS / name / "made.json").exists()


def comparison(name: str) -> ComparisonOutcome:
    """Return a stored comparison."""
    with TemporaryDirectory() as made:
        folder = Path(made)
        for file in (ROWS / name).glob("*.gz"):
            (folder / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
        return ComparisonOutcome(read_header(folder), read_rows(folder), read_timings(folder), read_curves(folder))


def printed(name: str) -> str:
    """Return the stored output of a command."""
    return (ROWS / name / "printed.txt").read_text(encoding="utf-8")


def origin(name: str) -> tuple[str, str]:
    """Return the command of stored results, and their place in words; their commit is there."""
    made = json.loads((ROWS / name / "made.json").read_text(encoding="utf-8"))
    note = f" ({made['note']})" if "note" in made else ""
    place = (ROWS / name).relative_to(ROOT).as_posix()
    return made["command"], f"and kept with its commit in `{place}`{note}"


def carry_out(name: str) -> None:
    """Run one of `COMMANDS` and store its results; resume an interrupted comparison."""
    commit = _git("log", "-1", "--format=%H", "--", "marsupial")
    if _git("status", "--porcelain", "marsupial"):
        raise UsageError("the results are kept with their commit: commit what has changed in marsupial/ first")
    out = ROOT / "out" / "figures" / f"{name}-{commit[:8]}"
    command = [sys.executable, "-m", *COMMANDS[name].removeprefix("python -m ").split()]
    command += ["--out", str(out)] if "marsupial" in command else []
    said = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout
    keep(name, commit, said, out, command=COMMANDS[name], **({} if "marsupial" in command else {"note": _machine()}))
    for part in out.glob(f"*/{HEADER}"):
        keep(f"{name}-{part.parent.name}", commit, "", part.parent, command=COMMANDS[name])


def keep(name: str, commit: str, said: str, folder: Path, **more: str) -> None:
    """Store the output of a command, or the comparison in its folder."""
    kept = ROWS / name
    kept.mkdir(parents=True, exist_ok=True)
    (kept / "made.json").write_text(json.dumps({"commit": commit, **more}, indent=1) + "\n", encoding="utf-8")
    if not (folder / HEADER).exists():
        (kept / "printed.txt").write_text(steady(said), encoding="utf-8")
        return
    for file in (*FILES, CURVES) if name in CURVED else FILES:
        (kept / f"{file}.gz").write_bytes(gzip.compress((folder / file).read_bytes(), mtime=0))


def steady(said: str) -> str:
    """Return a demo's output without the times that differ between machines."""
    lines = [line.rstrip() for line in said.splitlines() if not _CLOCK.fullmatch(line)]
    return "\n".join(lines).strip("\n") + "\n"


def _machine() -> str:
    """Return what times depend on."""
    models = re.findall(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return f"{len(models)} cores, {models[0]}, Python {platform.python_version()}, numba {version('numba')}"


def _git(*arguments: str) -> str:
    command = ["git", *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout.strip()

"""Stored results of missions with their commit: the packed rows of a comparison, or the output of a command."""

import gzip
import json
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.folder import HEADER, read_header, read_rows, read_timings
from marsupial.errors import UsageError

ROOT = Path(__file__).resolve().parents[2]
ROWS = Path(__file__).with_name("rows")

COMMANDS: Mapping[str, str] = {
    "demo": "demo",
    "footprint": "compare --suite footprint --strategies assignment,heuristic-plus,heuristic,temporal --runs 1",
}
"""The command of `marsupial` behind each of the stored results."""

FILES = (HEADER, "rows.csv", "timings.csv")  # coverage over time is long, and no figure needs it
_CLOCK = re.compile(r" (?:planning, |analysis ).*")  # lines of a demo with wall-clock times


def comparison(name: str) -> ComparisonOutcome:
    """Return a stored comparison."""
    with TemporaryDirectory() as made:
        folder = Path(made)
        for file in FILES:
            (folder / file).write_bytes(gzip.decompress((ROWS / name / f"{file}.gz").read_bytes()))
        return ComparisonOutcome(read_header(folder), read_rows(folder), read_timings(folder))


def printed(name: str) -> str:
    """Return the stored output of a command."""
    return (ROWS / name / "printed.txt").read_text(encoding="utf-8")


def origin(name: str) -> str:
    """Return the commit at which stored results were made, and their place."""
    made = json.loads((ROWS / name / "made.json").read_text(encoding="utf-8"))
    note = f" ({made['note']})" if "note" in made else ""
    return f"at commit `{made['commit'][:8]}`{note}, kept in `{(ROWS / name).relative_to(ROOT).as_posix()}`"


def carry_out(name: str) -> None:
    """Run the missions of one of `COMMANDS` and store their results; resume an interrupted comparison."""
    commit = _git("log", "-1", "--format=%H", "--", "marsupial")
    if _git("status", "--porcelain", "marsupial"):
        raise UsageError("the results are kept with their commit: commit what has changed in marsupial/ first")
    out = ROOT / "out" / "figures" / f"{name}-{commit[:8]}"
    command = [sys.executable, "-m", "marsupial", *COMMANDS[name].split(), "--out", str(out)]
    said = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout
    keep(name, commit, said, out)


def keep(name: str, commit: str, said: str, folder: Path, **more: str) -> None:
    """Store the output of a command, or the comparison in its folder."""
    kept = ROWS / name
    kept.mkdir(parents=True, exist_ok=True)
    (kept / "made.json").write_text(json.dumps({"commit": commit, **more}, indent=1) + "\n", encoding="utf-8")
    if not (folder / HEADER).exists():
        (kept / "printed.txt").write_text(steady(said), encoding="utf-8")
        return
    for file in FILES:
        (kept / f"{file}.gz").write_bytes(gzip.compress((folder / file).read_bytes(), mtime=0))


def steady(said: str) -> str:
    """Return a demo's output without the times that differ between machines."""
    lines = [line.rstrip() for line in said.splitlines() if not _CLOCK.fullmatch(line)]
    return "\n".join(lines).strip("\n") + "\n"


def _git(*arguments: str) -> str:
    command = ["git", *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout.strip()

"""Schemathesis on a server: random requests from its OpenAPI document, alone and in sequences, with all checks.

Three things are allowed that no schema can express: a well-formed request may still be wrong (422, an unknown
robot) or too large for this service (413), and a request that is both gets only the 413.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from support.services import plain_client

from benchmarks.trial.rows import Judgement, TrialRow, none_of
from benchmarks.trial.trial_server import running_server

PART = "fuzzing"
INSTALL = "pip install 'marsupial[fuzz]'"
_SLACK_S = 300.0
_OPTIONS = ("--limit=budget_s=0.5", "--limit=steps_s=0.5", "--limit=queue=100000", "--limit=wait_s=1")
_CONFIGURATION = """\
[checks.positive_data_acceptance]
expected-statuses = ["2xx", "401", "403", "404", "409", "413", "422", "429", "503"]

[checks.negative_data_rejection]
expected-statuses = ["400", "401", "403", "404", "405", "406", "409", "413", "415", "422", "428", "429", "5xx"]
"""


def rows(minutes: float, seed: int, say: Callable[[str], None]) -> list[TrialRow]:
    """Fuzz for `minutes`; report if Schemathesis is not installed."""
    program = found_program()
    requirement = "failures of all checks, stateful ones too"
    if program is None:
        said = f"Schemathesis is not installed: {INSTALL}"
        return [TrialRow(part=PART, requirement=requirement, figure=said, goal="0", judgement=Judgement.NOT_RUN)]
    say(f"fuzzing: {minutes:g} minutes")
    with running_server(_OPTIONS) as server, TemporaryDirectory() as folder:
        code, printed = _run(program, Path(folder), server.port, minutes, seed)
        alive = server.runs
    failures, cases, titles = read(printed, code)
    of = f" of {cases} cases in {minutes:g} min" + "".join(f"; {title}" for title in titles)
    if cases == 0:
        say(printed[-3000:])
    elif failures:
        say(printed)
    return [
        none_of(PART, requirement, failures, of),
        none_of(PART, "servers that ended meanwhile", 0 if alive else 1),
    ]


def found_program() -> str | None:
    """Return the path of Schemathesis beside this Python, or elsewhere."""
    return shutil.which("schemathesis", path=str(Path(sys.executable).parent)) or shutil.which("schemathesis")


def _run(program: str, folder: Path, port: int, minutes: float, seed: int) -> tuple[int, str]:
    configuration = folder / "schemathesis.toml"
    configuration.write_text(_CONFIGURATION, encoding="utf-8")
    seconds = round(60 * minutes)
    words = [program, f"--config-file={configuration}", "run", f"http://{plain_client.HOST}:{port}/openapi.json"]
    words += ["--checks=all", f"--max-time={seconds}", f"--seed={seed}", "--no-color", "--request-timeout=30"]
    done = subprocess.run(
        words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds + _SLACK_S, check=False
    )
    return done.returncode, done.stdout.decode(errors="replace")


def read(printed: str, code: int) -> tuple[int, int, list[str]]:
    """Return the number of failures and cases, and the titles of failures, from what Schemathesis prints.

    A run with an exit code other than 0 has at least one failure.
    """
    cases = re.search(r"^\s*(\d+) generated", printed, re.MULTILINE)
    unique = re.search(r"found (\d+) unique failure", printed)
    titles = re.findall(r"^\s*❌ (.+: \d+)$", printed, re.MULTILINE)
    failures = max(int(unique[1]) if unique else 0, code != 0)
    return failures, int(cases[1]) if cases else 0, [json.dumps(title)[1:-1] for title in titles]

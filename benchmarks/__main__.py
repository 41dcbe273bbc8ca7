"""The command ``python -m benchmarks NAME``; each program is imported only when it runs."""

from __future__ import annotations

import sys
from importlib import import_module

from marsupial.errors import MarsupialError

PROGRAMS = {
    # how fast
    "analysis": (
        "benchmarks.speed.analysis",
        "incremental map analysis after 1 % of a map was revealed, compared with analysis from scratch",
    ),
    "first-use": (
        "benchmarks.speed.first_use",
        "first use of a command, without compiled code, compared with later uses",
    ),
    "paths": ("benchmarks.speed.paths", "path costs compared with plain C and scipy's csgraph"),
    "sim": ("benchmarks.speed.sim", "missions compared with real time, sensing with plain C"),
    # many missions
    "batteries": ("benchmarks.studies.batteries", "robots stranded in 200 missions whose batteries are small"),
    "calibration": (
        "benchmarks.studies.calibration",
        "when plans say that targets will be explored, and when they are",
    ),
    "contact": (
        "benchmarks.studies.contact",
        "what it costs each strategy if rovers are in contact within some metres only",
    ),
    "losses": ("benchmarks.studies.losses", "what it costs each strategy if half of the rovers fail, on 30 maps"),
    # tests of the whole
    "fuzz": ("benchmarks.fuzz.runs", "mutated inputs for every reader, guided by coverage"),
    "recovery": (
        "benchmarks.trial.recovery",
        "time until a long mission has commands again after its process or server was killed",
    ),
    "storm": ("benchmarks.storm.runs", "random missions of every strategy, judged by an independent oracle"),
    "trial": ("benchmarks.trial.runs", "the HTTP service under kills, hostile planners, load and fuzzing"),
    # documentation
    "figures": ("benchmarks.figures.blocks", "rewrite the figures of README and docs from stored results"),
}
"""The module of each program, which has a function `main(arguments) -> exit code`, and what it does."""


def main() -> int:
    """Run the program that the first argument names; return its exit code."""
    name, *arguments = sys.argv[1:] or [""]
    if name not in PROGRAMS:
        print("usage: python -m benchmarks NAME [options]")
        for known, (_, does) in PROGRAMS.items():
            print(f"  {known}: {does}")
        return 0 if name in ("", "-h", "--help") else 2
    module, _ = PROGRAMS[name]
    try:
        return int(import_module(module).main(arguments))
    except MarsupialError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())

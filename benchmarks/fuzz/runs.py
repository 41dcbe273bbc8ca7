"""The fuzzer's command: run each family of readers in its own process, and save the findings.

Each finding is an input file called FAMILY.DIGEST; inputs that fail at the same place in the same way are one finding.
Inputs that add coverage to a family are saved as its corpus, with which the next run begins.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import re
import sys
import time
import warnings
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

PACKAGES = ("marsupial", "marsupial_service", "marsupial_client", "marsupial_ros")

LEFT_OUT = (
    "maps", "paths", "planning.branch_and_bound", "planning.batteries", "planning.greedy", "planning.schedule",
    "planning.local_search", "sim", "mission", "generators", "native", "keeping",
)  # fmt: skip
"""Parts of `marsupial` whose coverage says nothing about readers; numba can't compile instrumented code."""

MOST_FINDINGS = 30
"""Limit for one family in one run."""

LEAST = 4096
"""Inputs may be four times as long as the longest seed, or at least this long: longer ones take long, find little."""

HANG_S = 300
"""An execution is aborted after this time; slow ones are found by their CPU time."""


def fuzz(family: str, folder: Path, runs: int, seconds: int, seed: int) -> None:
    """Run one family, whose end also ends the process; libFuzzer's output goes to a file."""
    import atheris

    log = os.open(folder / f"{family}.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 2)
    with atheris.instrument_imports(include=list(PACKAGES), exclude=_left_out()):
        from benchmarks.fuzz.targets import TARGETS
    from benchmarks.fuzz.mutations import mutated
    from benchmarks.fuzz.trying import LONGEST, fault_of

    warnings.simplefilter("error")
    target, found, rng = TARGETS[family], set[str](), random.Random(seed)
    words = target.words.encode().split()
    corpus, seeds = folder / "corpus" / family, folder / "seeds" / family
    longest = min(LONGEST, max(LEAST, 4 * max(file.stat().st_size for file in seeds.iterdir())))

    def execute(data: bytes) -> None:
        fault = fault_of(target, data)
        kind = None if fault is None else re.sub(r"[\d.]+ ", "", fault.partition(": ")[0])
        if kind is not None and kind not in found and len(found) < MOST_FINDINGS:
            found.add(kind)
            file = folder / f"{family}.{_digest(data)}"
            file.write_bytes(data)
            print(f"{family}: {fault}\n    python -m benchmarks fuzz --replay {file}", flush=True)

    def mutate(data: bytes, most: int, _: int) -> bytes:
        changed = atheris.Mutate(data, most) if rng.random() < 0.4 else mutated(bytes(data), rng, words)
        return bytes(changed[:most])

    options = [f"-runs={runs}", f"-max_total_time={seconds}", f"-max_len={longest}", f"-seed={seed}"]
    options += [f"-timeout={HANG_S}", f"-report_slow_units={HANG_S}", "-rss_limit_mb=8192"]
    options += ["-print_final_stats=1", f"-artifact_prefix={folder}/{family}."]
    atheris.Setup([sys.argv[0], *options, str(corpus), str(seeds)], execute, custom_mutator=mutate)
    atheris.Fuzz()


def _left_out() -> list[str]:
    """Return the names of the modules of `LEFT_OUT`."""
    root = Path(__file__).parents[2]
    names = [".".join(path.relative_to(root).with_suffix("").parts) for path in root.glob("marsupial/**/*.py")]
    parts = tuple(f"marsupial.{part}." for part in LEFT_OUT)
    return [name.removesuffix(".__init__") for name in names if f"{name}.".startswith(parts)]


def replay(file: Path) -> int:
    """Feed a file to the family that its name begins with; return the number of findings."""
    from benchmarks.fuzz.targets import TARGETS
    from benchmarks.fuzz.trying import fault_of

    family = file.name.partition(".")[0]
    if family not in TARGETS:
        print(f"{file}: its name must begin with a family and a dot; there are {', '.join(TARGETS)}")
        return 2
    with warnings.catch_warnings(action="error"):
        fault = fault_of(TARGETS[family], file.read_bytes())
    print(f"{family}: {fault or 'no finding'}")
    return int(fault is not None)


def _digest(data: bytes) -> str:
    return sha256(data).hexdigest()[:12]


def _run(family: str, chosen: argparse.Namespace) -> int:
    """Run a family; print the number of executions and return the number of findings."""
    from benchmarks.fuzz.targets import TARGETS

    corpus, seeds = chosen.out / "corpus" / family, chosen.out / "seeds" / family
    for place in (corpus, seeds):
        place.mkdir(parents=True, exist_ok=True)
    for data in TARGETS[family].seeds():
        (seeds / _digest(data)).write_bytes(data)
    began = time.time()
    arguments = (family, chosen.out, chosen.runs, chosen.seconds, chosen.seed)
    process = multiprocessing.get_context("spawn").Process(target=fuzz, args=arguments)
    process.start()
    process.join()
    said = (chosen.out / f"{family}.log").read_text(errors="replace")
    executed = re.search(r"number_of_executed_units: (\d+)", said)
    written = [path for path in chosen.out.glob(f"{family}.*") if path.stat().st_mtime >= began]
    count = sum(path.suffix != ".log" for path in written)
    if executed is None:
        last = (said.strip().splitlines() or ["nothing"])[-1]
        print(f"{family}: its process ended ({process.exitcode}), saying: {last}; see {chosen.out / family}.log")
        count = max(1, count)
    print(f"{family}: {executed[1] if executed else '?'} executions, {count} findings", flush=True)
    return count


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code: 1 if there are findings."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks fuzz", description=__doc__)
    parser.add_argument("--families", help="families to run, separated by commas (default: all)")
    parser.add_argument("--seconds", type=int, default=60, help="seconds a family (default %(default)s)")
    parser.add_argument("--runs", type=int, default=-1, help="executions a family, at most (default: no limit)")
    parser.add_argument("--seed", type=int, default=1, help="of the mutations (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"), help="folder (default %(default)s)")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run one input again; needs no atheris")
    chosen = parser.parse_args(arguments)
    if chosen.replay is not None:
        return replay(chosen.replay)
    from benchmarks.fuzz.targets import TARGETS

    families = chosen.families.split(",") if chosen.families else list(TARGETS)
    unknown = [family for family in families if family not in TARGETS]
    if unknown:
        parser.error(f"no family {', '.join(unknown)}; there are {', '.join(TARGETS)}")
    chosen.out.mkdir(parents=True, exist_ok=True)
    return int(sum(_run(family, chosen) for family in families) > 0)

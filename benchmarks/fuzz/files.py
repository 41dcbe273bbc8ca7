"""Feed bytes to readers of files and command lines, write what they return, and read it again."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache, partial
from pathlib import Path
from unittest.mock import patch

from benchmarks.fuzz.examples import ROOT, deploy
from benchmarks.scenario_files import scenario_text
from marsupial.bench.compare.folder import FILES, read_curves, read_rows, read_timings
from marsupial.bench.compare.plan import parse_header
from marsupial.bench.suite.best import read_best, write_best
from marsupial.cli.work.compare_arguments import contenders, numbers
from marsupial.errors import InvalidPlanError, MarsupialError
from marsupial.formats.loglines import log_lines, read_triggers, trigger_text
from marsupial.formats.mapfiles.images import grey_of, size_of
from marsupial.formats.mapfiles.movingai import scenario_map
from marsupial.formats.mapfiles.nav2 import header_of, nav2_files, understand_image
from marsupial.formats.mapfiles.read import read_map
from marsupial.formats.missionlog import parse_log
from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.pddl.read import read_problem
from marsupial.formats.pddl.text import check_domain, problem_text
from marsupial.formats.scenario import is_scenario_file, read_scenario
from marsupial.formats.situation import situation_from_json, situation_to_json
from marsupial.generators import canvas
from marsupial.library.scenarios import scenario as scenario_of
from marsupial.model.bounds import BOUNDS
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.model.planning import Budget
from marsupial.planning.engines import engine
from marsupial.planning.external.commands import External
from marsupial.planning.external.output import PlanReader, Printed, last_words

MOST_CELLS, MOST_SIDE = 250_000, 300
"""Limits of cells of images, and of the side of generated maps: larger ones are slow for their size alone."""


class Mismatch(Exception):
    """A value that was read and written reads back as another value."""


def same(first: object, second: object) -> None:
    """Raise a `Mismatch` unless both are the same."""
    if first != second:
        raise Mismatch(f"read again as another one: {str(first)[:300]!r} became {str(second)[:300]!r}")


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder with maps that files may name."""
    fast = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    folder = tempfile.TemporaryDirectory(prefix="marsupial-fuzz-", dir=fast)
    for name in ("workshop.yaml", "workshop.png"):
        Path(folder.name, name).write_bytes((ROOT / "docs/tutorial" / name).read_bytes())
    Path(folder.name, "small.pgm").write_bytes(b"P5\n2 2\n255\n\0\xcd\xfe\x80")
    return folder


def stored(data: bytes, name: str) -> Path:
    """Return the path of a file of that name that holds `data`."""
    path = Path(_folder().name, name)
    path.write_bytes(data)
    return path


def read_text_of(read: Callable[[str], object], data: bytes) -> object:
    """Read a text as files are read: bytes that are not UTF-8 never reach a reader."""
    with suppress(UnicodeDecodeError):
        return read(data.decode("utf-8"))
    return None


def scenario(data: bytes) -> None:
    """Read a scenario file, write it and read it again."""
    path = stored(data, "scenario.yaml")
    is_scenario_file(path)
    with patch.object(canvas, "MOST_CELLS", MOST_SIDE):
        text = scenario_text(read_scenario(path))
    same(text, scenario_text(read_scenario(stored(text.encode(), "again.yaml"))))


def situation(text: str) -> None:
    """Read a situation, write it and read it again."""
    written = situation_to_json(situation_from_json(text))
    same(written, situation_to_json(situation_from_json(written)))


def problem(text: str) -> None:
    """Read a problem, write it and read it again."""
    situation = read_problem(text)
    same(situation_to_json(situation), situation_to_json(read_problem(problem_text(situation))))


def plan(text: str) -> None:
    """Read a plan, write it and read it again."""
    found = read_plan_text(text, deploy())
    with suppress(InvalidPlanError):  # PDDL can't express every plan
        same(found, read_plan_text(write_plan_text(found, deploy()), deploy()))


def planner_output(data: bytes) -> None:
    """Extract plans from a planner's output, which arrives in two pieces."""
    printed, reader = Printed(), PlanReader(deploy())
    for chunk in (data[: len(data) // 2], b"", data[len(data) // 2 :]):
        list(reader.better([*printed.feed(chunk), *printed.growing(chunk)], complete=True))
    list(reader.better(printed.rest(), complete=True))
    last_words(data, printed.tail)
    assert reader.summary


def log(data: bytes) -> None:
    """Read a mission log, write it and read it again."""
    lines = list(log_lines(parse_log(data).events))
    same(lines, list(log_lines(parse_log("\n".join([*lines, ""]).encode()).events)))


def map_file(data: bytes, *, name: str) -> None:
    """Read a map file of the kind that its name gives."""
    grid = read_map(stored(data, name)).grid
    _as_nav2(grid)


_header_of = lru_cache(header_of)


def _as_nav2(grid: Grid) -> None:
    """Write a map as nav2's map saver does; unknown cells and obstacles must read back as such."""
    pixels, head = nav2_files(grid, Path("map.yaml")).values()
    cells = understand_image(_header_of(head), grey_of(pixels)).grid.cells
    same(((cells == 0).tobytes(), (cells == UNKNOWN).tobytes()), _solid(grid))


def _solid(grid: Grid) -> tuple[bytes, bytes]:
    return (grid.cells == 0).tobytes(), (grid.cells == UNKNOWN).tobytes()


def nav2(data: bytes) -> None:
    """Read a map's yaml, with the image it names."""
    read_map(stored(data, "map.yaml"))


def image(data: bytes) -> None:
    """Read an image, interpret it in every mode, and write what became of it in one."""
    with suppress(MarsupialError):
        size_of(data)
    image = grey_of(data, max_cells=MOST_CELLS)
    for mode in ("raw", "scale", "trinary"):
        head = f"image: a\nresolution: 0.05\norigin: [0,0,0]\nnegate: 0\nmode: {mode}\n"
        found = understand_image(_header_of(f"{head}occupied_thresh: 0.65\nfree_thresh: 0.2".encode()), image)
    _as_nav2(found.grid)


def comparison(data: bytes) -> None:
    """Read a file of a comparison's folder, recognised by its first line: the head or a CSV."""
    first = data.partition(b"\n")[0]
    name = next((name for name, lines in FILES.items() if lines.head.encode().strip() == first.strip()), None)
    if name is None:
        same(*2 * [read_text_of(partial(parse_header, source=""), data)])
        return
    folder = stored(data, name).parent
    lines, read = FILES[name], {"rows.csv": read_rows, "timings.csv": read_timings, "coverage.csv": read_curves}[name]
    written = lines.head + "".join(map(lines.encode, read(folder)))
    stored(written.encode(), name)
    same(written, lines.head + "".join(map(lines.encode, read(folder))))


def command_line(text: str) -> None:
    """Read a text as a value of each option that has its own grammar."""
    for read in (
        partial(numbers, option="--carriers", bound=BOUNDS["carriers"]),
        partial(contenders, planner="greedy", budget=Budget(steps=1)),
        External,
        engine,
        lambda text: scenario_of(text.replace("/", "|")),
    ):
        with suppress(MarsupialError):
            read(text)
    same(text, trigger_text(read_triggers(text)))


def domain(text: str) -> None:
    """Read a domain."""
    check_domain(text)


def movingai_problems(data: bytes) -> None:
    """Read which map the path problems are for, and refuse the file as a map."""
    path = stored(data, "grid.map.scen")
    scenario_map(path)
    with suppress(MarsupialError):
        read_map(path)


def best(text: str) -> None:
    """Read the suite's best plans."""
    written = write_best(read_best(text))
    same(written, write_best(read_best(written)))

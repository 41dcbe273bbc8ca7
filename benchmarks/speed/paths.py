"""Path costs against reference implementations, in one process and on the same grids.

Three jobs on three kinds of map, from small to large ones: the field of one cell, the cost matrix of K cells, one route
from corner to corner. The references are Dijkstra's search in plain C (`dijkstra.c`), with a binary heap and with
buckets of width 1, and scipy's `csgraph.dijkstra`. Their preparation is not counted: C's framed copy of the
grid, and scipy's sparse graph, which is timed separately. All results are compared in the same run. The field of
least energy, whose search has 8 states per cell, is compared with the field of lengths.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from benchmarks.speed.drawn import MASKS
from benchmarks.speed.reference import BUCKETS, HEAP, NotCompiled, PlainSearch, compiled
from benchmarks.speed.timing import Options, show, timed
from marsupial.arrays import Floats
from marsupial.cli.display.messages import say
from marsupial.model.grid import Cell, Mask
from marsupial.model.robots import SQRT2
from marsupial.paths.energy import EnergySearch, MotionCosts
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import route_length

SIZES = (256, 512, 1024, 2048)

SCIPY_MOST, SCIPY_MATRIX_MOST, ENERGY_MOST = 2048, 1024, 2048
"""The largest maps, in cells a side, on which scipy and the search for least energy take part: beyond, scipy's graph
and the states of the other take gigabytes, and a matrix by scipy takes minutes."""

C_HEAP, C_BUCKETS, SCIPY = "C, heap", "C, buckets", "scipy"
REFERENCES = (C_HEAP, C_BUCKETS, SCIPY)

_WIDTHS = {name: max(8, len(name) + 1) for name in REFERENCES}
"""Columns for the time of each reference; the whole line has 100."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathsRow:
    """One job on one map beside one reference.

    Parameters
    ----------
    size
        Cells per side of the map.
    ours_s, reference_s
        CPU seconds.
    difference
        The largest difference between both results, in cells.
    """

    map: str
    size: int
    job: str
    reference: str
    ours_s: float
    reference_s: float
    difference: float

    @property
    def ratio(self) -> float:
        """How many times faster ours is."""
        return self.reference_s / self.ours_s


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyRow:
    """The fields of least energy and of lengths on one map, in CPU seconds."""

    map: str
    size: int
    energy_s: float
    length_s: float

    @property
    def per_state(self) -> float:
        """How many times longer a state of the search for least energy takes: it has 8 per cell."""
        return self.energy_s / self.length_s / 8


@dataclass(frozen=True, slots=True, kw_only=True)
class PathsBench:
    """All rows; CPU seconds to build scipy's graph, by map and size; the reason why there is no C, if there is none.

    A matrix is over `cells` cells.
    """

    sizes: tuple[int, ...]
    cells: int
    seed: int
    repeats: int
    rows: tuple[PathsRow, ...]
    energy: tuple[EnergyRow, ...]
    build_s: Mapping[tuple[str, int], float]
    missing: str | None


@dataclass(frozen=True, slots=True)
class _SearchJob:
    """The job as our function and as each reference does it, and what their results must agree on."""

    name: str
    ours: Callable[[], Floats]
    references: Mapping[str, Callable[[], Floats]]


@dataclass(frozen=True, slots=True)
class _TimedGround:
    """One map, and the references' preparation of it."""

    map: str
    passable: Mask
    cells: list[Cell]
    plain: Mapping[str, PlainSearch]
    graph: csr_array | None


def bench_paths(
    sizes: Sequence[int] = SIZES,
    seed: int = 1,
    repeats: int = 3,
    cells: int = 40,
    tell: Callable[[str], None] = lambda text: None,
) -> PathsBench:
    """Time all sides on maps of these sizes, in cells a side; `tell` gets the name of the next map."""
    library = compiled("dijkstra")
    rows: list[PathsRow] = []
    energy: list[EnergyRow] = []
    builds: dict[tuple[str, int], float] = {}
    for size in sizes:
        for name, make in MASKS.items():
            tell(f"{name}, {size} x {size} cells")
            passable = make(size, seed)
            graph = None
            if size <= SCIPY_MOST:
                built = timed(partial(grid_graph, passable), 1)
                graph, builds[name, size] = built.result, built.cpu_s
            chosen = _connected_cells(passable, cells, seed)
            ground = _TimedGround(name, passable, chosen, _plain_searches(library, passable), graph)
            rows += [row for job in _search_jobs(ground) for row in _rows(ground, job, repeats)]
            if size <= ENERGY_MOST:
                energy.append(_energy_row(ground, repeats))
    return PathsBench(
        sizes=tuple(sizes),
        cells=cells,
        seed=seed,
        repeats=repeats,
        rows=tuple(rows),
        energy=tuple(energy),
        build_s=builds,
        missing=library.reason if isinstance(library, NotCompiled) else None,
    )


def grid_graph(passable: Mask) -> csr_array:
    """Return the graph of the steps between passable cells, cells numbered row-major."""
    number = np.arange(passable.size, dtype=np.int32).reshape(passable.shape)
    starts, ends, lengths = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        here, there = _shifted(dx, dy)
        legal = passable[here] & passable[there]
        if dx and dy:
            across, along = (here[0], there[1]), (there[0], here[1])
            legal &= passable[across] & passable[along]
        a, b = number[here][legal], number[there][legal]
        starts += [a, b]
        ends += [b, a]
        lengths.append(np.full(2 * a.size, SQRT2 if dx and dy else 1.0))
    edges = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
    return csr_array(edges, shape=(passable.size, passable.size))


def _shifted(dx: int, dy: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the slices of all cells that have a neighbour at (dx, dy), dy 0 or 1, and of those neighbours."""
    columns = {0: (np.s_[:], np.s_[:]), 1: (np.s_[:-1], np.s_[1:]), -1: (np.s_[1:], np.s_[:-1])}[dx]
    rows = (np.s_[:-1], np.s_[1:]) if dy else (np.s_[:], np.s_[:])
    return (rows[0], columns[0]), (rows[1], columns[1])


def _plain_searches(library: ctypes.CDLL | NotCompiled, passable: Mask) -> Mapping[str, PlainSearch]:
    if isinstance(library, NotCompiled):
        return {}
    return {name: PlainSearch(library, passable, queue) for name, queue in ((C_HEAP, HEAP), (C_BUCKETS, BUCKETS))}


def _connected_cells(passable: Mask, count: int, seed: int) -> list[Cell]:
    """Return the two cells of the middle's component nearest to opposite corners, then others drawn at random."""
    y, x = np.nonzero(passable)
    half = passable.shape[0] / 2
    middle = np.argmin((x - half) ** 2 + (y - half) ** 2)
    field = PathSearch(passable).field(Cell(int(x[middle]), int(y[middle])))
    y, x = np.nonzero(np.isfinite(field))
    drawn = np.random.default_rng(seed).choice(x.size, count - 2, replace=False)
    chosen = [int(np.argmin(x + y)), int(np.argmax(x + y)), *drawn.tolist()]
    return [Cell(int(x[i]), int(y[i])) for i in chosen]


def _search_jobs(ground: _TimedGround) -> Iterator[_SearchJob]:
    search, cells = PathSearch(ground.passable), ground.cells
    nodes = [cell.y * ground.passable.shape[1] + cell.x for cell in cells]

    def by_plain(job: Callable[[PlainSearch], Floats]) -> dict[str, Callable[[], Floats]]:
        return {name: partial(job, plain) for name, plain in ground.plain.items()}

    def by_scipy(sources: list[int], of: Callable[[Floats], Floats], most: int) -> dict[str, Callable[[], Floats]]:
        graph = ground.graph if ground.passable.shape[0] <= most else None
        return {} if graph is None else {SCIPY: lambda: of(np.asarray(dijkstra(graph, indices=sources)))}

    def length_of_route() -> Floats:
        route = search.route(cells[0], cells[1])
        return np.array([np.inf if route is None else route_length(route)])

    yield _SearchJob(
        "field",
        lambda: search.field(cells[0]),
        {
            **by_plain(lambda plain: plain.field(cells[0])),
            **by_scipy(nodes[:1], lambda it: it.reshape(ground.passable.shape), SCIPY_MOST),
        },
    )
    yield _SearchJob(
        f"matrix K = {len(cells)}",
        lambda: PathSearch(ground.passable).matrix(cells),  # a search caches its last matrix
        {**by_plain(lambda plain: plain.matrix(cells)), **by_scipy(nodes, lambda it: it[:, nodes], SCIPY_MATRIX_MOST)},
    )
    yield _SearchJob(
        "corner to corner",
        length_of_route,
        {
            **by_plain(lambda plain: plain.field(cells[0], cells[1])[cells[1].y, cells[1].x, None]),
            **by_scipy(nodes[:1], lambda it: it[0, nodes[1:2]], SCIPY_MOST),
        },
    )


def _rows(ground: _TimedGround, job: _SearchJob, repeats: int) -> Iterator[PathsRow]:
    ours = timed(job.ours, repeats, warm=True)
    for name, theirs in job.references.items():
        reference = timed(theirs, repeats)
        yield PathsRow(
            map=ground.map,
            size=ground.passable.shape[0],
            job=job.name,
            reference=name,
            ours_s=ours.cpu_s,
            reference_s=reference.cpu_s,
            difference=_largest_difference(ours.result, reference.result),
        )


def _energy_row(ground: _TimedGround, repeats: int) -> EnergyRow:
    energies, lengths = EnergySearch(ground.passable, MotionCosts()), PathSearch(ground.passable)
    return EnergyRow(
        map=ground.map,
        size=ground.passable.shape[0],
        energy_s=timed(lambda: energies.field(ground.cells[0]), repeats, warm=True).cpu_s,
        length_s=timed(lambda: lengths.field(ground.cells[0]), repeats, warm=True).cpu_s,
    )


def _largest_difference(ours: Floats, theirs: Floats) -> float:
    """Return the largest difference in cells; inf where only one side finds a path."""
    finite = np.isfinite(theirs)
    if not np.array_equal(finite, np.isfinite(ours)):
        return float("inf")
    return float(np.max(np.abs(ours[finite] - theirs[finite]), initial=0.0))


def table(result: PathsBench) -> str:
    """Write a result as text."""
    heads = "".join(f"{name:>{width}}{'ratio':>7}" for name, width in _WIDTHS.items())
    lines = [
        f"path costs, 8-connected, no corner cutting; seed {result.seed}, median CPU times of {result.repeats} in ms;",
        "a ratio says how many times faster ours is, `off by` how far lengths differ at most, in cells",
        f"{'map':<6}{'cells':>5} {'job':<16}{'ours':>8}{'ns/cell':>8}{heads}{'off by':>8}",
    ]
    for _, rows in groupby(result.rows, key=lambda row: (row.map, row.size, row.job)):
        lines.append(_line(list(rows)))
    lines += _notes(result)
    return "\n".join(lines)


def values(result: PathsBench) -> list[dict[str, Any]]:
    """Return a flat mapping for each row; times in CPU seconds, lengths in cells."""
    told = {"seed": result.seed, "repeats": result.repeats}
    return [{**told, **asdict(row), "ratio": row.ratio} for row in result.rows]


def _line(rows: Sequence[PathsRow]) -> str:
    first = rows[0]
    beside = {row.reference: row for row in rows}
    cells = "".join(_beside(beside.get(name), width) for name, width in _WIDTHS.items())
    return (
        f"{first.map:<6}{first.size:>5} {first.job:<16}{1e3 * first.ours_s:>8.1f}"
        f"{1e9 * first.ours_s / first.size**2:>8.1f}{cells}{max(row.difference for row in rows):>8.1e}"
    )


def _beside(row: PathsRow | None, width: int) -> str:
    return f"{'-':>{width}}{'-':>7}" if row is None else f"{1e3 * row.reference_s:>{width}.1f}{row.ratio:>6.2f}x"


def _notes(result: PathsBench) -> Iterator[str]:
    for pair in result.energy:
        yield (
            f"{pair.map:<6}{pair.size:>5} energy field {1e3 * pair.energy_s:.1f} ms over 8 headings a cell, of lengths "
            f"{1e3 * pair.length_s:.1f} ms: {pair.per_state:.2f} times per state"
        )
    for (name, size), seconds in result.build_s.items():
        yield f"{name:<6}{size:>5} scipy's graph took {1e3 * seconds:.0f} ms to build, not counted above"
    if result.missing is not None:
        yield f"C is left out: {result.missing}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = Options("paths", "Path costs on grids beside searches in plain C and scipy's csgraph.", repeats=3)
    options.add_maps(64, SIZES)
    chosen = options.chosen(arguments)
    result = bench_paths(sizes=chosen.size or SIZES, seed=chosen.seed, repeats=chosen.repeats, tell=say)
    show(table(result), values(result), chosen.json)
    return 0

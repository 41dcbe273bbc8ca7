"""Path costs beside scipy's `csgraph.dijkstra`, in one process and on the same grids.

Three jobs on two kinds of map: the field of one cell, the cost matrix of K cells, one route from corner to corner.
scipy needs the grid as a sparse graph; building it is timed apart and left out of the ratios. Each figure is the least
CPU time of some repeats, and both sides' results are compared in the same run. The field of least energy, whose search
has 8 states a cell, stands beside the field of lengths.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from marsupial.model.grid import Cell, Mask
from marsupial.model.robots import SQRT2
from marsupial.paths.energy import EnergySearch, MotionCosts
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import route_length

Lengths = npt.NDArray[np.float64]
Result = TypeVar("Result")

ROOM = 32
"""Edge of a room in cells, one wall included."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathsRow:
    """One job on one map: CPU seconds of both, and the largest difference between their results in cells."""

    map: str
    job: str
    ours_s: float
    scipy_s: float
    difference: float

    @property
    def ratio(self) -> float:
        """How many times faster ours is."""
        return self.scipy_s / self.ours_s


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyRow:
    """The fields of least energy and of lengths on one map, in CPU seconds."""

    map: str
    energy_s: float
    length_s: float

    @property
    def per_state(self) -> float:
        """How many times longer a state of the search for least energy takes: it has 8 a cell."""
        return self.energy_s / self.length_s / 8


@dataclass(frozen=True, slots=True, kw_only=True)
class PathsBench:
    """All rows, and per map the CPU seconds scipy's graph took to build."""

    size: int
    cells: int
    seed: int
    repeats: int
    rows: tuple[PathsRow, ...]
    energy: tuple[EnergyRow, ...]
    build_s: tuple[tuple[str, float], ...]


def rand20(size: int, seed: int) -> Mask:
    """Return a square map with 20 % of its cells blocked at random."""
    return np.random.default_rng(seed).random((size, size)) >= 0.2


def rooms(size: int, seed: int) -> Mask:
    """Return a square map of rooms 32 cells wide with a door, one cell wide, in each wall between two."""
    random = np.random.default_rng(seed)
    passable = np.ones((size, size), dtype=np.bool_)
    passable[ROOM - 1 :: ROOM] = False
    passable[:, ROOM - 1 :: ROOM] = False
    for wall in range(ROOM - 1, size, ROOM):
        for room in range(0, size, ROOM):
            doors = np.minimum(room + random.integers(0, ROOM - 1, 2), size - 1)
            passable[wall, doors[0]] = True
            passable[doors[1], wall] = True
    return passable


MAPS: dict[str, Callable[[int, int], Mask]] = {"rand20": rand20, "rooms": rooms}


def bench_paths(size: int = 1024, seed: int = 1, repeats: int = 3, cells: int = 40) -> PathsBench:
    """Time both sides on maps of `size` squared; a matrix is over `cells` cells."""
    rows: list[PathsRow] = []
    energy: list[EnergyRow] = []
    builds: list[tuple[str, float]] = []
    for name, make in MAPS.items():
        passable = make(size, seed)
        graph, build_s = _least_cpu(partial(grid_graph, passable), 1)
        builds.append((name, build_s))
        chosen = _connected_cells(passable, cells, seed)
        rows += _rows(name, passable, graph, chosen, repeats)
        energy.append(_energy_row(name, passable, chosen[0], repeats))
    return PathsBench(
        size=size,
        cells=cells,
        seed=seed,
        repeats=repeats,
        rows=tuple(rows),
        energy=tuple(energy),
        build_s=tuple(builds),
    )


def table(result: PathsBench) -> str:
    """Write a result as text."""
    lines = [
        f"path costs on {result.size} x {result.size} cells, 8-connected, no corner cutting; seed {result.seed}, "
        f"least CPU time of {result.repeats}",
        f"{'map':<8}{'job':<16}{'ours ms':>10}{'scipy ms':>11}{'ratio':>8}{'max difference':>17}",
    ]
    for row in result.rows:
        ours, theirs = 1e3 * row.ours_s, 1e3 * row.scipy_s
        lines.append(f"{row.map:<8}{row.job:<16}{ours:>10.1f}{theirs:>11.1f}{row.ratio:>7.1f}x{row.difference:>17.1e}")
    for pair in result.energy:
        lines.append(
            f"{pair.map:<8}energy field {1e3 * pair.energy_s:.1f} ms over 8 headings a cell, field of lengths "
            f"{1e3 * pair.length_s:.1f} ms: {pair.per_state:.2f} times as long per state"
        )
    for name, seconds in result.build_s:
        lines.append(f"{name:<8}scipy's graph took {1e3 * seconds:.0f} ms to build, not counted above")
    return "\n".join(lines)


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


def _rows(name: str, passable: Mask, graph: csr_array, cells: list[Cell], repeats: int) -> list[PathsRow]:
    search = PathSearch(passable)
    nodes = [cell.y * passable.shape[1] + cell.x for cell in cells]

    def lengths_from(sources: list[int]) -> Lengths:
        return np.asarray(dijkstra(graph, indices=sources))

    def length_of_route() -> Lengths:
        route = search.route(cells[0], cells[1])
        return np.array(np.inf if route is None else route_length(route))

    jobs: tuple[tuple[str, Callable[[], Lengths], Callable[[], Lengths]], ...] = (
        ("field", lambda: search.field(cells[0]).ravel(), lambda: lengths_from(nodes[:1])[0]),
        (
            f"matrix K = {len(cells)}",
            lambda: PathSearch(passable).matrix(cells),  # a search remembers its last one
            lambda: lengths_from(nodes)[:, nodes],
        ),
        ("corner to corner", length_of_route, lambda: lengths_from(nodes[:1])[0, nodes[1]]),
    )
    rows = []
    for job, ours, theirs in jobs:
        our_result, ours_s = _least_cpu(ours, repeats + 1)  # the first may compile
        their_result, scipy_s = _least_cpu(theirs, repeats)
        difference = _largest_difference(our_result, their_result)
        rows.append(PathsRow(map=name, job=job, ours_s=ours_s, scipy_s=scipy_s, difference=difference))
    return rows


def _energy_row(name: str, passable: Mask, source: Cell, repeats: int) -> EnergyRow:
    energies, lengths = EnergySearch(passable, MotionCosts()), PathSearch(passable)
    _, energy_s = _least_cpu(lambda: energies.field(source), repeats + 1)  # the first may compile
    _, length_s = _least_cpu(lambda: lengths.field(source), repeats + 1)
    return EnergyRow(map=name, energy_s=energy_s, length_s=length_s)


def _largest_difference(ours: Lengths, theirs: Lengths) -> float:
    """Return the largest difference in cells; inf where only one side finds a path."""
    finite = np.isfinite(theirs)
    if not np.array_equal(finite, np.isfinite(ours)):
        return float("inf")
    return float(np.max(np.abs(ours[finite] - theirs[finite]), initial=0.0))


def _least_cpu(job: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """Return a job's result and its least CPU time in seconds, at least one tick of the clock."""
    seconds = []
    for _ in range(repeats):
        before = time.process_time()
        result = job()
        seconds.append(time.process_time() - before)
    return result, max(min(seconds), 1e-9)

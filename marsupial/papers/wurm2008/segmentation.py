"""Segments of a partly known map: rooms, corridors, or parts of them, that lead into the unknown.

    #############      1. the Voronoi graph runs in the middle between walls   (voronoi.py)
    #     #     #      2. narrow points (x) have a local minimum of clearance
    #  +--x--+  ?      3. critical ones cut the graph into pieces
    #     #     ?      4. each cell joins the segment of the nearest piece
    #############

The Voronoi graph is cut at its critical points, and each known drivable cell belongs to the nearest part of the graph,
in straight steps over the ground. A critical point is a minimum of the clearance along the graph, such as in a doorway,
if

- it has degree 2,
- its neighbour along the graph, of all narrow points, junctions and ends, is a junction, and
- it leads into the unknown: beyond it there is something to explore without passing another such point.

Without critical points, connected ground is one segment.

References: Wurm, Stachniss, Burgard, IROS 2008, section IV, Eq. 3, Fig. 3.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from marsupial.arrays import Flags, Floats, Ints, Ints32
from marsupial.maps.reach import parts
from marsupial.model.grid import Grid, Mask, code_table
from marsupial.native import native
from marsupial.papers.wurm2008.voronoi import Blocks, VoronoiGraph, voronoi_graph

RISE = 1.3  # a point is narrow if the clearance rises by this factor on both sides; less comes from uneven walls


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segmentation:
    """The segments of a map, with the intermediate results."""

    labels: Ints32  # (height, width): the segment of each known drivable cell, from 1; 0 for other cells
    count: int  # number of segments
    # blocks, graph: the map in blocks and its Voronoi graph
    blocks: Blocks
    graph: VoronoiGraph
    # critical, dismissed: blocks (row-major) of the critical points, and of those dismissed since they lead to no
    # unknown cells
    critical: Ints
    dismissed: Ints


class _Cuts(NamedTuple):
    """Candidates for critical points, ascending."""

    place: Ints  # (c,): position in the graph's `inner`
    edge: Ints  # (c,): its edge
    # from_start, from_end: (c,): whether it is next to a junction at the first, or second, end of its edge
    from_start: Flags
    from_end: Flags


def segment(grid: Grid, terrains: frozenset[int], frontier: Ints | None = None) -> Segmentation:
    """Return the segments of a map.

    `terrains`: terrain codes that robots drive on; other known cells are obstacles.
    `frontier`: the cells (row-major indices) with something left to explore. If None, critical points need not lead
    into the unknown, so that all rooms are segments.
    """
    space = Blocks.of(grid, terrains)
    drivable = code_table(terrains)[grid.cells[space.window.cut]]
    graph = voronoi_graph(space)
    cuts = _narrow(graph, space.clearance)
    sources, pieces = _sources(graph, cuts, space, drivable)
    # piece by cell; cells that no source reaches have source -1, which picks the appended -1
    source = _nearest(drivable.ravel(), drivable.shape[1], sources)
    piece = np.append(pieces, -1)[source]
    links = np.concatenate([_links(graph, cuts), _bridges(graph, cuts, piece, drivable.shape[1])])
    # a narrow point is critical only if its far side, seen from the junction, leads to a frontier
    critical = np.ones(len(cuts.place), dtype=np.bool_)
    if frontier is not None:
        component = _components(graph, cuts, links)
        leads = np.zeros(len(component) + 1, dtype=np.bool_)
        reached = piece[space.window.inside(frontier, grid.width)]
        leads[component[reached[reached >= 0]]] = True
        before, after = leads[component[_beside(graph, cuts)]].T
        critical = (cuts.from_start & after) | (cuts.from_end & before)
    # dismissed points separate nothing: join the pieces on both sides
    component = _components(graph, cuts, np.concatenate([links, _beside(graph, cuts)[~critical]]))
    found, count = _labels(drivable, sources, source, component[pieces])
    labels = np.zeros(grid.cells.shape, dtype=np.int32)
    labels[space.window.cut] = found
    points = graph.inner[cuts.place]
    return Segmentation(
        labels=labels, count=count, blocks=space, graph=graph, critical=points[critical], dismissed=points[~critical]
    )


def _narrow(graph: VoronoiGraph, clearance: Floats) -> _Cuts:
    first, last = _narrowest(graph.ends, graph.bounds, clearance.ravel()[graph.nodes], clearance.ravel()[graph.inner])
    junction = graph.degrees[graph.ends] >= 3
    starts, ends = first[junction[:, 0] & (first >= 0)], last[junction[:, 1] & (last >= 0)]
    place = np.union1d(starts, ends)
    return _Cuts(
        place=place,
        edge=np.searchsorted(graph.bounds, place, side="right") - 1,
        from_start=np.isin(place, starts),
        from_end=np.isin(place, ends),
    )


def _sources(graph: VoronoiGraph, cuts: _Cuts, space: Blocks, drivable: Mask) -> tuple[Ints, Ints]:
    """Return a drivable cell of each block of the graph that has one, and its piece of the graph."""
    # Pieces are the nodes, then for each edge its parts between cuts, in order.
    nodes, inner = len(graph.nodes), np.arange(len(graph.inner))
    edge = np.repeat(np.arange(len(graph.ends)), np.diff(graph.bounds))
    pieces = np.concatenate([np.arange(nodes), nodes + edge + np.searchsorted(cuts.place, inner, side="right")])
    cells = space.cells(np.concatenate([graph.nodes, graph.inner]))
    free = drivable.ravel()[cells]
    some = free.any(axis=1)
    return cells[some, free[some].argmax(axis=1)], pieces[some]


def _links(graph: VoronoiGraph, cuts: _Cuts) -> Ints:
    """Return the pairs (n, 2) of pieces linked at nodes: the ends of an edge with its first and last piece."""
    edges = np.arange(len(graph.ends))
    first, last = (edges + np.searchsorted(cuts.edge, edges, side=side) for side in ("left", "right"))
    beside = len(graph.nodes) + np.stack([first, last], axis=1)
    return np.stack([graph.ends.ravel(), beside.ravel()], axis=1)


def _beside(graph: VoronoiGraph, cuts: _Cuts) -> Ints:
    """Return the pieces (c, 2) before and after each cut."""
    before = len(graph.nodes) + cuts.edge + np.arange(len(cuts.place))
    return np.stack([before, before + 1], axis=1)


def _components(graph: VoronoiGraph, cuts: _Cuts, links: Ints) -> Ints:
    """Return the number of the connected component of each piece, from 0 on."""
    count = len(graph.nodes) + len(graph.ends) + len(cuts.place)
    linked = csr_array((np.ones(len(links), dtype=np.bool_), links.T), shape=(count, count))
    return np.asarray(connected_components(linked, directed=False)[1], dtype=np.int64)


def _bridges(graph: VoronoiGraph, cuts: _Cuts, piece: Ints, width: int) -> Ints:
    """Return the pairs (n, 2) of pieces that join parts which no narrow point separates."""
    # Parts of the graph that are linked only through the unknown are joined where their ground has the longest border.
    links = _links(graph, cuts)
    room = _components(graph, cuts, links)
    _, member = np.unique(room, return_index=True)
    whole = _components(graph, cuts, np.concatenate([links, _beside(graph, cuts)]))[member]
    borders = _borders(piece, room, whole, width)
    pairs, lengths = np.unique(borders, axis=0, return_counts=True)
    bridges = []
    # as in Kruskal's algorithm: longest borders first, skipping parts that are joined already
    for a, b in pairs[np.argsort(-lengths, kind="stable")].tolist():
        if whole[a] != whole[b]:
            whole[whole == whole[b]] = whole[a]
            bridges.append((member[a], member[b]))
    return np.array(bridges, dtype=np.int64).reshape(-1, 2)


def _labels(drivable: Mask, sources: Ints, source: Ints32, component: Ints) -> tuple[Ints32, int]:
    """Return the segment of each cell (height, width), and the number of segments."""
    # Segments are the components of the graph, by source, and connected ground without a part of the graph; none spans
    # two separate parts of the ground.
    part, most = parts(drivable)
    keys, label = np.unique(component * (most + 1) + part.ravel()[sources], return_inverse=True)
    labels: Ints32 = np.append(label + 1, 0).astype(np.int32)[source].reshape(drivable.shape)
    rest, more = parts(drivable & (labels == 0))
    return np.where(rest > 0, rest + len(keys), labels).astype(np.int32) if more else labels, len(keys) + more


@native
def _nearest(drivable: Flags, width: int, sources: Ints) -> Ints32:
    """Return for each cell, row-major, the position in `sources` of the nearest one in straight steps, -1 for none."""
    found = np.full(drivable.size, -1, dtype=np.int32)
    queue = np.empty(drivable.size, dtype=np.int64)
    tail = 0
    for k in range(len(sources)):
        found[sources[k]] = k
        queue[tail] = sources[k]
        tail += 1
    head = 0
    while head < tail:
        cell = queue[head]
        head += 1
        x = cell % width
        for side in range(4):
            other = cell + (1, width, -1, -width)[side]
            if (side == 0 and x == width - 1) or (side == 2 and x == 0) or other < 0 or other >= drivable.size:
                continue
            if drivable[other] and found[other] < 0:
                found[other] = found[cell]
                queue[tail] = other
                tail += 1
    return found


@native
def _narrowest(ends: Ints, bounds: Ints, at_nodes: Floats, at_inner: Floats) -> tuple[Ints, Ints]:
    """Return the first and the last narrow point of each edge as positions in `inner`, -1 for none."""
    # Of adjacent equally narrow positions the middle one counts. `at_nodes` and `at_inner` are clearances.
    first = np.full(len(ends), -1, dtype=np.int64)
    last = first.copy()
    for edge in range(len(ends)):
        begin, end = bounds[edge], bounds[edge + 1]
        # `extreme` is the highest clearance while it rises, the lowest after a fall by the factor RISE
        falls = False
        extreme = at_nodes[ends[edge, 0]]
        left = right = begin
        for place in range(begin, end + 1):
            value = at_inner[place] if place < end else at_nodes[ends[edge, 1]]
            if not falls:
                extreme = max(extreme, value)
                if value * RISE < extreme:
                    falls, extreme, left, right = True, value, place, place
            elif value < extreme:
                extreme, left, right = value, place, place
            elif value == extreme:
                right = place
            elif value > RISE * extreme:  # it has risen again: the minimum in between is a narrow point
                last[edge] = (left + right) // 2
                if first[edge] < 0:
                    first[edge] = last[edge]
                falls, extreme = False, value
    return first, last


@native
def _borders(piece: Ints, room: Ints, whole: Ints, width: int) -> Ints:
    """Return a pair (n, 2) of rooms, lower first, for each pair of adjacent cells in different wholes."""
    # `piece` is the piece of each cell, -1 for none; `room` the room of each piece, `whole` the whole of each room.
    found = np.empty((2 * len(piece), 2), dtype=np.int64)
    count = 0
    for cell in range(len(piece)):
        if piece[cell] < 0:
            continue
        here = room[piece[cell]]
        for step in (1, width):
            other = cell + step
            if other >= len(piece) or piece[other] < 0 or (step == 1 and other % width == 0):
                continue
            there = room[piece[other]]
            if whole[here] != whole[there]:
                found[count, 0], found[count, 1] = min(here, there), max(here, there)
                count += 1
    return found[:count].copy()

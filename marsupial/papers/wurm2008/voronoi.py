"""The Voronoi graph of a partly known map: the points with equally near obstacles on two sides.

The graph is the skeleton of the open space, computed by thinning in blocks of about 10 cm, which keeps doors and is
fast. Unknown cells up to `UNSEEN_M` from known ones count as open: a frontier is no wall, and a door seen from one side
has both its posts. Small obstacles such as furniture bound no room and are ignored. The graph is the part of the
skeleton on known ground, without branches into mere corners.

References: Wurm, Stachniss, Burgard, IROS 2008, section IV, Eqs. 1 and 2, Figs. 2 and 3. It does not say which branches
to prune; ours is the rule of Attali, Sanniti di Baja and Thiel: Skeleton simplification through non significant branch
removal, Image Processing and Communications 3, 1997: by how far the disc at a branch's end stands out of the disc where
the branch is widest, which mostly is where it begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from marsupial.arrays import Floats, Ints
from marsupial.maps.window import Window
from marsupial.model.grid import UNKNOWN, Grid, Mask, code_table
from marsupial.native import native

BLOCK_M = 0.1  # side of a block: a door is about eight wide, and thinning costs a tenth of that on 5 cm cells

UNSEEN_M = 1.5
"""How far the unknown counts as open: about half a corridor's width, so that the graph stays straight at frontiers."""

CLUTTER_M = 0.5  # largest extent of an ignored obstacle: legs of tables, chairs, bins, people

PROTRUSION = 0.5
"""A branch is pruned beyond its widest point if it stands out from there by less than this share of its clearance.

The share is sqrt(2) - 1 in the square corner of a room, and about 1 through a door.
"""

_TOUCHING: Mask = np.ones((3, 3), dtype=np.bool_)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blocks:
    """The known part of a map and its margin, in square blocks of cells; arrays are (rows, columns) of blocks."""

    scale: int  # cells along the edge of a block
    # row, column: row and column on the map of the first block; -1 for the closed border around the map
    row: int
    column: int
    window: Window  # the cells of the map in these blocks
    known: Mask  # blocks of known ground: without a wall, and at least half drivable or with clutter
    open: Mask  # known blocks, and unknown ones that count as open
    # distance between the centres of a block and of the closest wall, in blocks; the whole extent without any wall
    clearance: Floats

    @classmethod
    def of(cls, grid: Grid, terrains: frozenset[int]) -> Blocks:
        """Return the blocks of a map; known cells of other terrain codes are obstacles."""
        scale = max(1, round(BLOCK_M / grid.resolution_m))
        block_m = scale * grid.resolution_m
        margin = max(1, round(UNSEEN_M / block_m))
        cut = _Cut.around(grid.cells != UNKNOWN, scale, margin + 1)
        window = cut.window(grid)
        cells = grid.cells[window.cut]
        drivable = code_table(terrains)[cells]
        blocked = cut.cells_in((cells != UNKNOWN) & ~drivable, window, outside=True) > 0
        # a block with any obstacle is a wall: at this size walls of a single cell must not vanish
        wall = blocked & ~_clutter(blocked, CLUTTER_M / block_m)
        ground = 2 * cut.cells_in(drivable, window, outside=False) >= scale * scale
        known = (blocked | ground) & ~wall
        extent = float(max(wall.shape))
        return cls(
            scale=scale,
            row=cut.bottom,
            column=cut.left,
            window=window,
            known=known,
            open=ndimage.binary_dilation(known, _TOUCHING, iterations=margin, mask=~wall),
            clearance=ndimage.distance_transform_edt(~wall) if wall.any() else np.full(wall.shape, extent),
        )

    def cells(self, blocks: Ints) -> Ints:
        """Return the cells (row-major in the window) of known blocks, (n, scale * scale), the middle ones first."""
        y, x = np.divmod(blocks, self.known.shape[1])
        v, u = np.divmod(np.arange(self.scale**2), self.scale)
        middle = (self.scale - 1) / 2
        order = np.argsort(np.hypot(v - middle, u - middle), kind="stable")
        rows = ((y + self.row) * self.scale - self.window.bottom)[:, None] + v[order]
        columns = ((x + self.column) * self.scale - self.window.left)[:, None] + u[order]
        return rows * (self.window.right - self.window.left) + columns

    def xy(self, blocks: Ints) -> tuple[Floats, Floats]:
        """Return the centres of blocks, in cells from the lower left corner of the map."""
        y, x = np.divmod(blocks, self.known.shape[1])
        return (x + self.column + 0.5) * self.scale, (y + self.row + 0.5) * self.scale


class _Cut(NamedTuple):
    """Rows `bottom` up to `top` of blocks, columns `left` up to `right`, both ends excluded."""

    bottom: int
    top: int
    left: int
    right: int
    scale: int

    @classmethod
    def around(cls, seen: Mask, scale: int, margin: int) -> _Cut:
        """Return the blocks with a known cell and a margin, up to one block beyond the map."""
        rows, columns = (np.flatnonzero(seen.any(axis=axis)) // scale for axis in (1, 0))
        if not len(rows):
            return cls(0, 1, 0, 1, scale)
        top, right = (-(-cells // scale) for cells in seen.shape)
        return cls(
            max(-1, int(rows[0]) - margin), min(top, int(rows[-1]) + margin) + 1,
            max(-1, int(columns[0]) - margin), min(right, int(columns[-1]) + margin) + 1,
            scale,
        )  # fmt: skip

    def window(self, grid: Grid) -> Window:
        """Return the cells of a map in these blocks."""
        return Window(
            max(0, self.bottom) * self.scale, min(grid.height, self.top * self.scale),
            max(0, self.left) * self.scale, min(grid.width, self.right * self.scale),
        )  # fmt: skip

    def cells_in(self, mask: Mask, window: Window, *, outside: bool) -> Ints:
        """Return the number of set cells of a mask per block; cells beyond the map count as `outside`."""
        rows, columns = (self.top - self.bottom) * self.scale, (self.right - self.left) * self.scale
        y, x = window.bottom - self.bottom * self.scale, window.left - self.left * self.scale
        cells = np.full((rows, columns), outside, dtype=np.bool_)
        cells[y : y + mask.shape[0], x : x + mask.shape[1]] = mask
        total = np.zeros((rows // self.scale, columns // self.scale), dtype=np.int64)
        for v in range(self.scale):
            for u in range(self.scale):
                total += cells[v :: self.scale, u :: self.scale]
        return total


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoronoiGraph:
    """A graph whose nodes are junctions and ends and whose edges are strings of blocks of degree 2.

    Blocks are linked to their eight neighbours, but not diagonally if straight links connect the two.
    """

    # nodes, degrees: (n,): block index (row-major in `Blocks`) and number of links of each node. A ring without a
    # junction has one node, of degree 2.
    nodes: Ints
    degrees: Ints
    ends: Ints  # (m, 2) positions in `nodes` of the two ends of each edge
    # the inner blocks of edge e, from its first end to its second, are inner[bounds[e]:bounds[e + 1]]
    bounds: Ints
    inner: Ints


def voronoi_graph(space: Blocks) -> VoronoiGraph:
    """Return the pruned Voronoi graph of a map in blocks."""
    from skimage.morphology import skeletonize  # its import takes a tenth of a second

    skeleton: Mask = skeletonize(space.open) & space.known
    clearance, width = space.clearance.ravel(), space.known.shape[1]
    # pruning turns junctions into inner blocks, which makes longer branches: repeat until none is insignificant
    while True:
        graph = _traced(skeleton)
        pruned = _insignificant(graph.nodes, graph.degrees, graph.ends, graph.bounds, graph.inner, clearance, width)
        if not len(pruned):
            return graph
        skeleton.ravel()[pruned] = False
        skeleton = skeletonize(skeleton)  # a crossing without branches is left as a ring of four blocks


def _clutter(blocked: Mask, extent: float) -> Mask:
    """Return the blocks of obstacles off the rim whose extent on both axes is at most this, in blocks."""
    labels, _ = ndimage.label(blocked, _TOUCHING)
    small = [max(y.stop - y.start, x.stop - x.start) <= extent + 1e-9 for y, x in ndimage.find_objects(labels)]
    table = np.array([False, *small])
    for rim in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        table[rim] = False
    return table[labels]


def _traced(skeleton: Mask) -> VoronoiGraph:
    """Return the graph of a skeleton, which has no blocks on the rim."""
    width, there = skeleton.shape[1], skeleton.ravel()
    blocks = np.flatnonzero(there)
    # from a block to those around it, counter-clockwise from east: every second one is diagonal
    around = np.array([1, width + 1, width, width - 1, -1, -width - 1, -width, 1 - width])
    linked = there[blocks[:, None] + around]
    linked[:, 1::2] &= ~(linked[:, ::2] | np.roll(linked[:, ::2], -1, axis=1))
    links = np.where(linked, np.searchsorted(blocks, blocks[:, None] + around), -1)
    nodes, ends, bounds, inner = _trace(links)
    degrees = np.count_nonzero(linked[nodes], axis=1)
    return VoronoiGraph(nodes=blocks[nodes], degrees=degrees, ends=ends, bounds=bounds, inner=blocks[inner])


@native
def _trace(links: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Return nodes, ends, bounds and inner blocks of a graph by the blocks linked to each, (n, 8), -1 for none."""
    count = len(links)
    degrees = (links >= 0).sum(axis=1)
    nodes, number = np.empty(count, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    ends, bounds = np.empty((degrees.sum() // 2, 2), dtype=np.int64), np.zeros(degrees.sum() // 2 + 1, dtype=np.int64)
    inner, traced = np.empty(count, dtype=np.int64), np.zeros(count, dtype=np.bool_)
    known = edges = filled = 0
    for block in np.flatnonzero(degrees != 2):
        nodes[known], number[block] = block, known
        known += 1
    for start in np.concatenate((nodes[:known].copy(), np.arange(count))):
        if traced[start]:
            continue
        traced[start] = True
        if number[start] < 0:  # a ring without a junction gets a node here
            nodes[known], number[start] = start, known
            known += 1
        for first in links[start]:
            if first < 0 or traced[first]:  # traced from the other end
                continue
            before, block = start, first
            while number[block] < 0:
                traced[block] = True
                inner[filled] = block
                filled += 1
                for after in links[block]:
                    if after >= 0 and after != before:
                        before, block = block, after
                        break
            ends[edges, 0], ends[edges, 1] = number[start], number[block]
            edges += 1
            bounds[edges] = filled
    return nodes[:known].copy(), ends[:edges].copy(), bounds[: edges + 1].copy(), inner[:filled].copy()


@native
def _insignificant(
    nodes: Ints, degrees: Ints, ends: Ints, bounds: Ints, inner: Ints, clearance: Floats, width: int
) -> Ints:
    """Return the blocks to prune: the part of each branch beyond its widest point, if it hardly stands out."""
    # A branch is an edge from a junction to an end. The clearances of blocks are row-major in rows of `width`.
    found = np.empty(len(nodes) + len(inner), dtype=np.int64)
    count = 0
    for edge in range(len(ends)):
        start, leaf = ends[edge]
        if degrees[start] == 1:
            start, leaf = leaf, start
        if degrees[leaf] != 1 or degrees[start] == 1:
            continue
        first, step = bounds[edge], 1
        if leaf == ends[edge, 0]:
            first, step = bounds[edge + 1] - 1, -1
        length = bounds[edge + 1] - bounds[edge]
        widest, beyond = nodes[start], 0
        for k in range(length):
            block = inner[first + step * k]
            if clearance[block] >= clearance[widest]:
                widest, beyond = block, k + 1
        end = nodes[leaf]
        dy, dx = end // width - widest // width, end % width - widest % width
        stands_out = math.hypot(dy, dx) + clearance[end] - clearance[widest]
        if clearance[end] < clearance[widest] and stands_out < PROTRUSION * clearance[widest]:
            for k in range(beyond, length):
                found[count] = inner[first + step * k]
                count += 1
            found[count] = end
            count += 1
    return found[:count].copy()

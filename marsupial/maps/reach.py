"""Connected areas of a map.

A diagonal step needs both shared orthogonal neighbours, so the areas connected for a robot are the four-connected parts
of the cells it may stand on.
"""

import numpy as np

from marsupial.arrays import Ints, Ints32
from marsupial.maps.footprint import footprint_of
from marsupial.model import Grid, Mask, RobotType
from marsupial.native import inlined, native


def parts(mask: Mask) -> tuple[Ints32, int]:
    """Return the labels (height, width) of connected parts, from 1 in the order of first cells, and their number."""
    labels = np.zeros(mask.shape, dtype=np.int32)
    return labels, _label(mask, labels, np.empty(mask.size, dtype=np.int32))


def groups(cells: Ints, shape: tuple[int, int]) -> list[Ints]:
    """Return the groups (ascending) of `cells` (row-major, each once) that touch, corners included, by first cell."""
    found, ends = np.empty((2, len(cells)), dtype=np.int64)
    count = _group(np.sort(cells), *shape, found, ends)
    return [np.sort(group) for group in np.split(found, ends[: count - 1])] if count else []


@native
def middle(cells: Ints, width: int) -> int:
    """Return the cell nearest to the centroid of some cells, the first if several are."""
    x = y = 0
    for index in cells:
        x += index % width
        y += index // width
    best, nearest = cells[0], np.inf
    for index in cells:
        apart = (index % width - x / cells.size) ** 2 + (index // width - y / cells.size) ** 2
        if apart < nearest:
            best, nearest = index, apart
    return best


def largest_reach(grid: Grid, kind: RobotType) -> Mask:
    """Return the mask of the largest connected area where a robot of type `kind` may stand (possibly empty)."""
    labels, count = parts(footprint_of(grid, kind).standable)
    if count == 0:
        return np.zeros(grid.cells.shape, dtype=np.bool_)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(labels == int(np.argmax(sizes)))


@native
def _group(cells: Ints, height: int, width: int, found: Ints, ends: Ints) -> int:
    """Write the groups of ascending `cells` one after the other, and their ends; return their number."""
    left = np.ones(cells.size, dtype=np.bool_)
    head = tail = count = 0
    for k in range(cells.size):
        if not left[k]:
            continue
        left[k] = False
        found[tail] = cells[k]
        tail += 1
        while head < tail:
            y, x = found[head] // width, found[head] % width
            head += 1
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    near = _position(cells, v * width + u)
                    if near < cells.size and left[near] and cells[near] == v * width + u:
                        left[near] = False
                        found[tail] = cells[near]
                        tail += 1
        ends[count] = tail
        count += 1
    return count


@inlined
def _position(cells: Ints, cell: int) -> int:
    """Return the insertion point of a cell in ascending ones; numba's `searchsorted` takes long to compile."""
    low, high = 0, cells.size
    while low < high:
        middle = (low + high) // 2
        if cells[middle] < cell:
            low = middle + 1
        else:
            high = middle
    return low


@native
def _label(mask: Mask, labels: Ints32, queue: Ints32) -> int:
    height, width = mask.shape
    count = 0
    for y in range(height):
        for x in range(width):
            if mask[y, x] and not labels[y, x]:
                count += 1
                labels[y, x] = count
                queue[0] = y * width + x
                spread(mask, labels, count, queue, 1)
    return count


@native
def spread(mask: Mask, marks: Mask | Ints32, mark: int, queue: Ints32, tail: int) -> int:
    """Mark all cells connected within `mask` to the `tail` ones in `queue`, already marked; return the new tail."""
    height, width = mask.shape
    head = 0
    while head < tail:
        y, x = queue[head] // width, queue[head] % width
        head += 1
        for direction in range(4):
            u = x + (1 if direction == 0 else -1 if direction == 1 else 0)
            v = y + (1 if direction == 2 else -1 if direction == 3 else 0)
            if 0 <= u < width and 0 <= v < height and mask[v, u] and not marks[v, u]:
                marks[v, u] = mark
                queue[tail] = v * width + u
                tail += 1
    return tail

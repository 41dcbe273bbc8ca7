"""Distances between cells by jumps from corner to corner, on ground that is kept in bits.

Of all shortest ways between two cells one turns only where it passes a corner of something closed, but for one turn
after diagonal steps. So a search need not settle every cell: it runs along rows, columns and diagonals, 64 cells of a
row or column in a few instructions, and goes on from the corners it passes. What turns are left out, and why that costs
nothing, is said at `marsupial.paths.kernels.flood`.

References
----------
Harabor and Grastien, Online Graph Pruning for Pathfinding on Grid Maps, AAAI 2011; Improving Jump Point Search, ICAPS
2014, section 3 (rows in blocks of bits).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from marsupial.arrays import Bytes, Floats, Ints, Ints32, Words
from marsupial.model.grid import Mask
from marsupial.native import inlined, native, outlined
from marsupial.paths.kernels import TOLERANCE

FRAME = 64
"""How many closed cells there are before the first one of a row or column of bits; some are after the last one."""

_ONE, _NONE, _ALL = np.uint64(1), np.uint64(0), np.uint64(0xFFFFFFFFFFFFFFFF)
_SHIFT, _LAST = np.uint64(6), np.uint64(63)

_EAST, _SOUTH, _WEST, _NORTH = 0, 2, 4, 6
"""Directions: digits of steps, as everywhere (`marsupial.paths.routes`)."""


class _OpenBits(NamedTuple):
    """What is open, as bits: cell (x, y) is bit x + `FRAME` of line y + 1 of the rows, and so for columns.

    Attributes
    ----------
    rows, columns
        Whether a cell is open.
    row_goals, column_goals
        Whether its distance is asked for.
    width
        Of the map.
    diagonal
        The length of a diagonal step.
    """

    rows: Words
    columns: Words
    row_goals: Words
    column_goals: Words
    width: int
    diagonal: float


class _OpenLine(NamedTuple):
    """A row or column of the ground: what is open, what is a goal, and its number.

    Attributes
    ----------
    first, apart
        The row-major index of its first cell, and how far apart those of its cells are.
    """

    bits: Words
    goals: Words
    number: int
    first: int
    apart: int


class _JumpSearch(NamedTuple):
    """What a search knows of each cell, row-major, and the corners it has to go on from, in buckets of width 1.

    Attributes
    ----------
    cost, found, arrived
        The distance of a cell, which holds if `found` is the number of this search; the bits of the directions in
        which a corner was arrived at by such a way.
    heads
        (buckets,): a ring, longer than any jump; the last entry of each bucket, and one more.
    next, cell, turn, length
        The entries: the one before it in its bucket, and one more; a corner, how it is arrived at, how far it is.
    counts
        (4,): see `_SEARCHES`.
    """

    cost: Floats
    found: Ints32
    arrived: Bytes
    heads: Ints32
    next: Ints32
    cell: Ints32
    turn: Bytes
    length: Floats
    counts: Ints


_SEARCHES, _ENTRIES, _WAITING, _STEPS = range(4)
"""In `_JumpSearch.counts`: the number of this search, of its entries, of those not done, and of its diagonal steps."""


class JumpMemory:
    """What searches on masks of one shape (height, width) take down in turn; several `Jumps` may share it."""

    def __init__(self, shape: tuple[int, int]) -> None:
        height, width = shape
        size = height * width
        self.state = _JumpSearch(
            cost=np.empty(size, dtype=np.float64),
            found=np.zeros(size, dtype=np.int32),
            arrived=np.empty(size, dtype=np.uint8),
            heads=np.zeros(1 << (2 * (height + width)).bit_length(), dtype=np.int32),
            **_entries(64 + 16 * (height + width)),
            counts=np.zeros(4, dtype=np.int64),
        )


class Jumps:
    """Searches on one mask, which may change between calls. Not for use by two threads at once.

    Parameters
    ----------
    shape
        Of the mask, (height, width).
    diagonal
        The length of a diagonal step, 1 to sqrt 2.
    memory
        Shared with others, none of which is used at the same time; None for its own.
    """

    def __init__(self, shape: tuple[int, int], diagonal: float, memory: JumpMemory | None = None) -> None:
        height, width = shape
        rows, columns = (height + 2, (width + FRAME) // 64 + 1), (width + 2, (height + FRAME) // 64 + 1)
        self._ground = _OpenBits(
            rows=np.zeros(rows, dtype=np.uint64),
            columns=np.zeros(columns, dtype=np.uint64),
            row_goals=np.zeros(rows, dtype=np.uint64),
            column_goals=np.zeros(columns, dtype=np.uint64),
            width=width,
            diagonal=diagonal,
        )
        self._memory = memory or JumpMemory(shape)

    @property
    def steps(self) -> int:
        """How many diagonal steps the last search took, which is what its time goes with."""
        return int(self._memory.state.counts[_STEPS])

    def load(self, passable: Mask) -> Ints | None:
        """Take over which cells are open now; return those newly so, row-major, or None if any is closed again."""
        width = self._ground.width
        lines = self._ground.rows[1:-1].view(np.uint8)[:, FRAME // 8 : FRAME // 8 + (width + 7) // 8]
        bits = np.packbits(passable, axis=1, bitorder="little")
        y, byte = np.nonzero(bits != lines)
        if not y.size:
            return np.empty(0, dtype=np.int64)
        before, now = (np.unpackbits(each[y, byte, None], axis=1, bitorder="little") for each in (lines, bits))
        lines[y, byte] = bits[y, byte]
        which, bit = np.nonzero(before != now)
        cells = y[which] * width + byte[which] * 8 + bit
        _flip(self._ground.columns, cells, width, False)
        return None if before[which, bit].any() else cells.astype(np.int64)

    def open(self, cells: Ints) -> None:
        """Take in that these cells (n,), closed until now, are open."""
        _flip(self._ground.columns, cells, self._ground.width, False)
        _flip(self._ground.rows, cells, self._ground.width, True)

    def costs(self, source: int, wanted: Ints) -> Floats:
        """Return the distances (n,) of n open cells from an open one, all row-major; inf where there is no way."""
        memory = self._memory
        while not _search(self._ground, memory.state, source, wanted):
            memory.state = memory.state._replace(**_entries(4 * len(memory.state.cell)))
        reached = memory.state.found[wanted] == memory.state.counts[_SEARCHES]
        return np.where(reached, memory.state.cost[wanted], np.inf)


def _entries(count: int) -> dict[str, Any]:
    kinds: dict[str, npt.DTypeLike] = {"next": np.int32, "cell": np.int32, "turn": np.uint8, "length": np.float64}
    return {name: np.empty(count, dtype=kind) for name, kind in kinds.items()}


def _counting(count: Callable[[Any, Any], Any]) -> Any:
    """Return a function of a word that isn't 0, by the processor's instruction for it."""

    def typed(context: Any, word: Any) -> Any:
        return types.uint64(types.uint64), lambda context, builder, signature, words: count(builder, words[0])

    return intrinsic(typed)


_lowest = _counting(lambda builder, word: builder.cttz(word, ir.Constant(ir.IntType(1), 1)))
_highest = _counting(
    lambda builder, word: builder.xor(
        builder.ctlz(word, ir.Constant(ir.IntType(1), 1)), ir.Constant(ir.IntType(64), 63)
    )
)


@native
def _flip(lines: Words, cells: Ints, width: int, rows: bool) -> None:
    """Change the bits of cells in rows or columns."""
    for index in cells:
        y, x = index // width, index % width
        line, bit = (y, np.uint64(x + FRAME)) if rows else (x, np.uint64(y + FRAME))
        lines[line + 1, bit >> _SHIFT] ^= _ONE << (bit & _LAST)


@native
def _search(ground: _OpenBits, state: _JumpSearch, source: int, wanted: Ints) -> bool:
    """Find the distances of cells from a source; say whether there was room for all entries."""
    state.counts[_SEARCHES] += 1
    state.counts[_ENTRIES] = state.counts[_WAITING] = state.counts[_STEPS] = 0
    for bucket in range(len(state.heads)):
        state.heads[bucket] = 0
    for goal in wanted:
        _mark(ground, goal, True)
    room = _spread(ground, state, source, wanted)
    for goal in wanted:
        _mark(ground, goal, False)
    return room


@inlined
def _mark(ground: _OpenBits, goal: int, on: bool) -> None:
    x, y = goal % ground.width, goal // ground.width
    _set(ground.row_goals, y, x, on)
    _set(ground.column_goals, x, y, on)


@inlined
def _set(lines: Words, line: int, at: int, on: bool) -> None:
    word, bit = np.uint64(at + FRAME) >> _SHIFT, _ONE << (np.uint64(at) & _LAST)
    if on:
        lines[line + 1, word] |= bit
    else:
        lines[line + 1, word] &= ~bit


@inlined
def _spread(ground: _OpenBits, state: _JumpSearch, source: int, wanted: Ints) -> bool:
    x, y = source % ground.width, source // ground.width
    _enter(state, source, 0.0)
    for turn in range(8):
        _go(ground, state, x, y, turn, 0.0)
    level, left = 0, len(wanted)
    while state.counts[_WAITING] > 0:
        while left > 0 and _known(state, wanted[left - 1]) < level + 1.0:
            left -= 1
        if left == 0:
            return True
        bucket = level & (len(state.heads) - 1)
        entry = state.heads[bucket]
        state.heads[bucket] = 0
        while entry > 0:
            if state.counts[_ENTRIES] + 64 + 4 * (len(ground.rows) + len(ground.columns)) > len(state.cell):
                return False
            cell, length, turn = _number(state.cell[entry - 1]), state.length[entry - 1], state.turn[entry - 1]
            entry = state.next[entry - 1]
            state.counts[_WAITING] -= 1
            if length <= _known(state, cell) + TOLERANCE:
                _turn(ground, state, cell, _number(turn), length)
        level += 1
    return True


@inlined
def _number(word: np.uint64) -> int:
    return np.int64(word)  # type: ignore[return-value]


@inlined
def _known(state: _JumpSearch, cell: int) -> float:
    return state.cost[cell] if state.found[cell] == state.counts[_SEARCHES] else np.inf


@inlined
def _enter(state: _JumpSearch, cell: int, length: float) -> bool:
    """Enter the distance of a cell unless it is known to be as short; say whether it was entered."""
    shorter = length < _known(state, cell) - TOLERANCE
    if shorter:
        state.cost[cell], state.found[cell], state.arrived[cell] = length, state.counts[_SEARCHES], 0
    return shorter


@inlined
def _note(state: _JumpSearch, cell: int, turn: int, length: float) -> None:
    """Note a corner to go on from, unless it was arrived at in the same direction or by a shorter way."""
    bit = np.uint8(1 << turn)
    if not _enter(state, cell, length) and (length > state.cost[cell] + TOLERANCE or state.arrived[cell] & bit):
        return
    state.arrived[cell] |= bit
    entry, bucket = state.counts[_ENTRIES], int(length) & (len(state.heads) - 1)
    state.cell[entry], state.turn[entry], state.length[entry] = cell, turn, length
    state.next[entry] = state.heads[bucket]
    state.heads[bucket] = entry + 1
    state.counts[_ENTRIES] += 1
    state.counts[_WAITING] += 1


@inlined
def _turn(ground: _OpenBits, state: _JumpSearch, cell: int, turn: int, length: float) -> None:
    """Go on from a corner that was arrived at in a straight line: ahead, and to the sides that have opened there."""
    x, y = cell % ground.width, cell // ground.width
    _go(ground, state, x, y, turn, length)
    for side in range(-1, 2, 2):
        across = turn + 2 * side & 7
        u, v = x + _dx(across), y + _dy(across)
        if _open(ground, u, v) and not _open(ground, u - _dx(turn), v - _dy(turn)):
            _go(ground, state, x, y, across, length)
            _go(ground, state, x, y, turn + side & 7, length)


@inlined
def _dx(turn: int) -> int:
    return 0 if turn & 3 == 2 else (-1 if 2 < turn < 6 else 1)


@inlined
def _dy(turn: int) -> int:
    return 0 if turn & 3 == 0 else (1 if turn < 4 else -1)


@inlined
def _open(ground: _OpenBits, x: int, y: int) -> bool:
    return _is_set(ground.rows, y, x)


@inlined
def _is_set(lines: Words, line: int, at: int) -> bool:
    bit = np.uint64(at + FRAME)
    return lines[line + 1, bit >> _SHIFT] >> (bit & _LAST) & _ONE != _NONE


@outlined
def _go(ground: _OpenBits, state: _JumpSearch, x: int, y: int, turn: int, length: float) -> None:
    """Go from a cell, which is `length` away, in a direction as far as one can, noting goals and corners."""
    if not turn & 1:
        _run(ground, state, x, y, turn, length)
        return
    dx, dy = _dx(turn), _dy(turn)
    while _open(ground, x + dx, y) and _open(ground, x, y + dy) and _open(ground, x + dx, y + dy):
        x, y, length = x + dx, y + dy, length + ground.diagonal
        state.counts[_STEPS] += 1
        cell = y * ground.width + x
        if length > min(_known(state, cell), _known(state, cell - dx) + 1.0) + TOLERANCE:
            return  # no shortest way goes on from here; so goes half of the steps in a building
        _enter(state, cell, length)
        _run(ground, state, x, y, _EAST if dx > 0 else _WEST, length)
        _run(ground, state, x, y, _SOUTH if dy > 0 else _NORTH, length)


@inlined
def _run(ground: _OpenBits, state: _JumpSearch, x: int, y: int, turn: int, length: float) -> None:
    """Go along a row or column up to the next corner or what is closed."""
    if turn & _SOUTH:
        line, at = _OpenLine(ground.columns, ground.column_goals, x, x, ground.width), y
    else:
        line, at = _OpenLine(ground.rows, ground.row_goals, y, y * ground.width, 1), x
    if turn < _WEST:
        _rise(line, state, at, turn, length)
    else:
        _fall(line, state, at, turn, length)


@inlined
def _rise(line: _OpenLine, state: _JumpSearch, at: int, turn: int, length: float) -> None:
    """Go from bit `at` of a line upwards.

    One can turn to a side where it is open there and closed one cell before.
    """
    lines, goals, number, first, apart = line
    start = np.uint64(at + FRAME)
    word, ahead = start >> _SHIFT, _ALL << (start & _LAST) << _ONE
    left, right = lines[number, word - _ONE] >> _LAST, lines[number + 2, word - _ONE] >> _LAST
    while True:
        here, a, b = lines[number + 1, word], lines[number, word], lines[number + 2, word]
        ends = (~here | a & ~(a << _ONE | left) | b & ~(b << _ONE | right)) & ahead
        passed = goals[number + 1, word] & ahead & here
        if ends:
            passed &= ends ^ ends - _ONE  # those up to the end
        while passed:
            cell = _number(word << _SHIFT | _lowest(passed)) - FRAME
            _enter(state, first + apart * cell, length + (cell - at))
            passed &= passed - _ONE
        if ends:
            end = _lowest(ends)
            if here >> end & _ONE:
                cell = _number(word << _SHIFT | end) - FRAME
                _note(state, first + apart * cell, turn, length + (cell - at))
            return
        left, right, ahead = a >> _LAST, b >> _LAST, _ALL
        word += _ONE


@inlined
def _fall(line: _OpenLine, state: _JumpSearch, at: int, turn: int, length: float) -> None:
    """Go downwards, as `_rise` goes upwards."""
    lines, goals, number, first, apart = line
    start = np.uint64(at + FRAME)
    word, ahead = start >> _SHIFT, ~(_ALL << (start & _LAST))
    left, right = _NONE, _NONE
    if word + _ONE < np.uint64(lines.shape[1]):
        left, right = lines[number, word + _ONE] << _LAST, lines[number + 2, word + _ONE] << _LAST
    while True:
        here, a, b = lines[number + 1, word], lines[number, word], lines[number + 2, word]
        ends = (~here | a & ~(a >> _ONE | left) | b & ~(b >> _ONE | right)) & ahead
        end = _highest(ends) if ends else _NONE
        passed = goals[number + 1, word] & ahead & here & (_ALL << end if ends else _ALL)
        while passed:
            bit = _highest(passed)
            cell = _number(word << _SHIFT | bit) - FRAME
            _enter(state, first + apart * cell, length + (at - cell))
            passed ^= _ONE << bit
        if ends:
            if here >> end & _ONE:
                cell = _number(word << _SHIFT | end) - FRAME
                _note(state, first + apart * cell, turn, length + (at - cell))
            return
        left, right, ahead = a << _LAST, b << _LAST, _ALL
        word -= _ONE

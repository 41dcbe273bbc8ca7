"""The compiled inner loops of jump point search; `marsupial.paths.jumps` explains how they work together."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from marsupial.arrays import Bytes, Floats, Ints, Ints32, Words
from marsupial.native import inlined, native, outlined
from marsupial.paths.kernels import TOLERANCE

FRAME = 64  # closed cells before the first cell of a row or column of bits; the last word ends with closed ones too

_ONE, _NONE, _ALL = np.uint64(1), np.uint64(0), np.uint64(0xFFFFFFFFFFFFFFFF)
_SHIFT, _LAST = np.uint64(6), np.uint64(63)

_EAST, _SOUTH, _WEST, _NORTH = 0, 2, 4, 6
"""Directions are step digits (`marsupial.paths.routes`): even ones straight, odd ones diagonal."""


class OpenBits(NamedTuple):
    """The open cells as bits: (x, y) is bit x + `FRAME` of row line y + 1 and bit y + `FRAME` of column line x + 1."""

    # rows, columns: set for open cells
    rows: Words
    columns: Words
    # row_goals, column_goals: set for cells whose distance is wanted
    row_goals: Words
    column_goals: Words
    width: int
    diagonal: float  # length of a diagonal step


class _OpenLine(NamedTuple):
    """One row or column of the map, with all lines of its kind."""

    bits: Words
    goals: Words
    number: int  # the arrays have one closed line before the first
    # first, stride: row-major index of its first cell, and the difference between those of neighbouring cells
    first: int
    stride: int


class JumpSearch(NamedTuple):
    """Distances per cell, row-major, and the bucket queue of corners."""

    # cost, found, arrived: distance of a cell, valid if `found` is the number of this search; bit set of the directions
    # in which a corner was reached at that distance
    cost: Floats
    found: Ints32
    arrived: Bytes
    heads: Ints32  # (buckets,): the last entry of each bucket, plus 1; 0 for none. A ring longer than any jump.
    # next, cell, direction, length: the entries: the previous one of the same bucket, plus 1; the corner, direction of
    # arrival and distance
    next: Ints32
    cell: Ints32
    direction: Bytes
    length: Floats
    counts: Ints  # (4,): see `SEARCHES`


SEARCHES, _ENTRIES, _WAITING, STEPS = range(4)
"""Places in `JumpSearch.counts`: number of this search, entries, entries not yet expanded, diagonal steps."""


def _bit_instruction(count: Callable[[Any, Any], Any]) -> Any:
    """Return a compiled function of a non-zero word that uses the processor's bit-counting instruction."""

    def typed(context: Any, word: Any) -> Any:
        return types.uint64(types.uint64), lambda context, builder, signature, words: count(builder, words[0])

    return intrinsic(typed)


_lowest = _bit_instruction(lambda builder, word: builder.cttz(word, ir.Constant(ir.IntType(1), 1)))
_highest = _bit_instruction(
    lambda builder, word: builder.xor(
        builder.ctlz(word, ir.Constant(ir.IntType(1), 1)), ir.Constant(ir.IntType(64), 63)
    )
)


@native
def flip(lines: Words, cells: Ints, width: int, rows: bool) -> None:
    """Change the bits of cells in rows or columns."""
    for index in cells:
        y, x = index // width, index % width
        line, bit = (y, np.uint64(x + FRAME)) if rows else (x, np.uint64(y + FRAME))
        lines[line + 1, bit >> _SHIFT] ^= _ONE << (bit & _LAST)


@native
def search(ground: OpenBits, state: JumpSearch, source: int, wanted: Ints) -> bool:
    """Search from a source until all wanted cells are settled; return whether the entries sufficed."""
    state.counts[SEARCHES] += 1  # invalidates all distances of the search before
    state.counts[_ENTRIES] = state.counts[_WAITING] = state.counts[STEPS] = 0
    for bucket in range(len(state.heads)):
        state.heads[bucket] = 0
    for goal in wanted:
        _mark(ground, goal, True)
    room = _settle(ground, state, source, wanted)
    for goal in wanted:
        _mark(ground, goal, False)
    return room


@inlined
def _mark(ground: OpenBits, goal: int, on: bool) -> None:
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
def _settle(ground: OpenBits, state: JumpSearch, source: int, wanted: Ints) -> bool:
    x, y = source % ground.width, source // ground.width
    _lower(state, source, 0.0)
    for direction in range(8):
        _jump(ground, state, x, y, direction, 0.0)
    level, left = 0, len(wanted)
    while state.counts[_WAITING] > 0:
        # goals are checked from the end; each is passed over once, so this costs little per bucket
        while left > 0 and _known(state, wanted[left - 1]) < level + 1.0:
            left -= 1
        if left == 0:
            return True
        bucket = level & (len(state.heads) - 1)
        entry = state.heads[bucket]
        state.heads[bucket] = 0
        while entry > 0:
            # one corner adds at most this many: two scans from each cell of two diagonals, and a few straight ones
            if state.counts[_ENTRIES] + 64 + 4 * (len(ground.rows) + len(ground.columns)) > len(state.cell):
                return False
            cell, length, direction = (
                _number(state.cell[entry - 1]),
                state.length[entry - 1],
                state.direction[entry - 1],
            )
            entry = state.next[entry - 1]
            state.counts[_WAITING] -= 1
            if length <= _known(state, cell) + TOLERANCE:  # otherwise a shorter path was found since
                _expand_corner(ground, state, cell, _number(direction), length)
        level += 1
    return True


@inlined
def _number(word: np.uint64) -> int:
    return np.int64(word)  # type: ignore[return-value]


@inlined
def _known(state: JumpSearch, cell: int) -> float:
    return state.cost[cell] if state.found[cell] == state.counts[SEARCHES] else np.inf


@inlined
def _lower(state: JumpSearch, cell: int, length: float) -> bool:
    """Lower the distance of a cell; return whether it was lowered."""
    shorter = length < _known(state, cell) - TOLERANCE
    if shorter:
        state.cost[cell], state.found[cell], state.arrived[cell] = length, state.counts[SEARCHES], 0
    return shorter


@inlined
def _push(state: JumpSearch, cell: int, direction: int, length: float) -> None:
    """Queue a corner, unless it was reached by a shorter way or as cheaply in the same direction."""
    bit = np.uint8(1 << direction)
    if not _lower(state, cell, length) and (length > state.cost[cell] + TOLERANCE or state.arrived[cell] & bit):
        return
    state.arrived[cell] |= bit
    entry, bucket = state.counts[_ENTRIES], int(length) & (len(state.heads) - 1)
    state.cell[entry], state.direction[entry], state.length[entry] = cell, direction, length
    state.next[entry] = state.heads[bucket]
    state.heads[bucket] = entry + 1
    state.counts[_ENTRIES] += 1
    state.counts[_WAITING] += 1


@inlined
def _expand_corner(ground: OpenBits, state: JumpSearch, cell: int, direction: int, length: float) -> None:
    """Continue from a corner reached in a straight line: ahead, and to the sides that opened there."""
    x, y = cell % ground.width, cell // ground.width
    _jump(ground, state, x, y, direction, length)
    for side in range(-1, 2, 2):
        across = direction + 2 * side & 7
        u, v = x + _dx(across), y + _dy(across)
        if _open(ground, u, v) and not _open(ground, u - _dx(direction), v - _dy(direction)):
            _jump(ground, state, x, y, across, length)
            _jump(ground, state, x, y, direction + side & 7, length)


@inlined
def _dx(direction: int) -> int:
    return 0 if direction & 3 == 2 else (-1 if 2 < direction < 6 else 1)


@inlined
def _dy(direction: int) -> int:
    return 0 if direction & 3 == 0 else (1 if direction < 4 else -1)


@inlined
def _open(ground: OpenBits, x: int, y: int) -> bool:
    return _is_set(ground.rows, y, x)


@inlined
def _is_set(lines: Words, line: int, at: int) -> bool:
    bit = np.uint64(at + FRAME)
    return lines[line + 1, bit >> _SHIFT] >> (bit & _LAST) & _ONE != _NONE


@outlined
def _jump(ground: OpenBits, state: JumpSearch, x: int, y: int, direction: int, length: float) -> None:
    """Jump from a cell at distance `length` in a direction until a closed cell; store goals and corners."""
    if not direction & 1:
        _scan(ground, state, x, y, direction, length)
        return
    dx, dy = _dx(direction), _dy(direction)
    while _open(ground, x + dx, y) and _open(ground, x, y + dy) and _open(ground, x + dx, y + dy):
        x, y, length = x + dx, y + dy, length + ground.diagonal
        state.counts[STEPS] += 1
        cell = y * ground.width + x
        if length > min(_known(state, cell), _known(state, cell - dx) + 1.0) + TOLERANCE:
            return  # dominated: no shortest path continues here. In a building this saves half of the steps.
        _lower(state, cell, length)
        _scan(ground, state, x, y, _EAST if dx > 0 else _WEST, length)
        _scan(ground, state, x, y, _SOUTH if dy > 0 else _NORTH, length)


@inlined
def _scan(ground: OpenBits, state: JumpSearch, x: int, y: int, direction: int, length: float) -> None:
    """Scan a row or column to the next corner or closed cell."""
    if direction & _SOUTH:
        line, at = _OpenLine(ground.columns, ground.column_goals, x, x, ground.width), y
    else:
        line, at = _OpenLine(ground.rows, ground.row_goals, y, y * ground.width, 1), x
    if direction < _WEST:
        _scan_up(line, state, at, direction, length)
    else:
        _scan_down(line, state, at, direction, length)


@inlined
def _scan_up(line: _OpenLine, state: JumpSearch, at: int, direction: int, length: float) -> None:
    """Scan a line from bit `at` upwards, see the theory of operation above."""
    lines, goals, number, first, stride = line
    start = np.uint64(at + FRAME)
    word, ahead = start >> _SHIFT, _ALL << (start & _LAST) << _ONE
    # the bits that `a << 1` and `b << 1` shift in: the last cells of the words before
    left, right = lines[number, word - _ONE] >> _LAST, lines[number + 2, word - _ONE] >> _LAST
    while True:
        here, a, b = lines[number + 1, word], lines[number, word], lines[number + 2, word]
        ends = (~here | a & ~(a << _ONE | left) | b & ~(b << _ONE | right)) & ahead
        passed = goals[number + 1, word] & ahead & here
        if ends:
            passed &= ends ^ ends - _ONE  # keep the bits up to the lowest set one of `ends`, included
        while passed:
            cell = _number(word << _SHIFT | _lowest(passed)) - FRAME
            _lower(state, first + stride * cell, length + (cell - at))
            passed &= passed - _ONE
        if ends:
            end = _lowest(ends)
            if here >> end & _ONE:  # otherwise the line is closed there: no corner
                cell = _number(word << _SHIFT | end) - FRAME
                _push(state, first + stride * cell, direction, length + (cell - at))
            return
        left, right, ahead = a >> _LAST, b >> _LAST, _ALL
        word += _ONE


@inlined
def _scan_down(line: _OpenLine, state: JumpSearch, at: int, direction: int, length: float) -> None:
    """Scan a line downwards: the mirror image of `_scan_up`."""
    lines, goals, number, first, stride = line
    start = np.uint64(at + FRAME)
    word, ahead = start >> _SHIFT, ~(_ALL << (start & _LAST))
    left, right = _NONE, _NONE
    if word + _ONE < np.uint64(lines.shape[1]):  # after the last word everything is closed
        left, right = lines[number, word + _ONE] << _LAST, lines[number + 2, word + _ONE] << _LAST
    while True:
        here, a, b = lines[number + 1, word], lines[number, word], lines[number + 2, word]
        ends = (~here | a & ~(a >> _ONE | left) | b & ~(b >> _ONE | right)) & ahead
        end = _highest(ends) if ends else _NONE
        passed = goals[number + 1, word] & ahead & here & (_ALL << end if ends else _ALL)
        while passed:
            bit = _highest(passed)
            cell = _number(word << _SHIFT | bit) - FRAME
            _lower(state, first + stride * cell, length + (at - cell))
            passed ^= _ONE << bit
        if ends:
            if here >> end & _ONE:
                cell = _number(word << _SHIFT | end) - FRAME
                _push(state, first + stride * cell, direction, length + (at - cell))
            return
        left, right, ahead = a << _LAST, b << _LAST, _ALL
        word -= _ONE

"""The ground of a map as pixels: blocks of cells as one, so that walls stay closed, and the frontier in its colour."""

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray, Mask, beside_unknown, ground_in
from marsupial.replay.palette import Palette

Image = npt.NDArray[np.uint8]  # red, green and blue, (height, width, 3)


def coarse(cells: CellArray, block: int) -> CellArray:
    """Return a map with one cell for each `block` x `block` of `cells`."""
    # A block becomes an obstacle if its obstacles can cross it from side to side, unknown if nothing in it is known,
    # and else the most common of its known terrains.
    height, width = cells.shape
    padded = np.pad(cells, ((0, -height % block), (0, -width % block)), constant_values=UNKNOWN)
    squares = padded.reshape(padded.shape[0] // block, block, padded.shape[1] // block, block)
    codes = [int(code) for code in np.unique(cells) if code not in (UNKNOWN, OBSTACLE)]
    counts = np.stack([np.count_nonzero(squares == code, axis=(1, 3)) for code in [OBSTACLE, *codes]])
    ground = np.array([*codes, UNKNOWN], dtype=np.uint8)[np.argmax(counts[1:], axis=0) if codes else 0]
    picture = np.where(counts.sum(axis=0) == 0, UNKNOWN, ground)
    # A wall of one cell across a block has `block` cells in it, straight or diagonal. Fewer become ground, so that
    # narrow doors don't close.
    walls = (counts[0] >= block) | ((counts[0] > 0) & (counts[1:].sum(axis=0) == 0))
    return np.where(walls, OBSTACLE, picture).astype(np.uint8)


def frontier(cells: CellArray) -> Mask:
    """Return the mask (height, width) of known cells without obstacle that are next to an unknown one."""
    return beside_unknown(cells) & ground_in(cells)


def ground_image(cells: CellArray, palette: Palette) -> Image:
    """Return a map in the palette's colours, with its frontier."""
    table = np.zeros((256, 3), dtype=np.uint8)
    for code in np.unique(cells):
        table[code] = tuple(bytes.fromhex(palette.ground(int(code))[1:]))
    image = table[cells]
    image[frontier(cells)] = tuple(bytes.fromhex(palette.frontier[1:]))
    return image


def box(shown: Mask) -> tuple[int, int, int, int]:
    """Return bottom, top, left and right of the cells shown, upper bounds exclusive; the whole map if none is."""
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if not rows.size:
        return 0, shown.shape[0], 0, shown.shape[1]
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1

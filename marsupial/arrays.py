"""What arrays hold, by name; shapes and units are told where an array is used."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
"""Times in ms, indices (of cells: row-major), counts and labels."""

Ints32 = npt.NDArray[np.int32]
"""The same where there are many of them."""

Counts = npt.NDArray[np.uint16]
"""Small counts where there are many of them."""

Words = npt.NDArray[np.uint64]
Cells = npt.NDArray[np.uint32]
"""Indices of cells of a framed grid."""

Floats = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Flags = npt.NDArray[np.bool_]

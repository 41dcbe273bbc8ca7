"""Names for types of arrays by their content; docstrings give shapes and units where an array is used."""

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]  # times in ms, indices (of cells: row-major), counts and labels

Ints32 = npt.NDArray[np.int32]  # like `Ints`, for large arrays

Counts = npt.NDArray[np.uint16]  # small counts, for large arrays

Words = npt.NDArray[np.uint64]  # unsigned indices and offsets of compiled code

Cells = npt.NDArray[np.uint32]  # indices of cells of a framed grid

Floats = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Flags = npt.NDArray[np.bool_]

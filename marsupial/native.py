"""Functions compiled to machine code that is kept on disk.

numba knows kept code by the file of the function that Python calls. What that calls in other files becomes part of the
code, but a change there goes unnoticed (https://numba.readthedocs.io/en/stable/user/jit.html#cache), up to memory being
written to where it should not, after an upgrade. So code is kept by all the sources it may be made of.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., object])


def inlined(function: F) -> F:
    """Compile a function as part of the native ones that call it; it makes no arrays.

    A call would copy the tuples of arrays that it is given, and nobody counts references to those.
    """
    compiled: F = njit(nogil=True, _nrt=False, forceinline=True)(function)
    return compiled


def native(function: F) -> F:
    """Compile a function at its first call, or load what was compiled of the same sources before.

    Sources are all those in the folder of the function, and in the folders of native functions that its module imports.
    """
    made = [function, *(value.py_func for value in function.__globals__.values() if hasattr(value, "py_func"))]
    folders = sorted({Path(each.__code__.co_filename).parent for each in made})
    digest = hashlib.sha256(b"".join(map(_digest, folders))).hexdigest()
    function.__qualname__ += f"-{digest[:16]}"
    return njit(cache=True, nogil=True)(function)


@cache
def _digest(folder: Path) -> bytes:
    digests = [hashlib.sha256(path.read_bytes()).digest() for path in sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(digests)).digest()

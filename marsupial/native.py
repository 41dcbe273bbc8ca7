"""Functions compiled to machine code that is kept on disk.

numba knows kept code by the file of the function that Python calls. What that calls in other files becomes part of the
code, but a change there goes unnoticed (https://numba.readthedocs.io/en/stable/user/jit.html#cache), up to memory being
written to where it should not, after an upgrade. So code is kept by all the sources it may be made of.

It is kept beside the sources, or where numba keeps the user's. Where neither folder can be written to, as in a
read-only container, a temporary one is used, and that is logged in one line.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from stat import S_IMODE, S_ISDIR
from typing import TypeVar

from numba import config, njit

_LOG = logging.getLogger(__name__)

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
    keeping = njit(cache=True, nogil=True)
    try:
        return keeping(function)
    except RuntimeError:  # there is no folder to keep it in
        os.environ["NUMBA_CACHE_DIR"] = config.CACHE_DIR = _temporary_folder()
        return keeping(function)


@cache
def _temporary_folder() -> str:
    """Return a folder for compiled code that nobody else can write to: the user's, or one for this process alone."""
    folder = Path(tempfile.gettempdir(), f"marsupial-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        ours = S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not S_IMODE(found.st_mode) & 0o077
    except OSError:
        ours = False
    if not ours:
        folder = Path(tempfile.mkdtemp(prefix="marsupial-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _LOG.warning("compiled code is kept in %s: the folders for it can't be written to", folder)
    return str(folder)


@cache
def _digest(folder: Path) -> bytes:
    digests = [hashlib.sha256(path.read_bytes()).digest() for path in sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(digests)).digest()

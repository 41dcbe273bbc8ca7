"""Functions that numba compiles to machine code, which is stored on disk (`marsupial.codecache`).

There are three kinds:

::

    Python ──calls──► @native    compiled at the first call or loaded; stored on disk
                         │
                         ├─ @inlined     code pasted into each native caller: no call, no copy of its arguments
                         └─ @outlined    a function of its own in the caller's code: keeps long loops short

*Why all sources identify stored code.* numba drops code when the file of the function that Python calls has changed.
Functions of other files become part of that code, but a change there goes unnoticed
(https://numba.readthedocs.io/en/stable/user/jit.html#cache): after an upgrade, old code would read and write arrays of
a new layout. So `native` adds a digest of all sources it may be made of to the qualified name that identifies code.

Parts (inlined and outlined functions) are compiled in a third less time by internals of numba, where it is one whose
internals are known (`marsupial.numba_internals`).
"""

import hashlib
import logging
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

from numba.core import event
from numba.extending import register_jitable

from marsupial.codecache import DIFFERENCE, compiled, numba_internals

_LOG = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., object])

Compiling = Callable[[str, int, int], None]
"""Called before a function is compiled: its name, how many were compiled before, how many there are at most."""

_natives: list[Any] = []
_decorated: set[object] = set()  # all functions that are compiled, as Python functions


class _Listener(event.Listener):
    """Reports native functions as their compilation starts."""

    def __init__(self, report: Compiling) -> None:
        self._report = report
        self._done = 0

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"] in _natives:
            function = event.data["dispatcher"].py_func
            self._report(f"{function.__module__}.{function.__name__}", self._done, len(_natives))
            self._done += 1

    def on_end(self, event: Any) -> None:
        pass


def watched(report: Compiling) -> AbstractContextManager[object]:
    """Return a context that calls `report` before a native function is compiled, not when its stored code is loaded."""
    return event.install_listener("numba:compile", _Listener(report))


def _warn(name: str, done: int, most: int) -> None:
    if not done:
        _LOG.warning(f"{DIFFERENCE}: compiling takes longer, and precompiled code is not used")


if DIFFERENCE is not None:
    event.register("numba:compile", _Listener(_warn))


def inlined(function: F) -> F:
    """Compile a function into each native function that calls it; it must not make arrays."""
    # A call would copy the tuples of arrays in its arguments. References to arrays are not counted in parts (``_nrt``),
    # which is why it must not make any.
    return _part(function, forceinline=True)


def outlined(function: F) -> F:
    """Compile a function that native functions call, such as the body of a long loop; it must not make arrays."""
    # LLVM tries to move everything out of a loop, in a time that grows with the square of the loop's length.
    return _part(function)


def _part(function: F, **options: Any) -> F:
    _decorated.add(function)
    if numba_internals is not None:
        options["pipeline_class"] = numba_internals.PartCompiler
    # Python calls the function as it is.
    part: F = register_jitable(nogil=True, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)(
        function
    )
    return part


def native(function: F) -> F:
    """Compile a function at its first call, or load its code if it was compiled from the same sources before."""
    # Its sources are all files in its folder, and in the folders of the compiled functions that its module imports.
    named = (getattr(value, "py_func", value) for value in function.__globals__.values())
    imported: list[Any] = [value for value in named if isinstance(value, FunctionType) and value in _decorated]
    folders = sorted({Path(each.__code__.co_filename).parent for each in (function, *imported)})
    digest = hashlib.sha256(b"".join(map(_digest, folders))).hexdigest()
    function.__qualname__ += f"-{digest[:16]}"
    _decorated.add(function)
    made: F = compiled(function, nogil=True, no_cfunc_wrapper=True)
    _natives.append(made)
    return made


@cache
def _digest(folder: Path) -> bytes:
    digests = [hashlib.sha256(path.read_bytes()).digest() for path in sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(digests)).digest()

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

*What of numba is overridden.* A part (inlined or outlined) only needs LLVM's intermediate code, which its callers
link. numba would also optimise it and compile it to machine code that nothing runs, which took more than half the
time to compile planners. `_PartCompiler` gives parts a library that skips both steps, by private methods of
`JITCodeLibrary`; pyproject.toml bounds numba, and ``tests/test_numba_internals.py`` names what has changed.
"""

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from numba import njit
from numba.core import event
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.types import unliteral

from marsupial.codecache import cache_code

F = TypeVar("F", bound=Callable[..., object])

Compiling = Callable[[str, int, int], None]
"""Called before a function is compiled: its name, how many were compiled before, how many there are at most."""

_natives: list[CPUDispatcher] = []


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


def inlined(function: F) -> F:
    """Compile a function into each native function that calls it; it must not make arrays."""
    # A call would copy the tuples of arrays in its arguments. References to arrays are not counted in parts (``_nrt``),
    # which is why it must not make any.
    return _part(function, forceinline=True)


def outlined(function: F) -> F:
    """Compile a function that native functions call, such as the body of a long loop; it must not make arrays."""
    # LLVM tries to move everything out of a loop, in a time that grows with the square of the loop's length.
    return _part(function)


def _part(function: F, **options: bool) -> F:
    target = {"nopython": True, "nogil": True, "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _Part(function, targetoptions=target | options, pipeline_class=_PartCompiler)


class _Part(CPUDispatcher):
    """A function that is compiled for native callers only; Python calls the Python function."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # numba would compile a part again for each constant argument.
        return super().get_call_template(tuple(map(unliteral, args)), kws)

    def __call__(self, *args: object) -> object:
        return self.py_func(*args)


class _PartCompiler(Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, *rest: Any) -> None:
        super().__init__(typingctx, targetctx, *rest)
        self.state.library = _PartLibrary(targetctx.codegen(), "part")


class _PartLibrary(JITCodeLibrary):
    """A part's intermediate code, not optimised and without machine code: its callers' libraries link it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0  # what numba returns for a symbol that a library does not define

    @property
    def codegen(self) -> Any:
        return _PartCodegen(self._codegen)


class _PartCodegen:
    """numba's code generator, for parts: they are never called from Python and have no environment to set."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, env: object) -> None:
        """Do nothing: setting it would look up a symbol in machine code that does not exist."""


def native(function: F) -> F:
    """Compile a function at its first call, or load its code if it was compiled from the same sources before."""
    # Its sources are all files in its folder, and in the folders of the compiled functions that its module imports.
    imported = [value.py_func for value in function.__globals__.values() if hasattr(value, "py_func")]
    folders = sorted({Path(each.__code__.co_filename).parent for each in (function, *imported)})
    digest = hashlib.sha256(b"".join(map(_digest, folders))).hexdigest()
    function.__qualname__ += f"-{digest[:16]}"
    compiled: CPUDispatcher = njit(nogil=True, no_cfunc_wrapper=True)(function)
    cache_code(compiled)
    _natives.append(compiled)
    return compiled


@cache
def _digest(folder: Path) -> bytes:
    digests = [hashlib.sha256(path.read_bytes()).digest() for path in sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(digests)).digest()

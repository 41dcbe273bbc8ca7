"""Functions compiled to machine code that is kept on disk.

numba knows kept code by the file of the function that Python calls. What that calls in other files becomes part of the
code, but a change there goes unnoticed (https://numba.readthedocs.io/en/stable/user/jit.html#cache), up to memory being
written to where it should not, after an upgrade. So code is kept by all the sources it may be made of; where it is kept
is told in `marsupial.keeping`.
"""

from __future__ import annotations

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

from marsupial.keeping import keep

F = TypeVar("F", bound=Callable[..., object])

Compiling = Callable[[str, int, int], None]
"""Is told of a function before it is compiled: its name, how many were compiled before, how many may be in all."""

_natives: list[CPUDispatcher] = []


class _Listener(event.Listener):
    """Notes which native functions are compiled, while they are."""

    def __init__(self, tell: Compiling) -> None:
        self._tell = tell
        self._done = 0

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"] in _natives:
            function = event.data["dispatcher"].py_func
            self._tell(f"{function.__module__}.{function.__name__}", self._done, len(_natives))
            self._done += 1

    def on_end(self, event: Any) -> None:
        pass


def watched(tell: Compiling) -> AbstractContextManager[object]:
    """Return a context in which `tell` is called before a native function is compiled, by the thread that needs it.

    It is not called where what was compiled before is loaded.
    """
    watch: AbstractContextManager[object] = event.install_listener("numba:compile", _Listener(tell))
    return watch


def inlined(function: F) -> F:
    """Compile a function as part of the native ones that call it; it makes no arrays.

    A call would copy the tuples of arrays that it is given, and nobody counts references to those.
    """
    return _part(function, forceinline=True)


def outlined(function: F) -> F:
    """Compile a function that native ones call; it makes no arrays.

    It is for what a loop does in each turn where that is long: a compiler tries to move everything out of a loop, which
    takes it a time that grows with the square of the loop's length.
    """
    return _part(function)


def _part(function: F, **options: bool) -> F:
    numbas = {"nopython": True, "nogil": True, "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    part: F = _Part(function, targetoptions=numbas | options, pipeline_class=_PartCompiler)
    return part


class _Part(CPUDispatcher):
    """A function that is compiled for native ones only; called from Python it is the Python function.

    It is compiled once for all values of an argument: numba would do so again for each constant.
    """

    def get_call_template(self, args: Any, kws: Any) -> Any:
        return super().get_call_template(tuple(map(unliteral, args)), kws)

    def __call__(self, *args: object) -> object:
        return self.py_func(*args)


class _PartCompiler(Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, *rest: Any) -> None:
        super().__init__(typingctx, targetctx, *rest)
        self.state.library = _PartLibrary(targetctx.codegen(), "part")


class _PartLibrary(JITCodeLibrary):
    """The intermediate code of a part; numba would optimise it and make machine code of it that nobody runs.

    With all that is inlined into it, that took more than half of the time in which planners are compiled.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return _NoMachineCode(self._codegen)


class _NoMachineCode:
    """What makes code, but for the part that is in memory already."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, env: object) -> None:
        """Do nothing: only what Python calls has an environment."""


def native(function: F) -> F:
    """Compile a function at its first call, or load what was compiled of the same sources before.

    Sources are all those in the folder of the function, and in the folders of native functions that its module imports.
    """
    made = [function, *(value.py_func for value in function.__globals__.values() if hasattr(value, "py_func"))]
    folders = sorted({Path(each.__code__.co_filename).parent for each in made})
    digest = hashlib.sha256(b"".join(map(_digest, folders))).hexdigest()
    function.__qualname__ += f"-{digest[:16]}"
    compiled: CPUDispatcher = njit(nogil=True, no_cfunc_wrapper=True)(function)
    keep(compiled)
    _natives.append(compiled)
    return compiled


@cache
def _digest(folder: Path) -> bytes:
    digests = [hashlib.sha256(path.read_bytes()).digest() for path in sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(digests)).digest()

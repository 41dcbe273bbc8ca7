"""All that marsupial overrides or calls of numba that numba may change in any release.

Importing this module raises ImportError where numba differs from those it was written for: one newer than `NEWEST`, or
without one of the names in `NEEDED`. `marsupial.native` and `marsupial.codecache` then use numba's documented
interface alone: ``register_jitable`` and ``njit(cache=True)``. All works as before, but compiling takes half as long
again, and precompiled code is not used.

*Parts* (`PartCompiler`). A function that only other compiled functions call needs no more than LLVM's intermediate
code, which its callers link. numba would also optimise it and compile it to machine code that nothing runs: 20 of 60
CPU seconds at the first use of a mission. `PartCompiler` gives parts a library that skips both steps.

*Code from elsewhere* (`packed`, `unpacked`, `replace_cache`). numba's own cache on disk is bound to one machine.
"""

import inspect
import pickle
from collections.abc import Callable
from typing import Any

import numba
from numba.core.caching import Cache, FunctionCache
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import Compiler, CompilerBase, CompileResult
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

NEWEST = (0, 68)
"""The newest numba that was tried; the oldest is in pyproject.toml."""

NEEDED: tuple[tuple[Any, str, tuple[str, ...]], ...] = (
    (JITCodeLibrary, "_optimize_final_module", ("self",)),
    (JITCodeLibrary, "_finalize_final_module", ("self",)),
    (JITCodeLibrary, "_ensure_finalized", ("self",)),
    (JITCodeLibrary, "get_pointer_to_function", ("self", "name")),
    (JITCPUCodegen, "set_env", ("self", "env_name", "env")),
    (CompilerBase, "__init__", ("self", "typingctx", "targetctx", "library", "args", "return_type", "flags")),
    (Cache, "save_overload", ("self", "sig", "data")),
    (FunctionCache, "_load_overload", ("self", "sig", "target_context")),
    (CompileResult, "_reduce", ("self",)),
    (CompileResult, "_rebuild", ("target_context",)),
    (rtsys, "initialize", ("ctx",)),
)
"""The methods that are overridden or called, with their first arguments."""


def _difference() -> str | None:
    """Return how numba differs from those known, None if it does not."""
    version = numba.__version__
    if tuple(map(int, version.split(".")[:2])) > NEWEST:
        return f"numba {version} is newer than {'.'.join(map(str, NEWEST))}"
    for owner, name, parameters in NEEDED:
        method = getattr(owner, name, None)
        if method is None or tuple(inspect.signature(method).parameters)[: len(parameters)] != parameters:
            return f"numba {version} has another {owner.__name__ if inspect.isclass(owner) else 'rtsys'}.{name}"
    known = isinstance(getattr(JITCodeLibrary, "codegen", None), property) and JITCodeLibrary._finalized is False
    return None if known else f"numba {version} has another JITCodeLibrary"


if difference := _difference():
    raise ImportError(difference)


class PartCompiler(Compiler):
    """Compiles a function that is only called by other compiled functions."""

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


class LocalCache(FunctionCache):
    """numba's cache on disk, without the import of all that compiling needs before it looks (0.2 s)."""

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        return self._load_overload(sig, target_context)


def replace_cache(function: CPUDispatcher, cache: object) -> None:
    """Make a compiled function use another cache, with the methods of numba's."""
    function._cache = cache


def initialize_runtime(target_context: Any) -> None:
    """Do what loaded code needs and compiling would do."""
    # numba initialises its runtime together with all that compiling needs, which takes long to import.
    rtsys.initialize(target_context)


def packed(result: CompileResult) -> bytes:
    """Return a compiled function as bytes."""
    data: bytes = dumps(result._reduce())
    return data


def unpacked(data: bytes, target_context: Any) -> CompileResult:
    """Return the compiled function of these bytes, which must be trusted."""
    rebuild: Callable[..., CompileResult] = CompileResult._rebuild
    return rebuild(target_context, *pickle.loads(data))

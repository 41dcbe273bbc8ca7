"""Where compiled code is kept, and code that was compiled before there was a machine to keep it.

What a machine compiles it keeps beside the sources, or where numba keeps the user's. Where neither folder can be
written to, as in a read-only container, a temporary one is used, or nothing is kept if there is none; either is logged
in one line when there is something to keep. Whatever goes wrong there, code is compiled anew.

What is not kept may have come with the package: precompiled, for a processor that can do what nearly all can. Its files
are named by all that such code depends on, so none of other sources or of another numba is taken for it.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from stat import S_IMODE, S_ISDIR
from typing import Any

import numba
import numpy as np
from llvmlite import binding as llvm
from numba import config
from numba.core.caching import FunctionCache, NullCache
from numba.core.compiler import CompileResult
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

_LOG = logging.getLogger(__name__)

PRECOMPILED = Path(__file__).parent / "precompiled"
"""The folder of code that came with the package; it need not exist. It is trusted as the sources beside it are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Processor:
    """What code is compiled for: a name that LLVM knows, and what a machine must have to run it (LLVM's words)."""

    name: str
    features: frozenset[str] = frozenset()


_X86_64_V3 = (
    *("cx16", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3"),  # v2
    *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"),
)

PROCESSORS = {
    "x86_64": Processor(name="x86-64-v3", features=frozenset(_X86_64_V3)),
    "aarch64": Processor(name="generic"),
    "arm64": Processor(name="generic"),
}
"""Those that code is precompiled for, by LLVM's name of the architecture: what nearly all machines can stand for.

What an older x86-64 can run makes annealing for large teams slower by a tenth, this by a twentieth.
"""


def processor_environment() -> dict[str, str]:
    """Return the variables that have numba compile for the processor that others have too; none if there is no such."""
    processor = PROCESSORS.get(_architecture())
    return {} if processor is None else {"NUMBA_CPU_NAME": processor.name, "NUMBA_CPU_FEATURES": ""}


class _Hindrance:
    """Why what this process compiles is not kept for good, if so; logged when there is something to keep, once."""

    reason: str | None = None
    logged = False


def is_lasting() -> bool:
    """Say whether what is compiled is kept for good: longer than this process, and than the machine is up."""
    return _Hindrance.reason is None


class _Ahead:
    """Where this process keeps what it compiles for other machines; None if it does not."""

    folder: Path | None = None


def precompile_into(folder: Path) -> None:
    """From now on, keep what is compiled in a folder that is there, for the package; some code may be in it already.

    The process has to run with the variables of `processor_environment`.
    """
    _Ahead.folder = folder


def keep(function: CPUDispatcher) -> None:
    """Have code of a function looked for before it is compiled, and kept after that.

    Its qualified name says which sources it is made of.
    """
    function._cache = _Code(function.py_func)


class _Code(NullCache):
    """The code of a function: kept on this machine, or precompiled."""

    def __init__(self, function: Callable[..., object]) -> None:
        self._function = function
        self._kept = _kept(function)

    @property
    def cache_path(self) -> str | None:
        path: str | None = self._kept.cache_path
        return path

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        rtsys.initialize(target_context)  # all that code needs to run; what compiling needs takes long to import
        ahead = _Ahead.folder is not None
        for load in (self._load_precompiled,) if ahead else (self._kept.load_overload, self._load_precompiled):
            try:
                found = load(sig, target_context)
            except Exception:  # a pickle that is damaged can raise anything
                _LOG.debug("code of %s can't be loaded", self._function.__qualname__, exc_info=True)
                continue
            if found is not None:
                return found
        return None

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        if _Ahead.folder is not None:
            self._write(_Ahead.folder, sig, data)
            return
        try:
            self._kept.save_overload(sig, data)
        except OSError as error:  # such as a full disk
            _Hindrance.reason = f"compiled code is not kept: {error.strerror}"
        if _Hindrance.reason and not _Hindrance.logged:
            _LOG.warning(_Hindrance.reason)
            _Hindrance.logged = True

    def flush(self) -> None:
        self._kept.flush()

    def _load_precompiled(self, sig: Any, target_context: Any) -> CompileResult | None:
        processor = _usual_processor()
        if processor is None:
            return None
        try:
            data = ((_Ahead.folder or PRECOMPILED) / _file_name(self._function, sig, processor)).read_bytes()
        except FileNotFoundError:
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(data))

    def _write(self, folder: Path, sig: Any, result: CompileResult) -> None:
        processor = _usual_processor()
        if processor is None:
            raise RuntimeError("code for other machines too is compiled with the variables of processor_environment()")
        path = folder / _file_name(self._function, sig, processor)
        part = path.with_suffix(f".{os.getpid()}")
        part.write_bytes(dumps(result._reduce()))
        part.replace(path)


def _usual_processor() -> Processor | None:
    """Return the processor of precompiled code, if this process may use that: it can be told another one."""
    processor = PROCESSORS.get(_architecture())
    if processor is None:
        return None
    if _Ahead.folder is not None:
        return processor if processor.name == config.CPU_NAME and not config.CPU_FEATURES else None
    unasked = config.CPU_NAME is None and config.CPU_FEATURES is None
    return processor if unasked and _features() >= processor.features else None


@cache
def _features() -> frozenset[str]:
    """Return what this machine's processor has, in LLVM's words."""
    try:
        return frozenset(name for name, there in llvm.get_host_cpu_features().items() if there)
    except RuntimeError:  # LLVM can't tell
        return frozenset()


@cache
def _architecture() -> str:
    name: str = llvm.get_default_triple().split("-")[0]
    return name


def _file_name(function: Callable[..., object], signature: Any, processor: Processor) -> str:
    """Return the name of the file of precompiled code: a digest of all that has to be the same for it to be right."""
    depends = (
        numba.__version__,
        np.__version__.split(".")[0],
        sys.implementation.cache_tag,
        sys.abiflags,
        llvm.get_default_triple(),
        processor.name,
        function.__module__,
        function.__qualname__,
        function.__code__.co_firstlineno,
        hashlib.sha256(function.__code__.co_code).hexdigest(),
        str(signature),
    )
    return f"{function.__name__}-{hashlib.sha256(repr(depends).encode()).hexdigest()[:32]}.code"


class _Kept(FunctionCache):
    """numba's keeper of code, but that it does not import all that compiling needs before it looks."""

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        found: CompileResult | None = self._load_overload(sig, target_context)
        return found


def _kept(function: Callable[..., object]) -> Any:
    """Return what keeps code in a folder that can be written to; what keeps nothing if there is none."""
    try:
        return _Kept(function)
    except RuntimeError:  # there is no folder to keep it in
        folder = _temporary_folder()
    if folder is None:
        return NullCache()
    os.environ["NUMBA_CACHE_DIR"] = config.CACHE_DIR = folder
    return _Kept(function)


@cache
def _temporary_folder() -> str | None:
    """Return a folder for compiled code that nobody else can write to: the user's, or one for this process alone.

    There is none where no folder for temporary files can be written to.
    """
    try:
        folder = _made_temporary_folder()
    except OSError:
        _Hindrance.reason = "compiled code is not kept: there is no folder that can be written to"
        return None
    _Hindrance.reason = f"compiled code is kept in {folder}: the folders for it can't be written to"
    return folder


def _made_temporary_folder() -> str:
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
    return str(folder)

"""The cache of compiled code on this machine, and code that came compiled with the package.

numba compiles a function for each signature it is called with. A call looks for that code in this order, and only
the last step is slow (seconds for a planner's search):

::

    call add(1) ──► memory of this process
                      │ not there
                      ▼
                    _LocalCache      files that this machine wrote: __pycache__ beside the sources, else numba's
                      │ not there    folder of the user, else a temporary folder, else nothing is stored
                      ▼
                    PRECOMPILED      files that came with the package, for a processor nearly every machine has
                      │ not there
                      ▼
                    compile ──► write to _LocalCache (or, under `precompile_into`, to the package's folder)

*How the local cache stays right.* numba names its files by the function's own file and drops them when that file
changes; `marsupial.native` adds a digest of all sources to the function's qualified name, so a change anywhere in
them leads to other files.

*What makes precompiled code portable.* numba's own cache is bound to one machine: its index holds the processor's
name and features, and a stamp of the source file. So precompiled files don't use that index. They hold what numba
pickles of a compiled function, and their name is a digest of all that must be equal for the code to be right: numba,
numpy's ABI, Python, platform, sources, signature, and a processor from `PROCESSORS`. They are compiled for that
processor by name (x86-64-v3: AVX2, no AVX-512) instead of for the machine that compiles, and used where the machine
has its features. Another numba, another Python or an edited source computes another name, finds no file and compiles:
nothing has to be invalidated.

*With a numba whose internals are unknown* (`marsupial.numba_internals`), there is numba's own cache alone.

A cache never fails a call: whatever goes wrong here, code is compiled. One line is logged if it can't be stored.
"""

import atexit
import hashlib
import logging
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from stat import S_IMODE, S_ISDIR
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import binding as llvm
from numba import config, njit

DIFFERENCE: str | None = None
"""How numba differs from those whose internals are known, None if it does not."""

try:
    from marsupial import numba_internals as numba_internals
except ImportError as error:
    DIFFERENCE = str(error)
    numba_internals = None  # type: ignore[assignment]

T = TypeVar("T")

_LOG = logging.getLogger(__name__)

PRECOMPILED = Path(__file__).parent / "precompiled"
"""The folder of code that came with the package; it need not exist. It is trusted as the sources beside it are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Processor:
    """A processor to compile for: its name and the features a machine must have to run the code, as LLVM names them."""

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
"""The processors of precompiled code by LLVM's name of the architecture; nearly all machines have their features.

Code for the machine's own processor anneals for large teams a twentieth faster than code for x86-64-v3, and a tenth
faster than code for the first x86-64.
"""


def processor_environment() -> dict[str, str]:
    """Return the variables that make numba compile for the shared processor; none if it can't be done here."""
    processor = PROCESSORS.get(_architecture())
    return (
        {}
        if processor is None or numba_internals is None
        else {"NUMBA_CPU_NAME": processor.name, "NUMBA_CPU_FEATURES": ""}
    )


class _State:
    """The state of this process's cache."""

    fault: str | None = None  # why compiled code is lost with this process or at the next boot, None if it is not
    logged = False  # whether the fault was logged, which happens once, when saving
    precompiling: Path | None = None  # the folder where this process writes code for other machines, if it does


def is_lasting() -> bool:
    """Return whether compiled code is stored where it outlives this process and a reboot."""
    return _State.fault is None


def precompile_into(folder: Path) -> None:
    """From now on, write compiled code to an existing folder of precompiled code, and load it from there only."""
    # The process has to run with the variables of `processor_environment`.
    _State.precompiling = folder


def compiled(function: Callable[..., object], **options: bool) -> Any:
    """Return the function, compiled by numba with these options when it is called, unless its code is stored."""
    # The function's qualified name must identify all the sources it is made of.
    if numba_internals is None:
        stored = _in_writable_folder(lambda: njit(cache=True, **options)(function))
        return njit(**options)(function) if stored is None else stored
    dispatcher = njit(**options)(function)
    numba_internals.replace_cache(dispatcher, _FunctionCode(function))
    return dispatcher


class _FunctionCode:
    """The cache of one function: this machine's files, then precompiled ones."""

    def __init__(self, function: Callable[..., object]) -> None:
        self._function = function
        self._local = _in_writable_folder(lambda: numba_internals.LocalCache(function))

    @property
    def cache_path(self) -> str | None:
        return None if self._local is None else str(self._local.cache_path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        numba_internals.initialize_runtime(target_context)
        # While precompiling, code of this machine's own processor must not be taken for the portable one.
        local = () if self._local is None or _State.precompiling is not None else (self._local.load_overload,)
        for load in (*local, self._load_precompiled):
            try:
                found = load(sig, target_context)
            except Exception:  # a damaged pickle can raise anything
                _LOG.debug("code of %s can't be loaded", self._function.__qualname__, exc_info=True)
                continue
            if found is not None:
                return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        if _State.precompiling is not None:
            self._write(_State.precompiling, sig, data)
            return
        try:
            if self._local is not None:
                self._local.save_overload(sig, data)
        except OSError as error:  # such as a full disk
            _State.fault = f"compiled code is not kept: {error.strerror}"
        if _State.fault and not _State.logged:
            _LOG.warning(_State.fault)
            _State.logged = True

    def flush(self) -> None:
        if self._local is not None:
            self._local.flush()

    def _load_precompiled(self, sig: Any, target_context: Any) -> Any:
        if (processor := _shared_processor()) is None:
            return None
        try:
            folder = _State.precompiling or PRECOMPILED
            data = (folder / _file_name(self._function, sig, processor)).read_bytes()
        except FileNotFoundError:
            return None
        return numba_internals.unpacked(data, target_context)

    def _write(self, folder: Path, sig: Any, result: Any) -> None:
        if (processor := _shared_processor()) is None:
            raise RuntimeError("precompiling needs the variables of processor_environment()")
        path = folder / _file_name(self._function, sig, processor)
        # Two processes may write the same file: each writes its own, and replacing is atomic.
        part = path.with_suffix(f".{os.getpid()}")
        part.write_bytes(numba_internals.packed(result))
        part.replace(path)


def _shared_processor() -> Processor | None:
    """Return the processor of precompiled code; None if this process can't use it or has to use another."""
    if (processor := PROCESSORS.get(_architecture())) is None:
        return None
    if _State.precompiling is not None:
        return processor if processor.name == config.CPU_NAME and not config.CPU_FEATURES else None
    # Whoever sets NUMBA_CPU_NAME wants code for that processor, not the package's.
    is_free = config.CPU_NAME is None and config.CPU_FEATURES is None
    return processor if is_free and _features() >= processor.features else None


@cache
def _features() -> frozenset[str]:
    try:
        return frozenset(name for name, there in llvm.get_host_cpu_features().items() if there)
    except RuntimeError:  # LLVM does not know the processor
        return frozenset()


@cache
def _architecture() -> str:
    return llvm.get_default_triple().split("-")[0]


def _file_name(function: Callable[..., object], signature: Any, processor: Processor) -> str:
    """Return the name of a file of precompiled code: a digest of all that must be equal for the code to be right."""
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


def _in_writable_folder(make: Callable[[], T]) -> T | None:
    """Return what `make` makes, a cache in a folder that can be written to; None if there is no such folder."""
    try:
        return make()
    except RuntimeError:  # numba found none
        folder = _temporary_folder()
    if folder is None:
        return None
    # Both: the variable is for child processes, numba itself has read it already.
    os.environ["NUMBA_CACHE_DIR"] = config.CACHE_DIR = folder
    return make()


@cache
def _temporary_folder() -> str | None:
    """Return a folder for compiled code that only this user or process can write to; None if there is none."""
    try:
        folder = _made_temporary_folder()
    except OSError:
        _State.fault = "compiled code is not kept: there is no folder that can be written to"
        return None
    _State.fault = f"compiled code is kept in {folder}: the folders for it can't be written to"
    return folder


def _made_temporary_folder() -> str:
    folder = Path(tempfile.gettempdir(), f"marsupial-{os.getuid()}")
    # Code is run from there: a folder that somebody else made or can write to would let them run theirs.
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

"""A strategy in a file, without a package: ``my_rule.py:MyRule``.

The text of the file is read once and travels with the comparison, so that every worker process runs what was read, and
the head of the comparison has its digest. Only the command line and `marsupial.compare` read such names: code of a file
is never run for a name that came over the network.
"""

import hashlib
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import Any

from marsupial.errors import InputError, MarsupialError, UsageError
from marsupial.formats.files import at_home, read_text
from marsupial.wording import unknown_name

_PATTERN = re.compile(r"(?P<file>.+\.py):(?P<kind>\w+)(?::(?P<planner>.+))?")
MOST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class StrategyFile:
    """A class, or another callable, that makes strategies, in a file with this text."""

    path: str  # as it was given
    kind: str  # the name of the class
    text: str

    @property
    def name(self) -> str:
        """Its name in tables and logs, as on the command line."""
        return f"{self.path}:{self.kind}"

    @property
    def package(self) -> str:
        """Where it comes from, for messages."""
        return self.path

    @property
    def digest(self) -> str:
        """A hash of its text."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:16]

    def load(self) -> Callable[..., Any]:
        """Return the class. Raise an `InputError` if the file can't be run or has no such class."""
        return _loaded(self)


def strategy_file(text: str) -> tuple[StrategyFile, str | None] | None:
    """Return the strategy that ``FILE.py:CLASS`` or ``FILE.py:CLASS:PLANNER`` names, and the planner; None if another.

    Raise an `InputError` if there is no such file or class, or the file can't be run; a `UsageError` without a class.
    """
    match = _PATTERN.fullmatch(text)
    if match is None:
        if (path := text.rstrip(":")).endswith(".py"):
            raise UsageError(f"{path}: needs the name of a class behind it, as in {path}:MyStrategy")
        return None
    found = StrategyFile(match["file"], match["kind"], read_text(at_home(match["file"]), InputError, MOST_BYTES))
    found.load()
    return found, match["planner"]


@lru_cache(maxsize=64)
def _loaded(file: StrategyFile) -> Callable[..., Any]:
    module = _module(file.path, file.text)
    found = getattr(module, file.kind, None)
    if found is None:
        own = [one.__name__ for one in vars(module).values() if getattr(one, "__module__", "") == module.__name__]
        said = unknown_name("class", file.kind, own) if own else "has no classes"
        raise InputError(said, source=file.path)
    if not callable(found):
        raise InputError(f"{file.kind} is no class, it is of type {type(found).__name__}", source=file.path)
    made: Callable[..., Any] = found
    return made


@lru_cache(maxsize=64)
def _module(path: str, text: str) -> ModuleType:
    """Run a file as a module, under a name that hides no other module."""
    module = ModuleType(f"marsupial strategy {path}")
    module.__file__ = path
    sys.modules[module.__name__] = module  # dataclasses look it up
    with faults_of(path):
        exec(compile(text, path, "exec"), module.__dict__)
    return module


@contextmanager
def faults_of(path: str) -> Iterator[None]:
    """Raise an `InputError` with the line for an exception from the code of a file; let others pass."""
    try:
        yield
    except MarsupialError:
        raise
    except Exception as error:  # the code of somebody else may raise anything
        if (line := _line(error, path)) is None:
            raise
        text = error.msg if isinstance(error, SyntaxError) else error
        raise InputError(f"line {line}: {type(error).__name__}: {text}", source=path) from error


def _line(error: Exception, path: str) -> int | None:
    """Return the last line of a file in which an error was raised; None if none of its lines was."""
    line = error.lineno if isinstance(error, SyntaxError) and error.filename == path else None
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == path:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line

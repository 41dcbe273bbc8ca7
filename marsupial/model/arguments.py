"""Checks of arguments of the Python API: type and bounds, with errors that name the argument.

Each function returns the checked value. Numpy numbers are accepted and returned as plain ones, so that results can be
written as JSON. A boolean does not count as a number, and numbers must be finite.
"""

import math
import os
import reprlib
from collections.abc import Collection
from numbers import Integral, Real
from pathlib import Path
from typing import NoReturn, TypeVar

from marsupial.errors import UsageError
from marsupial.model.bounds import MOST, Bound
from marsupial.wording import unknown_name

T = TypeVar("T")

ANY = Bound(-math.inf, math.inf)

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = _SHORT.maxother = 60


def whole(name: str, value: object, bound: Bound = ANY) -> int:
    """Return a whole number within the bound as an int."""
    # in Python, True is an integer
    if isinstance(value, bool) or not isinstance(value, Integral):
        refuse(name, "a whole number", value)
    plain = int(value)
    if abs(plain) > MOST:  # too long for Python to print
        refuse(name, f"at most {MOST:g}", float("inf") if plain > 0 else float("-inf"))
    return _within(name, plain, bound)


def number(name: str, value: object, bound: Bound = ANY) -> float:
    """Return a finite number within the bound as a float."""
    if isinstance(value, bool) or not isinstance(value, Real):
        refuse(name, "a number", value)
    try:
        plain = float(value)
    except OverflowError:  # an integer beyond the range of floats
        plain = math.inf
    if not math.isfinite(plain):
        refuse(name, "finite", value)
    return _within(name, plain, bound)


def text(name: str, value: object) -> str:
    """Return a text that is not blank."""
    if not isinstance(value, str) or not value.strip():
        refuse(name, "a text", value)
    return str(value)


def some_of(what: str, given: Collection[str] | None, known: Collection[str]) -> frozenset[str] | None:
    """Return names to keep, checked: a text is a collection of letters, and other values would keep nothing."""
    if given is None:
        return None
    if isinstance(given, str) or not isinstance(given, Collection):
        refuse(what, "a set, list or tuple of names", given)
    if strangers := [one for one in given if not isinstance(one, str)]:
        refuse(what, "names", strangers[0])
    if unknown := sorted(set(given).difference(known)):
        raise UsageError(f"{what}: {unknown_name('name', unknown[0], known) if known else f'there are no {what}'}")
    return frozenset(given)


def with_parts(name: str, value: T, *parts: str) -> T:
    """Return an object of the caller's own that has these attributes, the last one a method."""
    if isinstance(value, type):
        raise UsageError(f"{name}: must be an object, not the class {value.__name__}")
    if missing := [part for part in parts if not hasattr(value, part)]:
        raise UsageError(f"{name}: {type(value).__name__} has no {' and no '.join(missing)}")
    if not callable(getattr(value, parts[-1])):
        refuse(f"{name}: {parts[-1]}", "a method", getattr(value, parts[-1]))
    return value


def path(name: str, value: object) -> Path:
    """Return a `Path` made of a text or a path."""
    try:
        given = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    except TypeError:  # `__fspath__` returned neither text nor bytes
        given = None
    if not isinstance(given, str) or not given or "\0" in given:
        refuse(name, "a path", value)
    return Path(given)


def target(name: str, value: object) -> Path:
    """Return the path of a file to write: not a folder, and in an existing folder."""
    file = path(name, value)
    if os.path.isdir(file):
        raise UsageError(f"{name}: can't write {file}: is a directory")
    if not os.path.isdir(file.parent):
        raise UsageError(f"{name}: can't write {file}: there is no folder {file.parent}")
    return file


def instance(name: str, value: object, kind: type[T]) -> T:
    """Return `value` if it is of type `kind`."""
    if not isinstance(value, kind):
        refuse(name, f"of type {kind.__name__}", value)
    return value


def refuse(name: str, wanted: str, value: object) -> NoReturn:
    """Raise a `UsageError` that says what an argument must be and what it was."""
    raise UsageError(f"{name}: must be {wanted}, got {_SHORT.repr(value)}")


def _within(name: str, value: T, bound: Bound) -> T:
    fault = bound.fault(value)  # type: ignore[arg-type]
    if fault is not None:
        raise UsageError(f"{name}: {fault}")
    return value

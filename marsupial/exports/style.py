"""matplotlib with its own defaults, whatever the settings of the user are.

A `matplotlibrc`, a style or ``MPLBACKEND`` is made for the user's own figures and machine. Ours must look the same
everywhere, and need no LaTeX and no font besides matplotlib's own. So everything is drawn and written inside of
`plain_style`. Figures are never shown by a backend of matplotlib (they are no figures of pyplot), so the user's backend
stays what it is: a notebook goes on with its own.
"""

import os
import sys
from collections import ChainMap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from threading import RLock
from types import ModuleType
from typing import Any

from marsupial.errors import UsageError

_LOCK = RLock()  # the settings of matplotlib are the whole process's

_changes: list[Mapping[str, Any]] = []  # of the contexts that are open; guarded by the lock

_OF_THE_SESSION = ("backend", "interactive", "toolbar")  # settings that no figure depends on


@contextmanager
def plain_style(changes: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Draw and write figures inside with matplotlib's defaults and `changes`; one thread at a time does so.

    A context inside of another one adds its changes.
    """
    matplotlib = _imported()
    defaults = {key: value for key, value in matplotlib.rcParamsDefault.items() if key not in _OF_THE_SESSION}
    with _LOCK:
        _changes.append(changes or {})
        try:
            with matplotlib.rc_context(dict(ChainMap(*reversed(_changes), defaults))):
                yield
        finally:
            _changes.pop()


def _imported() -> ModuleType:
    """Import matplotlib, also with an ``MPLBACKEND`` that is none; raise a `UsageError` for a broken `matplotlibrc`."""
    if "matplotlib" in sys.modules:
        return sys.modules["matplotlib"]
    backend = os.environ.pop("MPLBACKEND", None)  # an unknown one would break the import for the whole process
    try:
        import matplotlib
    except UnicodeDecodeError as error:
        raise UsageError(f"matplotlib can't read its settings, a matplotlibrc: {error}") from error
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = backend  # as matplotlib does when it is imported
    return matplotlib

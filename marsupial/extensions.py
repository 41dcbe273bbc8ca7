"""Other people's strategies and engines: what installed packages name as entry points.

A package names them in its ``pyproject.toml``, by the group's name and a name of its own for each::

    [project.entry-points."marsupial.strategies"]
    wander = "my_package:Wander"

Nothing is imported before it is asked for. One that can't be used says why and keeps no other from being used; names
of marsupial's own can't be taken.
"""

from __future__ import annotations

import sys
from collections.abc import Container
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from marsupial.errors import EngineUnavailable

STRATEGIES, ENGINES = "marsupial.strategies", "marsupial.engines"
"""The groups of entry points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Extension:
    """One entry point: its package, several where they name the same, and what is known to be wrong before loading."""

    name: str
    package: str
    entry: EntryPoint
    fault: str | None

    def load(self) -> Any:
        """Return the object that it names.

        Raises
        ------
        EngineUnavailable
            If it can't be loaded or has a fault.
        """
        if self.fault is not None:
            raise EngineUnavailable(self.fault)
        try:
            return self.entry.load()
        except Exception as error:  # other people's code: whatever it is, it is told
            said = f"{type(error).__name__}: {error}"
            raise EngineUnavailable(f"can't be loaded from {self.package}: {said}") from error


def extensions(group: str, taken: Container[str]) -> tuple[Extension, ...]:
    """Return the entry points of a group in the order of their names; those called like one `taken` have a fault."""
    by_name: dict[str, list[EntryPoint]] = {}
    for entry in _entries(group, tuple(sys.path)):
        by_name.setdefault(entry.name, []).append(entry)
    return tuple(_extension(name, by_name[name], name in taken) for name in sorted(by_name))


def extension_names(group: str, taken: Container[str]) -> tuple[str, ...]:
    """Return the names in a group that are not `taken`, in order."""
    return tuple(found.name for found in extensions(group, taken) if found.name not in taken)


def extension(group: str, name: str, taken: Container[str]) -> Extension | None:
    """Return the entry point of that name; None if there is none, or only one that takes a name of marsupial's own."""
    if name in taken:
        return None
    return next((found for found in extensions(group, taken) if found.name == name), None)


@lru_cache(maxsize=8)
def _entries(group: str, path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, as far as they are found on that path: it takes 10 ms to look at them all."""
    return tuple(entry_points(group=group))


def _extension(name: str, entries: list[EntryPoint], is_taken: bool) -> Extension:
    packages = {entry.dist.name if entry.dist is not None else entry.module for entry in entries}
    package = " and ".join(sorted(packages))
    fault = None
    if is_taken:
        fault = f"{package} can't take this name: it is one of marsupial's own"
    elif len({entry.value for entry in entries}) > 1:
        fault = f"named more than once, by {package}"
    return Extension(name=name, package=package, entry=entries[0], fault=fault)

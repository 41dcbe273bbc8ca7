"""Strategies and engines of other packages, found by entry points.

A package lists them in its ``pyproject.toml``, under the name of the group::

    [project.entry-points."marsupial.strategies"]
    wander = "my_package:Wander"

An extension is imported only when it is used. An unusable one gives the reason and does not affect others. An
extension can't replace a strategy or engine of marsupial's own.
"""

import sys
from collections.abc import Container
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from marsupial.errors import EngineUnavailable

STRATEGIES, ENGINES = "marsupial.strategies", "marsupial.engines"  # the groups of entry points


@dataclass(frozen=True, slots=True, kw_only=True)
class Extension:
    """One entry point: its package (several joined by "and" if they use one name), and its fault if known already."""

    name: str
    package: str
    entry: EntryPoint
    fault: str | None

    def load(self) -> Any:
        """Return the object of the entry point. Raise `EngineUnavailable` if it can't be loaded or has a fault."""
        if self.fault is not None:
            raise EngineUnavailable(self.fault)
        try:
            return self.entry.load()
        except Exception as error:  # another package's code may raise anything
            message = f"can't be loaded from {self.package}: {type(error).__name__}: {error}"
            raise EngineUnavailable(message) from error


def extensions(group: str, taken: Container[str]) -> tuple[Extension, ...]:
    """Return the entry points of a group, sorted by name; those with a name in `taken` have a fault."""
    by_name: dict[str, list[EntryPoint]] = {}
    for entry in _entries(group, tuple(sys.path)):
        by_name.setdefault(entry.name, []).append(entry)
    return tuple(_extension(name, by_name[name], name in taken) for name in sorted(by_name))


def extension_names(group: str, taken: Container[str]) -> tuple[str, ...]:
    """Return the names in a group that are not in `taken`, sorted."""
    return tuple(found.name for found in extensions(group, taken) if found.name not in taken)


def extension(group: str, name: str, taken: Container[str]) -> Extension | None:
    """Return the entry point of that name; None if there is none or the name is in `taken`."""
    if name in taken:
        return None
    return next((found for found in extensions(group, taken) if found.name == name), None)


@lru_cache(maxsize=8)
def _entries(group: str, path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group. A search takes 10 ms, so it is repeated only if the import path changes."""
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

"""Engines that installed packages bring along, by the entry points `marsupial.engines`."""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import replace
from typing import NoReturn

from marsupial.errors import EngineUnavailable
from marsupial.extensions import ENGINES, Extension, extension, extensions
from marsupial.model.planning import Engine, EngineInfo


class Missing:
    """Stands in for an engine that can't be used: says why."""

    def __init__(self, name: str, package: str, reason: str) -> None:
        self.info = EngineInfo(name=name, summary=f"of {package}", missing=reason)

    def solve(self, *_: object, **__: object) -> NoReturn:
        """Refuse."""
        raise EngineUnavailable(f"{self.info.name}: {self.info.missing}")


def extension_engine(name: str, taken: Container[str]) -> Engine | None:
    """Return the engine that an installed package calls `name`, which may be `Missing`; None if there is none."""
    found = extension(ENGINES, name, taken)
    return None if found is None else _made(found)


def extension_infos(taken: Container[str]) -> Iterator[EngineInfo]:
    """Yield what there is to say of every engine of installed packages, those included that can't be used."""
    for found in extensions(ENGINES, taken):
        name = f"{found.name} ({found.package})" if found.name in taken else found.name
        yield replace(_made(found).info, name=name)


def _made(found: Extension) -> Engine:
    try:
        engine: Engine = found.load()()
        if not isinstance(engine.info, EngineInfo) or not callable(engine.solve):
            raise TypeError("no engine: `info` must be an EngineInfo and `solve` a method")
    except EngineUnavailable as error:
        return Missing(found.name, found.package, str(error))
    except Exception as error:  # other people's code
        return Missing(found.name, found.package, f"can't be made: {type(error).__name__}: {error}")
    return engine

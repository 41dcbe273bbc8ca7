"""Engines of installed packages, found by the entry points `marsupial.engines`."""

from collections.abc import Container, Generator, Iterable, Iterator
from dataclasses import replace
from typing import Any, NoReturn

from marsupial.errors import EngineUnavailable
from marsupial.extensions import ENGINES, Extension, extension, extensions
from marsupial.model import Budget, Engine, EngineInfo, Finished, Improved, Situation
from marsupial.model.arguments import refuse
from marsupial.model.plan import checked_plan


class CheckedEngine:
    """Checks the events of a third-party engine."""

    def __init__(self, engine: Engine) -> None:
        self._engine, self.info = engine, engine.info

    def solve(self, situation: Situation, budget: Budget, **options: Any) -> Iterator[Improved | Finished]:
        events: object = self._engine.solve(situation, budget, **options)
        if not isinstance(events, Iterable):
            refuse(f"planner {self.info.name}: solve", "an iterator of Improved and Finished", events)
        try:
            for event in events:
                if not isinstance(event, Improved | Finished):
                    refuse(f"planner {self.info.name}: what solve yields", "Improved or Finished", event)
                if isinstance(event, Improved):
                    checked_plan(f"planner {self.info.name}: Improved.plan", event.plan)
                yield event
        finally:
            if isinstance(events, Generator):
                events.close()


class Missing:
    """Stands in for an engine that can't be used, with the reason."""

    def __init__(self, name: str, package: str, reason: str) -> None:
        self.info = EngineInfo(name=name, summary=f"of {package}", missing=reason)

    def solve(self, *_: object, **__: object) -> NoReturn:
        raise EngineUnavailable(f"{self.info.name}: {self.info.missing}")


def extension_engine(name: str, taken: Container[str]) -> Engine | None:
    """Return the engine that an installed package calls `name`, which may be `Missing`; None if there is none."""
    found = extension(ENGINES, name, taken)
    return None if found is None else _made(found)


def extension_infos(taken: Container[str]) -> Iterator[EngineInfo]:
    """Yield the description of every engine of installed packages, usable or not."""
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
    except Exception as error:  # third-party code
        return Missing(found.name, found.package, f"can't be made: {type(error).__name__}: {error}")
    return CheckedEngine(engine)

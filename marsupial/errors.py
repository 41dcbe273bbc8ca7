"""The tree of marsupial's exceptions.

::

    MarsupialError
    ├── InputError          input from outside is wrong; lists every wrong field
    │   ├── MapError            a map file or generator
    │   ├── ScenarioError       a scenario file or the options that change it
    │   ├── SituationError      a situation, as JSON or as PDDL
    │   ├── PlanTextError       a plan file that can't be read
    │   └── LogError            a mission log that can't be read
    ├── UsageError          a request that makes no sense (unknown engine, budget of the wrong kind)
    ├── EngineUnavailable   an engine, or a strategy of another package, that can't be used here; gives the reason
    ├── InvalidPlanError    a plan that the checker refused where a valid one is required
    └── InternalError       a bug in marsupial

An engine that finds no plan returns a result (`marsupial.model.planning.Outcome`); it raises nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass


class MarsupialError(Exception):
    """Root of the tree."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One wrong field: its path (``robot_types[1].speed_mps``) and what is wrong with it.

    `line` is its line in the file, from 1, or None if that is not known.
    """

    path: str
    message: str
    line: int | None = None

    def __str__(self) -> str:
        text = f"{self.path}: {self.message}" if self.path else self.message
        return text if self.line is None else f"line {self.line}: {text}"


class InputError(MarsupialError):
    """Input from outside that can't be used; `problems` lists every wrong field, `source` names the file."""

    def __init__(self, problems: Iterable[Problem] | str, *, source: str = "") -> None:
        if isinstance(problems, str):
            problems = (Problem("", problems),)
        self.problems = tuple(problems)
        self.source = source
        lines = [str(problem) for problem in self.problems]
        super().__init__("\n".join(f"{source}: {line}" if source else line for line in lines))


class MapError(InputError):
    """A map that can't be read or generated."""


class ScenarioError(InputError):
    """A scenario that can't be run as written."""


class SituationError(InputError):
    """A situation (JSON or PDDL) that can't be planned for as written."""


class PlanTextError(InputError):
    """A plan file that can't be read."""


class LogError(InputError):
    """A mission log that can't be read."""


class UsageError(MarsupialError):
    """A request that makes no sense as a whole."""


class EngineUnavailable(MarsupialError):
    """An engine or strategy that can't be used on this machine; the message says why and what to install."""


class InvalidPlanError(MarsupialError):
    """A plan that the checker refused where a valid one is required."""


class InternalError(MarsupialError):
    """A bug in marsupial."""

"""The planners that clients can choose: ours, those of installed packages, and the operator's named command lines.

Clients see only the names, never a command line.
"""

from collections.abc import Mapping
from dataclasses import replace

from marsupial.errors import UsageError
from marsupial.model.planning import NO_PLANNER, EngineInfo
from marsupial.planning.engines import engine
from marsupial.planning.names import engine_names
from marsupial.wording import unknown_name


def planner_names(commands: Mapping[str, str]) -> list[str]:
    """Return the names of all planners: ours first, then those of installed packages, then those of `commands`."""
    return [*engine_names(), *sorted(commands)]


def engine_name(planner: str, commands: Mapping[str, str]) -> str:
    """Return the library's name of a planner that was chosen by its name. Raises UsageError if there is none.

    Names come from requests, or from a store that others may write to: neither may choose what is run.
    """
    names = planner_names(commands)
    if planner not in (*names, NO_PLANNER):
        if ":" in planner:
            raise UsageError("must be the name of a planner, not a command line")
        raise UsageError(unknown_name("planner", planner, names))
    return commands.get(planner, planner)


def planner_info(name: str, commands: Mapping[str, str]) -> EngineInfo:
    """Return the description of a planner. Raises UsageError if there is none of that name."""
    return replace(engine(engine_name(name, commands)).info, name=name)


def planner_infos(commands: Mapping[str, str]) -> tuple[EngineInfo, ...]:
    """Describe every planner, in the order of `planner_names`. Raises UsageError if a command can't be offered."""
    taken = sorted(commands.keys() & set(engine_names()))
    if taken:
        raise UsageError(f"--planner: {taken[0]!r} is the name of another planner; choose a different name")
    return tuple(planner_info(name, commands) for name in planner_names(commands))

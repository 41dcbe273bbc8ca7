"""The planners that clients can name: ours, and the command lines that the operator has given names.

Clients hear those names only, never a command line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from marsupial.errors import UsageError
from marsupial.model.planning import EngineInfo
from marsupial.planning.engines import engine, engine_infos


def planner_infos(commands: Mapping[str, str]) -> Mapping[str, EngineInfo]:
    """Return what there is to say of every planner, by name: ours first, then those of `commands`.

    Raises
    ------
    UsageError
        If a command is called like a planner of ours, or has no places for the files.
    """
    ours = {info.name: info for info in engine_infos()}
    taken = sorted(set(ours) & set(commands))
    if taken:
        raise UsageError(f"--planner: {taken[0]} is a planner already, give the command another name")
    return ours | {name: replace(engine(commands[name]).info, name=name) for name in sorted(commands)}

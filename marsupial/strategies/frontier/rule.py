"""The protocol of frontier rules, and their parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import ClassVar, Protocol

from marsupial.errors import UsageError
from marsupial.strategies.frontier.view import FrontierView


class FrontierRule(Protocol):
    """Chooses a frontier cell for each robot. Its dataclass fields are the parameters of the paper."""

    name: ClassVar[str]
    # whether it is asked at each cell that a robot reaches; if not, whenever a robot has arrived
    each_step: ClassVar[bool]
    # whether it is asked as soon as the frontier cell that a robot drives to is none any more, since some robot has
    # seen what is behind it
    gives_up: ClassVar[bool]
    most_robots: ClassVar[int | None]  # most robots it can lead; None for any number

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the frontier cell (row-major) of robots by name; the others keep their goals, or wait.

        Any other cell that the robot can drive to is allowed too, for a step aside.
        """


def with_parameters(rule: type[FrontierRule], text: str) -> FrontierRule:
    """Return the rule with the values of a text like ``W_n=1/W_p=0.5``, all others being the paper's.

    Raises
    ------
    UsageError
        If a value is not a finite number of 0 or more, or the rule has no such parameter.
    """
    known = [each.name for each in fields(rule) if each.init]  # type: ignore[arg-type]
    values: dict[str, float] = {}
    for part in text.split("/"):
        name, _, number = part.partition("=")
        if name not in known or name in values:
            takes = f"the parameters {', '.join(known)}, once each" if known else "no parameters"
            raise UsageError(f"strategy {rule.name}: takes {takes}, got {part!r}")
        try:
            values[name] = float(number)
        except ValueError:
            values[name] = math.nan
        if not 0 <= values[name] < math.inf:
            raise UsageError(f"strategy {rule.name}: {name}: must be a number, 0 or more, got {number!r}")
    return rule(**values)

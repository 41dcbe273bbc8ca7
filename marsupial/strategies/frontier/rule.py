"""What a strategy of frontiers is: a rule that picks frontier cells, when it is asked, and its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import ClassVar, Protocol

from marsupial.errors import UsageError
from marsupial.strategies.frontier.view import FrontierView


class FrontierRule(Protocol):
    """Picks the frontier cell that each robot goes to. Its dataclass fields are the parameters of the paper.

    Attributes
    ----------
    each_step
        Whether it is asked anew at each cell that a robot comes to; if not, whenever a robot has arrived.
    gives_up
        Whether it is asked as soon as another robot, or its own on the way, has seen what is behind a frontier cell
        that a robot is still driving to.
    most_robots
        How many robots it can lead; None for any number.
    """

    name: ClassVar[str]
    each_step: ClassVar[bool]
    gives_up: ClassVar[bool]
    most_robots: ClassVar[int | None]

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return a frontier cell (row-major index) for robots by name; the others keep to their ways, or wait.

        It may be another cell that the robot can drive to, for a step aside.
        """


def with_parameters(rule: type[FrontierRule], text: str) -> FrontierRule:
    """Return the rule with the values that a text like ``W_n=1/W_p=0.5`` gives; the others are the paper's.

    Raises
    ------
    UsageError
        If a value is no finite number, 0 or more, or the rule has no such parameter.
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

"""The protocol of frontier rules, and their parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import ClassVar, Protocol, TypeVar

from marsupial.errors import UsageError
from marsupial.strategies.frontier.view import FrontierView


class FrontierRule(Protocol):
    """Chooses a frontier cell for each robot. Its dataclass fields are the parameters of the paper.

    Attributes
    ----------
    each_step
        Whether it is asked at each cell that a robot reaches; if not, whenever a robot has arrived.
    gives_up
        Whether it is asked as soon as the frontier cell that a robot drives to is none any more, since some robot has
        seen what is behind it.
    most_robots
        Most robots it can lead; None for any number.
    """

    name: ClassVar[str]
    each_step: ClassVar[bool]
    gives_up: ClassVar[bool]
    most_robots: ClassVar[int | None]

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return a frontier cell (row-major index) for robots by name; the others keep their goals, or wait.

        Any other cell that the robot can drive to is allowed too, for a step aside.
        """


class Parametrised(Protocol):
    """A dataclass whose fields are the parameters of the strategy `name`."""

    name: ClassVar[str]


P = TypeVar("P", bound=Parametrised)


def with_parameters(rule: type[P], text: str) -> P:
    """Return the rule with the values of a text like ``W_n=1/W_p=0.5``; the others are the paper's.

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

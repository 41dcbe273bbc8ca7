"""What a strategy of frontiers is: a rule that picks frontier cells, and when it is asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Protocol

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

"""Frontier rules: their protocol, their parameters, and the base of rules by bids.

Bidders take the frontier cell with the highest bid one after the other, in the order of the team, on the same map, and
bid again at every cell they reach. Of equal bids that for the first cell wins, row by row. As bids may change with
every step, a robot may oscillate between two cells: it is sent to a random neighbouring cell then.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.errors import UsageError
from marsupial.strategies.frontier.view import Explorer, FrontierView

EQUAL = 1e-9  # greatest difference of equal bids


class FrontierRule(Protocol):
    """Chooses a frontier cell for each robot. Its dataclass fields are the parameters of the paper."""

    name: ClassVar[str]
    # whether it is asked at each cell that a robot reaches; if not, whenever a robot has arrived
    each_step: ClassVar[bool] = True
    # whether it is asked as soon as some robot has seen what is behind the frontier cell that a robot drives to
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None  # None for any number

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return a frontier cell (row-major) for robots by name, or one beside them; the others keep their goals."""


class Parametrised(Protocol):
    """A dataclass whose fields are the parameters of the strategy `name`."""

    name: ClassVar[str]


P = TypeVar("P", bound=Parametrised)


def with_parameters(rule: type[P], text: str) -> P:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Bidders(FrontierRule):
    """Base of the rules by bids: robots bid one after the other."""

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        goals = {robot.name: robot.goal for robot in view.robots}
        for robot in view.robots:
            others = [other for other in view.robots if other is not robot]
            aims = [goal for other in others if (goal := goals[other.name]) is not None]
            ways = view.ways(robot)
            bids = self.bids(view, robot, ways, others, aims)
            bids[~np.isfinite(ways)] = -np.inf
            if robot.oscillates:
                near = view.around(robot)
                goals[robot.name] = int(view.rng.choice(near)) if len(near) else None
            elif np.isfinite(bids).any():
                best = int(np.argmax(bids >= bids.max() - EQUAL))
                goals[robot.name] = int(view.frontier(robot).cells[best])
            else:
                goals[robot.name] = None
        return {name: goal for name, goal in goals.items() if goal is not None}

    @abstractmethod
    def bids(
        self, view: FrontierView, robot: Explorer, ways: Floats, others: list[Explorer], aims: list[int]
    ) -> Floats:
        """Return the bids (n,) of a robot for its frontier cells, at `ways` cells; `aims` are the others' goals."""


def counted(mask: Flags, around: Ints, cells: Ints) -> Floats:
    """Return how many cells of a mask (height, width) are set around each of n cells, by a Fourier transform.

    `around` (k, 2) are the offsets dx, dy of the cells to count, at least (0, 0).
    """
    reach = int(np.abs(around).max())
    shape = (mask.shape[0] + 2 * reach, mask.shape[1] + 2 * reach)
    kernel = np.zeros(shape)
    kernel[-around[:, 1], -around[:, 0]] = 1.0  # negative indices count from the end, where a periodic signal continues
    found = np.fft.irfft2(np.fft.rfft2(mask, shape) * np.fft.rfft2(kernel), shape)
    return np.rint(found[: mask.shape[0], : mask.shape[1]].ravel()[cells])

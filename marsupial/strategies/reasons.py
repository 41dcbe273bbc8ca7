"""Why a plan was chosen: which plans were compared at which price, and where the next best one would send the robots.

Plans for a guess differ mostly far ahead, where they will be made anew. So two plans count as the same here if their
robots go to the same `AHEAD` places first, and what is told of another plan ends there, too.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from marsupial.model import Action, GuessedGround, Plan, Reasons, Value

AHEAD = 2  # places of each robot

_Stops = tuple[tuple[str, tuple[str, ...]], ...]  # the first places of each robot that acts


class Candidate(NamedTuple):
    """A plan that was compared: whose it is, how many targets it leaves out, its value by the objective."""

    maker: str
    plan: Plan
    left_out: int
    value: Value


def reasons(
    candidates: Sequence[Candidate],
    scale: float,
    guess: GuessedGround | None,
    followed: Callable[[Plan], Iterable[Action]],
) -> Reasons:
    """Return the reasons for the first of the candidates; the best ones come first.

    Values divided by `scale` are prices in ms; `followed` returns the actions of a plan that robots will follow.
    """
    distinct: dict[_Stops, Candidate] = {}
    for one in candidates:
        distinct.setdefault(_stops(followed(one.plan)), one)
    chosen, second = (dict(stops) for stops in (*distinct, *distinct)[:2])
    return Reasons(
        guess=guess,
        compared=tuple((one.maker, round(one.value[0] / scale), one.left_out) for one in distinct.values()),
        instead=tuple(
            (robot, second.get(robot, ()))
            for robot in sorted(chosen | second)
            if second.get(robot) != chosen.get(robot)
        ),
    )


def _stops(actions: Iterable[Action]) -> _Stops:
    stops: dict[str, tuple[str, ...]] = {}
    for action in actions:
        for robot in action.robots:
            before = stops.get(robot, ())
            if action.place not in before[-1:] and len(before) < AHEAD:
                stops[robot] = (*before, action.place)
    return tuple(sorted(stops.items()))

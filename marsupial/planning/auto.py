"""The default planner: annealing at once, and beside it, on small teams, an exact search that can prove its plan best.

Aries is left out. On the fourteen situations of the planner suite with up to eight targets, ten seconds each, it found
no plan that annealing has not within one second, the same makespan three times, a longer one four times and none seven
times, and proved nothing; its processes take a core meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable

from marsupial.model.planning import Engine, EngineInfo
from marsupial.model.situation import Situation
from marsupial.planning.aims import Aim
from marsupial.planning.branch_and_bound.engine import Exact
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.portfolio.engine import Latest, Member, Portfolio
from marsupial.planning.portfolio.race import Clock

MOST_TARGETS, MOST_ROBOTS = 12, 9
"""Up to here an exact search is worth its core.

Of the 16 situations of the planner suite within these limits that have targets, 15 are proven, in 0.1 to 3 s on two
busy cores; the last one, three carriers and 12 targets, is left with a bound 8 % below its best plan after 10 s.
Annealing has one thread there: in 0.1 s and in 1 s that finds plans as short as two threads do.
"""

HEAD_START_S = 0.01
"""How long annealing runs alone: it has a plan by then, and an exact search takes over better ones as they come."""

INFO = EngineInfo(
    name="auto",
    summary="the default: marsupial's own side by side, the best plan of all",
    licence="Apache-2.0",
    anytime=True,
    proves_optimality=True,
    deterministic_steps=True,
)


class Auto(Portfolio):
    """The portfolio; with an aim, which nothing can be proven about, it is annealing alone."""

    def aimed(self, aim: Aim) -> Anytime:
        """Return the engine whose plans get better by this aim."""
        return Anytime().aimed(aim)


def auto(exact: Callable[[Clock, Latest], Engine] = Exact) -> Auto:
    """Return the engine; `exact` makes the one that proves small situations."""
    return Auto(
        INFO,
        Member(name="anytime", make=_annealing, suits=lambda situation: not _is_small(situation)),
        Member(name="anytime", make=_annealing_beside, suits=_is_small),
        Member(name="exact", make=exact, suits=_is_small, head_start_s=HEAD_START_S),
    )


def _annealing(clock: Clock, latest: Latest) -> Anytime:
    return Anytime(clock)


def _annealing_beside(clock: Clock, latest: Latest) -> Anytime:
    """Return annealing that leaves a core to others."""
    return Anytime(clock, searches=1)


def _is_small(situation: Situation) -> bool:
    return len(situation.targets) <= MOST_TARGETS and len(situation.robots) <= MOST_ROBOTS

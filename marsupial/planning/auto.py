"""The default planner: local search, and for small teams branch and bound in parallel, to prove a plan optimal.

docs/planners.md says why Aries is not included, and how much is proven within the limits.
"""

from collections.abc import Callable, Iterator

from marsupial.model import MAKESPAN, Budget, Engine, Finished, Improved, Objective, Plan, Role, Situation
from marsupial.planning import infos
from marsupial.planning.branch_and_bound.engine import Exact, unsupported
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.portfolio.engine import Latest, Portfolio, PortfolioMember
from marsupial.planning.race import WallClock

MOST_TARGETS = 12  # most targets for which branch and bound is worth its core; local search has one thread then
MOST_ROVERS = 10  # most rovers for that if all must end aboard; otherwise the engine's own limit applies

HEAD_START_S = 0.01  # local search runs alone this long and has a plan by then; exact adopts better plans later


class Auto(Portfolio):
    """The portfolio for the makespan, local search alone for priced arrival.

    So the temporal strategy gets local search, with both its threads: branch and bound only minimises makespans, and
    its bounds do not apply to priced arrival. Branch and bound is also omitted if the goal is only to recover rovers or
    to drive home: a mission would wait longer for its code than for those plans.
    """

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        if objective == MAKESPAN:
            return super().solve(situation, budget, start=start)
        return Anytime().solve(situation, budget, objective=objective, start=start)


def auto(exact: Callable[[WallClock, Latest], Engine] = Exact) -> Auto:
    """Return the engine; `exact` makes the engine that proves small situations."""
    return Auto(
        infos.AUTO,
        PortfolioMember("anytime", lambda clock, latest: Anytime(clock), lambda situation: not _is_small(situation)),
        PortfolioMember("anytime", lambda clock, latest: Anytime(clock, searches=1), _is_small),
        PortfolioMember("exact", exact, _is_small, head_start_s=HEAD_START_S),
    )


def _is_small(situation: Situation) -> bool:
    if situation.goal.aboard and len(situation.of_role(Role.ROVER)) > MOST_ROVERS:
        return False
    return 0 < len(situation.targets) <= MOST_TARGETS and unsupported(situation) is None

"""The exact engine: plans with the shortest makespan, proven so, for small teams and few targets.

It begins with a given plan, or the plan of a short annealing, and searches for shorter plans until none exists
(`marsupial.planning.branch_and_bound.search`), from above and from below (`marsupial.planning.branch_and_bound.proof`).
If neither list scheduling nor annealing has a plan, it first searches for any plan, as if nothing took time: if there
is none, that is a proof. If the budget is too small for a proof, there is a bound. Proofs and bounds hold to 1 ms, and
with 1 ms between the actions of a robot (`EPSILON_MS`).
"""

import time
from collections.abc import Callable, Iterator

from marsupial.model import MAKESPAN, Budget, Finished, Improved, Objective, Outcome, Plan, Role, Situation
from marsupial.planning import infos
from marsupial.planning.branch_and_bound.memory import MAX_CARRIERS, MAX_CODES, MAX_ROVERS, MAX_TARGETS
from marsupial.planning.branch_and_bound.proof import OptimalityProof
from marsupial.planning.checker import check
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.reachability import impossible

ANNEALING_STEPS = 100  # steps of the anytime engine that look for a good plan first
TABLES_BYTES = 1 << 26  # most memory for tours over sets of targets; in total less than 256 MB are used


class Exact:
    """The engine; `latest` returns other engines' best valid plan. A budget step is a step of each search."""

    info = infos.EXACT

    def __init__(
        self, clock: Callable[[], float] = time.perf_counter, latest: Callable[[], Plan | None] = lambda: None
    ) -> None:
        self._clock, self._latest = clock, latest

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.info.require(objective)
        begun = self._clock()
        complaint = unsupported(situation)
        if complaint is not None:
            yield Finished(outcome=Outcome.UNSUPPORTED, detail=complaint, elapsed_s=self._clock() - begun)
            return
        best: Plan | None = None
        for plan in _first_plans(situation, start):
            if best is None or plan.makespan_ms < best.makespan_ms:  # only makespans are proven here
                best = plan
                yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        proof = impossible(situation) if best is None else None
        if proof is not None:
            yield Finished(outcome=Outcome.UNSOLVABLE, detail=proof, elapsed_s=self._clock() - begun)
            return
        search = OptimalityProof(situation, best, self._latest)
        for plan in search.plans(_may_step(budget, self._clock, begun)):
            yield Improved(plan=plan, elapsed_s=self._clock() - begun)
        yield search.finished(self._clock() - begun)


def unsupported(situation: Situation) -> str | None:
    """Return why a situation is too large for the engine, or None."""
    carriers, rovers = (len(situation.of_role(role)) for role in (Role.CARRIER, Role.ROVER))
    bases = len(situation.meetings) + sum(robot.place is not None for robot in situation.robots)
    for count, most, what in (
        (len(situation.targets), MAX_TARGETS, "targets"),
        (carriers, MAX_CARRIERS, "carriers"),
        (rovers, MAX_ROVERS, "rovers"),
        (bases + carriers, MAX_CODES - 1, "starts, meetings and carriers"),
    ):
        if count > most:
            return f"{count} {what}: the exact engine takes {most} at most"
    kinds, robots = len(situation.types), len(situation.robots)
    rows = bases * (kinds * len(situation.meetings) + robots * (2 + kinds))
    if 8 * rows << len(situation.targets) > TABLES_BYTES:
        return f"{len(situation.targets)} targets and {bases} starts and meetings: too many together"
    return None


def _may_step(budget: Budget, clock: Callable[[], float], begun: float) -> Callable[[], bool]:
    """Return a function that returns before each step whether the budget allows it."""
    if budget.seconds is not None:
        seconds = budget.seconds
        return lambda: clock() - begun < seconds
    steps = iter(range(budget.steps or 0))
    return lambda: next(steps, None) is not None


def _first_plans(situation: Situation, start: Plan | None) -> Iterator[Plan]:
    if start is not None and check(situation, start).valid:
        yield start
        return
    for event in Anytime().solve(situation, Budget(steps=ANNEALING_STEPS)):
        if isinstance(event, Improved):
            yield event.plan

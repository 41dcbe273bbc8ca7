"""The incumbent: the best plan so far that the checker accepts."""

from marsupial.model import MAKESPAN, Objective, Plan, Situation, Value
from marsupial.planning.checker import Violation, check


class Incumbent:
    """The best plan so far by an objective; with `partial`, plans for some targets count, the more the better."""

    def __init__(self, situation: Situation, objective: Objective = MAKESPAN, *, partial: bool = False) -> None:
        self._situation, self._objective, self._partial = situation, objective, partial
        self._rank: tuple[int, Value] | None = None
        self.plan: Plan | None = None  # None before there is one
        # the checker's objection to the last plan checked, or None
        self.violation: Violation | None = None
        self.refused: list[Violation] = []  # the violations of all plans that it has refused

    @property
    def value(self) -> Value | None:
        return None if self._rank is None else self._rank[1]

    def take(self, plan: Plan) -> bool:
        """Check a plan and keep it if it is better than all before; return whether it is."""
        self.violation = check(self._situation, plan, targets=plan.explored if self._partial else None).violation
        if self.violation is not None:
            self.refused.append(self.violation)
            return False
        rank = -len(plan.explored), self._objective.value(self._situation, plan)
        if self._rank is not None and rank >= self._rank:
            return False
        self.plan, self._rank = plan, rank
        return True

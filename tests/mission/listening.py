"""A strategy that shows what it is asked."""

from marsupial.model import Budget, Situation
from marsupial.model.strategy import Briefing, Decision
from marsupial.planning.greedy import Greedy
from marsupial.strategies.temporal import Temporal


class Listening:
    """A strategy that records its situations."""

    name = "listening"

    def __init__(self) -> None:
        self._strategy = Temporal(Greedy(), Budget(steps=1))
        self.asked: list[Situation] = []

    def decide(self, briefing: Briefing) -> Decision:
        self.asked.append(briefing.situation)
        return self._strategy.decide(briefing)

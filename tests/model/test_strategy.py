from collections.abc import Iterable

import pytest

from marsupial.errors import ScenarioError
from marsupial.model import Briefing, Decision, Plan, Role, Strategy
from marsupial.model.strategy import as_strategy

DECISION = Decision(plan=Plan(actions=()))


class Plain:
    """A minimal strategy of another package."""

    name = "plain"

    def decide(self, briefing: Briefing) -> Decision:
        return DECISION


class Choosy(Plain):
    """A strategy that refuses all teams and has a replanning policy."""

    def suits(self, roles: Iterable[Role]) -> None:
        raise ScenarioError("no team is good enough")

    def replanning(self, *circumstances: object) -> object:
        return circumstances


def test_an_object_with_a_name_and_decide_gets_the_defaults_of_a_strategy() -> None:
    strategy = as_strategy(Plain())
    assert strategy.name == "plain"
    assert strategy.decide(None) is DECISION  # type: ignore[arg-type]
    assert strategy.replanning(None, {}, {}, None) is None  # type: ignore[arg-type]
    strategy.suits([Role.CARRIER, Role.ROVER])


def test_methods_that_an_object_has_replace_the_defaults() -> None:
    strategy = as_strategy(Choosy())
    assert strategy.replanning(1, 2, 3, 4) == (1, 2, 3, 4)  # type: ignore[arg-type]
    with pytest.raises(ScenarioError, match="no team is good enough"):
        strategy.suits([Role.CARRIER])


def test_a_strategy_is_used_as_it_is() -> None:
    class Derived(Strategy):
        name = "derived"

    strategy = Derived()
    assert as_strategy(strategy) is strategy

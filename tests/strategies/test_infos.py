"""The table of strategy infos, which is separate from their code, matches the strategies."""

import math
from dataclasses import fields

import pytest

from marsupial.errors import ScenarioError
from marsupial.model import Budget, Role
from marsupial.strategies.infos import ONE_ROBOT, OWN, WITHOUT_ROVERS
from marsupial.strategies.registry import RULES, STRATEGIES, check_suits, frontier_rule, strategy
from marsupial.strategies.temporal import TemporalParts

TEAMS = {
    (Role.CARRIER,): ("any", WITHOUT_ROVERS, ONE_ROBOT),
    (Role.CARRIER, Role.CARRIER): ("any", WITHOUT_ROVERS),
    (Role.CARRIER, Role.ROVER): ("any",),
}
"""Names of teams in strategy infos, by an example of such a team."""


def test_every_strategy_has_one_info_in_the_order_of_the_registry() -> None:
    assert [info.name for info in OWN] == list(STRATEGIES)


@pytest.mark.parametrize("info", OWN, ids=lambda info: info.name)
def test_the_team_is_the_one_that_the_strategy_leads(info) -> None:  # type: ignore[no-untyped-def]
    made = strategy(info.name, planner="greedy", budget=Budget(steps=1))
    for team, names in TEAMS.items():
        try:
            check_suits(made, team)
        except ScenarioError:
            assert info.team not in names
        else:
            assert info.team in names


@pytest.mark.parametrize("info", OWN, ids=lambda info: info.name)
def test_the_parameters_are_those_of_the_strategy(info) -> None:  # type: ignore[no-untyped-def]
    rule = frontier_rule(info.name) if info.name in RULES else TemporalParts if info.name == "temporal" else None
    known = () if rule is None else [each for each in fields(rule) if each.init]  # type: ignore[arg-type]
    assert {name: math.inf if value is None else value for name, value in info.parameters.items()} == {
        each.name: each.default for each in known
    }

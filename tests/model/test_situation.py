"""A situation restricted to some of what it holds, and what an editor shows of its fields."""

import ast
import inspect
from dataclasses import fields
from typing import Any

import pytest
from support.planning.situations import two_rooms

from marsupial.errors import UsageError
from marsupial.model import situation, strategy


@pytest.mark.parametrize("kind", [set, frozenset, list, tuple])
def test_a_situation_is_restricted_to_names(kind: Any) -> None:
    whole = two_rooms()
    name = whole.targets[0].name
    assert [target.name for target in whole.restricted(targets=kind([name])).targets] == [name]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"targets": "abc"}, "targets: must be a set, list or tuple of names, got 'abc'"),
        ({"targets": two_rooms().targets}, "targets: must be names, got TargetInfo"),
        ({"targets": (one for one in ("t1",))}, "targets: must be a set, list or tuple of names, got <generator"),
        ({"targets": ["t1", "nowhere"]}, "targets: unknown name 'nowhere'"),
        ({"robots": {"nobody"}}, "robots: unknown name 'nobody'"),
        ({"chargers": {"c"}}, "chargers: there are no chargers"),
    ],
)
def test_what_names_nothing_is_refused(given: Any, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        two_rooms().restricted(**given)


@pytest.mark.parametrize(
    "kind",
    [
        strategy.Briefing, strategy.Decision, strategy.PlanningReport, strategy.Square, strategy.Unseen,
        situation.Situation, situation.RobotState, situation.TargetInfo, situation.PlanningType,
        situation.PlanningBattery, situation.SituationGoal,
    ],
)  # fmt: skip
def test_each_field_has_a_docstring_that_editors_show(kind: Any) -> None:
    (found,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(found, ast.ClassDef)
    said = {
        first.target.id
        for first, then in zip(found.body, found.body[1:], strict=False)
        if isinstance(first, ast.AnnAssign)
        and isinstance(first.target, ast.Name)
        and isinstance(then, ast.Expr)
        and isinstance(then.value, ast.Constant)
    }
    assert said == {each.name for each in fields(kind)} - {"return_home"}  # a field of its base class

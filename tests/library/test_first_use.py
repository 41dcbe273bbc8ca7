from __future__ import annotations

import pytest

from marsupial.library.first_use import prepare
from marsupial.model.planning import Budget
from marsupial.model.situation import Situation
from marsupial.planning import engines
from marsupial.planning.list_scheduling.greedy import Greedy


class Watched(Greedy):
    """Notes the situations it is asked about, and then may fail."""

    def __init__(self, asked: list[Situation], error: Exception | None = None) -> None:
        super().__init__()
        self._asked, self._error = asked, error

    def solve(self, situation: Situation, budget: Budget, **options: object):  # type: ignore[no-untyped-def,override]
        self._asked.append(situation)
        if self._error is not None:
            raise self._error
        return super().solve(situation, budget)


def test_an_engine_in_this_process_is_tried_out_on_a_team_that_needs_everything(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Situation] = []
    monkeypatch.setattr(engines, "ENGINES", {"watched": lambda: Watched(asked)})
    prepare("watched")()
    assert len(asked) == 1
    assert asked[0].goal.return_home
    assert asked[0].robot_by_name["rover1"].carrier == "carrier1"


def test_an_engine_that_fails_at_that_is_left_for_whoever_asks_it_in_earnest(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Situation] = []
    monkeypatch.setattr(engines, "ENGINES", {"watched": lambda: Watched(asked, ValueError("no"))})
    prepare("watched")()
    assert len(asked) == 1


@pytest.mark.parametrize("name", ["aries", "cmd:plan {domain} {problem}"])
def test_an_engine_with_processes_has_the_launcher_ready(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    calls = []
    monkeypatch.setattr("marsupial.library.first_use.warm_up", lambda wait=True, preload=(): calls.append(wait))
    prepare(name)()
    assert calls == [False, True]

import json
import os
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from marsupial import native
from marsupial.library import first_use
from marsupial.library.first_use import prepare_planner, try_planner
from marsupial.library.precompiling import precompile
from marsupial.model import Budget, Situation
from marsupial.planning import engines
from marsupial.planning.greedy import Greedy


class Watched(Greedy):
    """Records the situations it gets, and may then fail."""

    def __init__(self, asked: list[Situation], error: Exception | None = None) -> None:
        super().__init__()
        self._asked, self._error = asked, error

    def solve(self, situation: Situation, budget: Budget, **options: object):  # type: ignore[no-untyped-def,override]
        self._asked.append(situation)
        if self._error is not None:
            raise self._error
        return super().solve(situation, budget)


@pytest.fixture(autouse=True)
def forget() -> None:
    """Let planners be prepared again."""
    try_planner.cache_clear()


def test_an_engine_in_this_process_is_tried_out_on_a_team_that_needs_everything(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Situation] = []
    monkeypatch.setattr(engines, "ENGINES", {"watched": lambda: Watched(asked)})
    prepare_planner("watched")()
    assert len(asked) == 1
    assert asked[0].goal.return_home
    assert asked[0].robot_by_name["rover1"].carrier == "carrier1"
    prepare_planner("watched")()
    assert len(asked) == 1, "it is tried out once in a process"


def test_an_engine_that_fails_in_the_trial_run_raises_nothing_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Situation] = []
    monkeypatch.setattr(engines, "ENGINES", {"watched": lambda: Watched(asked, ValueError("no"))})
    prepare_planner("watched")()
    assert len(asked) == 1


@pytest.mark.parametrize("name", ["aries", "cmd:plan {domain} {problem}"])
def test_an_engine_with_processes_has_the_launcher_ready(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    calls = []
    monkeypatch.setattr("marsupial.library.first_use.warm_up", lambda wait=True, preload=(): calls.append(wait))
    prepare_planner(name)()
    assert calls == [False, True]


FRESH = """
import json, sys
from marsupial import native
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.first_use import prepare_mission, prepare_planner
from marsupial.library.missions import simulate
from marsupial.model.planning import Budget
from marsupial.planning.engines import engine

def ready():
    return {f"{one.__module__}.{one.__name__}{kind}" for one in native._natives for kind in one.signatures}

said, late = [], []
lobby = builtin_scenario("lobby", 2, 2)
prepare_mission(lobby, "temporal", "auto", said.append)()
for_mission, at_hand = len(said), ready()
with native.watched(lambda name, done, most: late.append(name)):
    for scenario in (lobby, builtin_scenario("rooms", 2, 2)):
        simulate(scenario, strategy="temporal", planner="auto", budget=Budget(steps=2), seed=1)
unready = ready() - at_hand
prepare_planner("auto", said.append)()
at_hand = ready()
with native.watched(lambda name, done, most: late.append(name)):
    for name in ("rooms-2x2-8", "two-doors-2x1-6", "pressure-2x2-8", "homes-2x2-8", "in-flight-2x2-8"):
        list(engine("auto").solve(INSTANCES[name].situation(), Budget(steps=2)))
unready |= ready() - at_hand
told = {"for_mission": said[:for_mission], "for_planner": said[for_mission:], "late": late, "unready": sorted(unready)}
print(json.dumps(told))
"""


def output_of(program: str, **environment: str) -> dict[str, Any]:
    """Return the output of a new process with these environment variables."""
    where = os.environ | environment
    done = subprocess.run([sys.executable, "-c", program], env=where, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


NOTHING: dict[str, list[str]] = {"for_mission": [], "for_planner": [], "late": [], "unready": []}


def test_all_code_is_ready_before_a_budget_counts() -> None:
    """No function may be compiled or loaded for the first time within a budget."""
    assert output_of(FRESH)["unready"] == []


@pytest.mark.slow
def test_all_code_is_compiled_before_a_budget_counts_with_a_message_the_first_time_only(tmp_path: Path) -> None:
    own_code = {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_CPU_NAME": "generic"}  # no precompiled code is for that target
    cold, warm = output_of(FRESH, **own_code), output_of(FRESH, **own_code)
    assert cold["late"] == cold["unready"] == []
    assert cold["for_mission"][0] == cold["for_planner"][0] == "compiling, which is done once on a machine ..."
    assert all("functions done, of" in text for text in cold["for_mission"][1:])
    assert warm == NOTHING


@pytest.mark.slow
def test_nothing_is_left_to_compile_of_what_missions_and_planners_use_where_it_was_precompiled(tmp_path: Path) -> None:
    assert precompile(tmp_path) > 40
    found = f"import pathlib; from marsupial import codecache; codecache.PRECOMPILED = pathlib.Path({str(tmp_path)!r})"
    cold = output_of(found + FRESH, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    assert cold == NOTHING


@pytest.mark.parametrize(
    ("lasting", "said"), [(True, "compiling, which is done once on a machine ..."), (False, "compiling ...")]
)
def test_compiling_is_called_done_once_only_where_code_is_kept(
    monkeypatch: pytest.MonkeyPatch, lasting: bool, said: str
) -> None:
    monkeypatch.setattr(first_use, "is_lasting", lambda: lasting)
    monkeypatch.setattr(native, "watched", Compiles)
    monkeypatch.setattr(engines, "ENGINES", {"watched": lambda: Watched([])})
    heard: list[str] = []
    prepare_planner("watched", heard.append)()
    assert heard == [said]


class Compiles(nullcontext[None]):
    """Reports one compiled function, as `native.watched` does."""

    def __init__(self, tell: native.Compiling) -> None:
        super().__init__()
        tell("function", 0, 1)

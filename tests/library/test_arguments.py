"""Arguments of the Python API: every call gives a result or an error that names the argument."""

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import marsupial
from marsupial.errors import MarsupialError, UsageError
from marsupial.model.arguments import number, path, target, text, whole

QUICK: dict[str, Any] = {"strategy": "heuristic", "steps": 1}


INFO = marsupial.EngineInfo(name="yielding", deterministic_steps=True)


class Shy:
    """Has none of the required methods, and a `repr` that raises."""

    def __repr__(self) -> str:
        raise RuntimeError("no words")


@dataclass
class Deciding:
    """A strategy that returns a given value."""

    decision: Any
    name: Any = "deciding"

    def decide(self, briefing: marsupial.Briefing) -> Any:
        return self.decision


@dataclass
class Yielding:
    """An engine that yields a given value."""

    events: Any
    info: Any = INFO

    def solve(self, situation: object, budget: object, *, objective: object = None, start: object = None) -> Any:
        return self.events


class Failing:
    """A strategy, engine and sensor whose methods raise."""

    name = "failing"
    info = marsupial.EngineInfo(name="failing", deterministic_steps=True)

    def decide(self, briefing: object) -> Any:
        raise ZeroDivisionError("mine")

    def solve(self, *_: object, **__: object) -> Iterator[Any]:
        raise ZeroDivisionError("mine")
        yield

    def visible(self, *_: object) -> Any:
        raise ZeroDivisionError("mine")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": 2.5}, "steps: must be a whole number, got 2.5"),
        ({"steps": float("nan")}, "steps: must be a whole number, got nan"),
        ({"steps": float("inf")}, "steps: must be a whole number, got inf"),
        ({"steps": True}, "steps: must be a whole number, got True"),
        ({"steps": 0}, "steps: must be 1 or more, got 0"),
        ({"steps": 10**5000}, "steps: must be at most 1e+15"),
        ({"budget": "x", "steps": None}, "budget: must be a number, got 'x'"),
        ({"budget": -1, "steps": None}, "budget: must be positive, got -1"),
        ({"budget": 0, "steps": None}, "budget: must be positive, got 0"),
        ({"budget": float("nan"), "steps": None}, "budget: must be finite, got nan"),
        ({"budget": float("inf"), "steps": None}, "budget: must be finite, got inf"),
        ({"seed": True}, "seed: must be a whole number, got True"),
        ({"seed": -1}, "seed: must be 0 or more, got -1"),
        ({"seed": 1.0}, "seed: must be a whole number, got 1.0"),
        ({"sensor": object()}, "sensor: object has no visible"),
        ({"sensor": Yielding}, "sensor: must be an object, not the class Yielding"),
        ({"strategy": None}, "strategy: NoneType has no name and no decide"),
        ({"strategy": " "}, "strategy: must be a text, got ' '"),
        ({"strategy": Deciding(None, name=5)}, "strategy: name: must be a text, got 5"),
        ({"strategy": Deciding(None)}, "strategy deciding: what decide returns: must be of type Decision, got None"),
        ({"strategy": Deciding(marsupial.Decision(plan=None))}, "Decision.plan: must be of type Plan, got None"),  # type: ignore[arg-type]
        ({"strategy": "temporal", "planner": 7}, "planner: int has no info and no solve"),
        ({"strategy": "temporal", "planner": Yielding([], info=3)}, "planner: info: must be an EngineInfo, got 3"),
        (
            {"strategy": "temporal", "planner": Yielding([1])},
            "planner yielding: what solve yields: must be Improved or",
        ),
        ({"strategy": "temporal", "planner": Yielding(None)}, "planner yielding: solve: must be an iterator of"),
        ({"log": 5}, "log: must be a path, got 5"),
        ({"log": "/nowhere/x.jsonl"}, "log: can't write /nowhere/x.jsonl: there is no folder /nowhere"),
        ({"log": "/"}, "log: can't write /: is a directory"),
        ({"scenario": None}, "scenario: must be a path, got None"),
        ({"carriers": 1.0}, "carriers: must be a whole number, got 1.0"),
        ({"rovers": "2"}, "rovers: must be a whole number, got '2'"),
        ({"carriers": 10**9}, "carriers: must be at most 1000, got 1000000000"),
    ],
)
def test_a_wrong_argument_of_explore_or_scenario_is_named(arguments: dict[str, Any], message: str) -> None:
    call: Callable[..., object] = partial(marsupial.explore, scenario="lobby", **QUICK)
    if {"carriers", "rovers"} & arguments.keys():
        call = partial(marsupial.scenario, "lobby")
    with pytest.raises(MarsupialError) as caught:
        call(**arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "arguments", [{"strategy": Failing()}, {"strategy": "temporal", "planner": Failing()}, {"sensor": Failing()}]
)
def test_exceptions_of_foreign_code_pass_through_unchanged(arguments: dict[str, Any]) -> None:
    with pytest.raises(ZeroDivisionError, match="mine"):
        marsupial.explore("lobby", **{**QUICK, **arguments})


def test_numpy_numbers_are_accepted_and_become_plain(tmp_path: Path) -> None:
    place = marsupial.scenario("lobby", carriers=np.int64(1), rovers=np.uint8(1))  # type: ignore[arg-type]
    log = tmp_path / "lobby.jsonl"
    result = marsupial.explore(place, "heuristic", seed=np.int64(3), steps=np.int32(1), log=log)  # type: ignore[arg-type]
    told = json.loads(json.dumps(result.as_dict()))
    assert (told["seed"], told["carriers"], told["log"]) == (3, 1, str(log))
    assert marsupial.Budget(seconds=np.float64(2)).seconds == 2.0
    assert type(marsupial.Budget(seconds=np.float32(2)).seconds) is float


def test_invalid_calls_on_a_result_are_named(tmp_path: Path) -> None:
    result = marsupial.explore("lobby", **QUICK)
    for wrong in (tmp_path, tmp_path / "none" / "x.html", 5):
        with pytest.raises(UsageError, match=r"path: (can't write|must be a path)"):
            result.save_replay(wrong)  # type: ignore[arg-type]
    for second in (-1, float("nan"), "2"):
        with pytest.raises(UsageError, match="at_s: must be"):
            result.situation(second)  # type: ignore[arg-type]


JUNK = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.binary(max_size=5),
    st.lists(st.integers(), max_size=2), st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
    st.sampled_from([object(), Shy(), Shy, np.float64(2.5), np.int64(-1), np.array([1, 2]), 1j, len, {1: set()}]),
)  # fmt: skip


@given(value=JUNK)
def test_any_argument_becomes_plain_or_is_refused_by_name(value: Any) -> None:
    for read, kind in ((whole, int), (number, float), (text, str), (path, Path), (target, Path)):
        plain, said = None, ""
        try:
            plain = read("it", value)  # type: ignore[operator]
        except UsageError as error:
            said = str(error)
        assert isinstance(plain, kind) or said.startswith("it: ")


@given(
    name=st.sampled_from(["scenario", "strategy", "planner", "seed", "budget", "steps", "log", "sensor"]), value=JUNK
)
def test_explore_raises_only_documented_errors(name: str, value: Any) -> None:
    plausible = isinstance(value, str) if name == "log" else value is None or isinstance(value, int)
    if plausible or (name in ("budget", "seed") and isinstance(value, float)):
        return  # these would run a mission, or write files
    with contextlib.suppress(MarsupialError):
        marsupial.explore(**{"scenario": "lobby", **QUICK, name: value})


@given(value=JUNK)
def test_the_other_functions_raise_only_documented_errors(value: Any) -> None:
    for call in (
        lambda: marsupial.scenario(value),
        lambda: marsupial.scenario("lobby", carriers=value) if not isinstance(value, int) else None,
        lambda: marsupial.plan(value, "greedy", steps=1),
        lambda: marsupial.plan({}, value),
        lambda: marsupial.check(value, value),
        lambda: marsupial.situation_files(value),
        lambda: marsupial.Budget(steps=value),
        lambda: marsupial.Budget(seconds=value),
    ):
        with contextlib.suppress(MarsupialError):
            call()

"""The environment of Gymnasium, checked by Gymnasium's own checker."""

import warnings
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed: pip install 'marsupial[gym]'")
NAME = "marsupial_gym:marsupial/Exploration-v0"


@pytest.fixture
def environment() -> Any:
    made = gymnasium.make(NAME, scenario="lobby")
    made.action_space.seed(1)
    return made


def test_the_environment_keeps_the_rules_of_gymnasium(environment: Any) -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment.unwrapped, skip_render_check=True)


def test_an_episode_is_a_mission_and_its_return_is_the_time_it_takes(environment: Any) -> None:
    environment.reset(seed=1)
    total, ended = 0.0, False
    while not ended:
        seen, reward, ended, truncated, info = environment.step(environment.action_space.sample())
        assert environment.observation_space.contains(seen)
        assert not truncated
        total += reward
    result = info["result"]
    assert (result.status, result.seed, result.plans_invalid) == ("complete", 1, 0)
    assert total == pytest.approx(-result.mission_time_s)


def test_robots_that_get_no_target_do_not_end_the_mission(environment: Any) -> None:
    environment.reset(seed=2)
    ended = False
    while not ended:
        *_, ended, _, info = environment.step(environment.action_space.sample() * 0)
    assert info["result"].status == "complete"


def test_a_mission_out_of_time_is_truncated_and_costs_all_of_its_time() -> None:
    from dataclasses import replace

    import marsupial

    lobby = marsupial.scenario("lobby")
    environment = gymnasium.make(NAME, scenario=replace(lobby, limits=replace(lobby.limits, time_ms=5000)), targets=2)
    environment.action_space.seed(1)
    environment.reset(seed=1)
    total, over = 0.0, False
    while not over:
        _, reward, ended, truncated, _ = environment.step(environment.action_space.sample())
        total, over = total + reward, ended or truncated
    assert truncated
    assert total == pytest.approx(-5.0)


def test_an_action_may_be_a_list_a_tuple_or_whole_floats_and_any_seed_begins_a_mission(environment: Any) -> None:
    robots = environment.action_space.nvec.size
    seen = []
    for action in (np.ones(robots, dtype=np.int64), [1] * robots, (1,) * robots, [1.0] * robots):
        environment.reset(seed=2**40)
        seen.append(environment.unwrapped.step(action)[0]["known"])
    assert all((known == seen[0]).all() for known in seen)
    environment.reset(seed=2**40 % (10**12 + 1))
    assert (environment.unwrapped.step([1] * robots)[0]["known"] == seen[0]).all()
    environment.reset(seed=2**128 - 1)
    for action in ([1.5] * robots, [1] * (robots + 1), ["1"] * robots, [float("nan")] * robots, 1, None):
        with pytest.raises(ValueError, match=f"an action is {robots} whole numbers, one for each robot"):
            environment.unwrapped.step(action)

"""Missions as an environment of Gymnasium: ``gymnasium.make("marsupial_gym:marsupial/Exploration-v0")``.

Needs Gymnasium (the extra ``marsupial[gym]``). ``docs/library.md`` describes observations, actions and rewards.
"""

from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from marsupial import Mission, Observation, Scenario
from marsupial.model import Status
from marsupial.model.bounds import BOUNDS
from marsupial.planning.greedy import serve

Arrays = dict[str, npt.NDArray[Any]]

FAR = 1e6  # stands for all greater numbers, metres and seconds
MOST_SEED = 2**31 - 1
SEEDS = int(BOUNDS["seed"].most) + 1  # number of seeds of missions


class ExplorationEnv(gymnasium.Env[Arrays, npt.NDArray[np.int64]]):
    """One mission of a scenario per episode; the agent decides who goes to which target at each replanning.

    `targets` is how many targets an observation has room for; the others wait.
    """

    def __init__(self, scenario: Scenario | str | PathLike[str] = "office", targets: int = 32) -> None:
        self.mission = Mission(scenario)
        grid, robots = self.mission.scenario.grid, len(self.mission.scenario.team)
        self._limit_s = self.mission.scenario.limits.time_ms / 1000
        self._t_s = 0.0

        def room(*shape: int) -> spaces.Box:
            return spaces.Box(-1.0, FAR, shape, np.float32)

        self.observation_space = spaces.Dict(
            {
                "known": spaces.Box(0, 255, grid.cells.shape, np.uint8),
                "robots_m": room(robots, 2),
                "carriers": spaces.Box(-1, robots - 1, (robots,), np.int64),
                "lost": spaces.MultiBinary(robots),
                "targets_m": room(targets, 2),
                "reveal_m2": room(targets),
                "travel_s": room(robots, targets),
            }
        )
        self.action_space = spaces.MultiDiscrete([targets + 1] * robots)
        self._targets = targets

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Arrays, dict[str, Any]]:
        """Begin a mission; without a seed its starts are drawn anew.

        Missions have seeds from 0 to 10^12: of a greater one, they get the rest of its division by 10^12 + 1.
        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(MOST_SEED))
        seen = self._explored(self.mission.reset(drawn if seed is None else seed % SEEDS))
        return self._arrays(seen), {}

    def step(self, action: npt.ArrayLike) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Send each robot to the target of its number, counted from 1; 0 is none. Raise ValueError for other actions.

        An action is an array, list or tuple of as many whole numbers as there are robots.
        """
        mission, briefing = self.mission, self.mission.briefing
        assert briefing is not None, "the mission has ended, or not begun: reset() begins it"
        names = [target.name for target in briefing.situation.targets[: self._targets]]
        robots = [robot.name for robot in mission.scenario.team]
        wanted = {
            robot: names[number - 1]
            for robot, number in zip(robots, self._numbers(action), strict=True)
            if 0 < number <= len(names) and robot in briefing.situation.robot_by_name
        }
        plan = mission.plan_for(wanted)
        before_s = self._t_s
        seen = self._explored(mission.step(plan if plan.actions else serve(briefing.situation)[0]))
        ended = mission.result
        late = ended is not None and ended.status is not Status.COMPLETE
        reward = before_s - (self._limit_s if late else self._t_s)
        timed_out = ended is not None and ended.status is Status.TIME_LIMIT
        info = {} if ended is None else {"result": ended}
        return self._arrays(seen), reward, ended is not None and not timed_out, timed_out, info

    def _numbers(self, action: npt.ArrayLike) -> list[int]:
        robots = len(self.mission.scenario.team)
        numbers = np.asarray(action)
        if numbers.shape != (robots,) or numbers.dtype.kind not in "biuf" or not (numbers == np.trunc(numbers)).all():
            raise ValueError(f"an action is {robots} whole numbers, one for each robot, got {action!r}")
        return [int(number) for number in numbers]

    def _explored(self, seen: Observation) -> Observation:
        """Let list scheduling bring the team back while no targets are left, as nothing is left to decide."""
        while (briefing := self.mission.briefing) is not None and not briefing.situation.targets:
            seen = self.mission.step(serve(briefing.situation)[0])
        self._t_s = seen.t_s
        return seen

    def _arrays(self, seen: Observation) -> Arrays:
        def padded(values: npt.NDArray[np.float64], axis: int = 0) -> npt.NDArray[np.float32]:
            shown = np.minimum(np.take(values, range(min(self._targets, values.shape[axis])), axis), FAR)
            widths = [(0, self._targets - shown.shape[axis] if i == axis else 0) for i in range(shown.ndim)]
            return np.pad(shown, widths, constant_values=-1.0).astype(np.float32)

        return {
            "known": seen.known,
            "robots_m": seen.robots_m.astype(np.float32),
            "carriers": seen.carriers,
            "lost": seen.lost.astype(np.int8),
            "targets_m": padded(seen.targets_m),
            "reveal_m2": padded(seen.reveal_m2),
            "travel_s": padded(np.where(np.isinf(seen.travel_s), -1.0, seen.travel_s), axis=1),
        }


gymnasium.register("marsupial/Exploration-v0", entry_point=ExplorationEnv)

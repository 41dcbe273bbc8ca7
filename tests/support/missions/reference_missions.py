"""Logs of missions run in this process without failures, with a budget of one step per plan."""

from functools import cache

from marsupial.formats.loglines import LogEncoder
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.mission.observer import Observer
from marsupial.model import Budget, MissionEvent

STEPS = Budget(steps=1)


class LogLines(Observer):
    """Keeps the lines of a mission log."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._encoder = LogEncoder()

    @property
    def text(self) -> str:
        return "".join(f"{line}\n" for line in self.lines)

    def event(self, event: MissionEvent) -> None:
        self.lines.append(self._encoder.line(event))


@cache
def reference_log(scenario: str, planner: str = "greedy", strategy: str = "temporal", seed: int = 1) -> str:
    seen = LogLines()
    simulate(builtin_scenario(scenario), strategy=strategy, planner=planner, budget=STEPS, seed=seed, observer=seen)
    return seen.text

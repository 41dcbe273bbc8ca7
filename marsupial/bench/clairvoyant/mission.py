"""A mission of the clairvoyant: a plan is made from the truth, checked and carried out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter

from marsupial.bench.clairvoyant import CLAIRVOYANT
from marsupial.bench.clairvoyant.expedition import Expedition
from marsupial.bench.clairvoyant.ground import Ground
from marsupial.bench.clairvoyant.outline import Outline
from marsupial.bench.clairvoyant.search import best_outline
from marsupial.errors import InternalError
from marsupial.mission.loop import Assignment
from marsupial.mission.observer import Observer
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import MapTarget, MissionEnded, PlacedRobot
from marsupial.model.planning import Budget, Outcome
from marsupial.model.robots import RobotType
from marsupial.model.strategy import PlanningReport
from marsupial.planning.checker import check
from marsupial.sim.world import SimulatedWorld

ROUNDS_PER_STEP, SECONDS = 1.5, 5.0
"""How many rounds of the search there are for each step of the budget of a planning, or how many times its seconds:
the clairvoyant plans once where a strategy plans a hundred times."""

SEED = 1


def clairvoyant_mission(
    truth: Grid,
    kinds: Mapping[str, RobotType],
    robots: Sequence[PlacedRobot],
    assignment: Assignment,
    budget: Budget,
    observer: Observer,
    cancelled: Callable[[], bool] | None = None,
) -> MissionEnded:
    """Plan with the whole map known, carry it out in the simulator, and return how the mission ended.

    Parameters
    ----------
    budget
        For each planning of a strategy it is to be compared with; see `ROUNDS_PER_STEP`.
    """
    began = perf_counter()
    outline = best_outline(Ground(truth, tuple(kinds.values()), robots), _used(budget, began, cancelled), SEED)
    verdict = check(outline.situation, outline.plan)
    if not verdict.valid:
        raise InternalError(f"the clairvoyant made an invalid plan: {verdict.violation}")
    observer.planned(PlanningReport(planner=CLAIRVOYANT, outcome=Outcome.SATISFICING, wall_s=perf_counter() - began))
    expedition = Expedition(SimulatedWorld(truth, kinds, robots), truth, kinds, assignment, observer)
    return expedition.run(outline.plan, outline.poses, _on_map(outline), outline.meetings, cancelled)


def _used(budget: Budget, began: float, cancelled: Callable[[], bool] | None) -> Callable[[int], float]:
    """Return what says, after so many rounds, which share of the budget is used; 1 or more once it is to end."""

    def used(rounds: int) -> float:
        if cancelled is not None and cancelled():
            return 1.0
        if budget.steps is not None:
            return rounds / (ROUNDS_PER_STEP * budget.steps)
        return (perf_counter() - began) / (SECONDS * (budget.seconds or 0.0))

    return used


def _on_map(outline: Outline) -> tuple[MapTarget, ...]:
    def target(name: str, viewpoints: Mapping[str, Cell]) -> MapTarget:
        cell = next(iter(viewpoints.values()))
        return MapTarget(name=name, cell=cell, explorers=tuple(sorted(viewpoints)), reveal_m2=0.0, frontier_cells=0)

    return tuple(target(stop.name, stop.viewpoints) for stop in outline.stops)

from dataclasses import replace

import numpy as np
import pytest

from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.mission.placement import place_team
from marsupial.model.planning import Budget
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.clairvoyant.cover import cover, doors
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.search import annealed, best_outline, rate
from marsupial.strategies.clairvoyant.tours import repaired, shortened


@pytest.fixture(scope="module")
def ground() -> Ground:
    scenario = builtin_scenario("lobby")
    return Ground(scenario.grid, scenario.robot_types, place_team(scenario, 1))


@pytest.fixture(scope="module")
def redundant_outline(ground: Ground) -> Outline:
    """Return an outline with many more stops than it needs."""
    stops = tuple(cover(ground, {"carrier": 1.0, "rover": 1.0}, 0.3, np.random.default_rng(1)))
    outline = Outline(ground=ground, stops=stops, meetings=doors(ground, stops))
    return outline.with_plan(serve(outline.situation)[0])


def driving_ms(outline: Outline) -> int:
    return sum(action.duration_ms for action in outline.plan.actions if action.origin is not None)


def test_the_view_from_a_cell_equals_the_cells_revealed_there(ground: Ground) -> None:
    scenario = builtin_scenario("lobby")
    kinds = {kind.name: kind for kind in scenario.robot_types}
    for n in range(0, len(ground.sites["carrier"]), 97):
        cell = ground.cell(ground.sites["carrier"][n])
        robots = tuple(replace(robot, cell=cell) for robot in place_team(scenario, 1) if robot.type == "carrier")[:1]
        ((_, revealed),) = SimulatedWorld(scenario.grid, kinds, robots).advance(0).revealed
        known = np.zeros(scenario.grid.cells.size, dtype=np.bool_)
        known[revealed] = True
        reachable = np.logical_or.reduce(list(ground.reach.by_type.values())).ravel()
        assert ground.view("carrier", cell).bit_count() == np.count_nonzero(known & reachable)


def test_a_cover_sees_all_wanted_cells_from_its_stops(ground: Ground, redundant_outline: Outline) -> None:
    seen = 0
    for stop in redundant_outline.stops:
        kind, cell = next(iter(stop.viewpoints.items()))
        seen |= ground.view(kind, cell)
    assert not ground.wanted & ~seen
    assert redundant_outline.missed == 0


def test_shortening_sees_as_much_with_less_driving(redundant_outline: Outline) -> None:
    short = shortened(redundant_outline)
    assert short.missed == 0
    assert len(short.stops) < len(redundant_outline.stops)
    assert driving_ms(short) < driving_ms(redundant_outline)
    assert check(short.situation, short.plan).valid


def test_repairing_sees_all_again(redundant_outline: Outline) -> None:
    broken = redundant_outline.without(stop.name for stop in redundant_outline.stops[::2])
    mended = repaired(broken, np.random.default_rng(1), redundant_outline.complete_ms)
    assert broken.missed
    assert mended.missed == 0
    assert check(mended.situation, mended.plan).valid


def test_annealing_keeps_the_stops_and_gets_no_later(redundant_outline: Outline) -> None:
    better = annealed(redundant_outline, 20, 0)
    assert better.plan.explored == redundant_outline.plan.explored
    assert better.plan.makespan_ms <= redundant_outline.plan.makespan_ms


def test_more_rounds_are_never_worse(ground: Ground) -> None:
    few, more = (best_outline(ground, lambda done, n=rounds: done / n, 1) for rounds in (1, 4))
    assert rate(more) <= rate(few)


def test_the_time_a_plan_is_rated_by_is_that_of_the_simulated_mission(ground: Ground) -> None:
    scenario = builtin_scenario("lobby")
    flown = simulate(scenario, strategy="clairvoyant", planner="none", budget=Budget(steps=2), seed=1)
    outline = best_outline(Ground(scenario.grid, scenario.robot_types, place_team(scenario, 1)), lambda n: n / 3, 1)
    assert outline.missed == 0
    assert flown.exploration_time_s is not None
    # a plan has 1 ms between a robot's actions, a mission does not
    assert outline.complete_ms - len(outline.plan.actions) <= 1000 * flown.exploration_time_s <= outline.complete_ms

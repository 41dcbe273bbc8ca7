from dataclasses import replace

import numpy as np
import pytest

from marsupial.errors import ScenarioError
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.maps.territory import Territory
from marsupial.mission.observer import Observer
from marsupial.mission.state import MissionTracker
from marsupial.model import Budget, DriveStarted, EnergyModel, MissionEvent, Routes, Status
from marsupial.model.scenario import Scenario, with_routes
from marsupial.paths.energy import EnergySearch, costs_of, route_energy
from marsupial.paths.routes import route_of

TURNING = EnergyModel(metre_j=1.0, stop_j=0.5, turn_j=(0.4, 0.6, 0.8, 1.0))


class Judge(Observer):
    """Compares the energy of each drive with the minimum on the map known at that time.

    Attributes
    ----------
    drives
        Pairs of the energy of each drive and the minimum.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._state = MissionTracker()
        self.drives: list[tuple[float, float]] = []

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, DriveStarted):
            track = self._state.tracks[event.robot]
            kind = track.kind
            grid = replace(self._scenario.grid, cells=self._state.cells)
            standable = Territory(grid, (kind,)).footprints[kind.name].standable
            costs = costs_of(kind, grid.resolution_m)
            route = route_of(event.cell, event.steps)
            least = EnergySearch(standable, costs).costs(route[0], route[-1:], track.heading)
            self.drives.append((route_energy(route, costs, track.heading), float(least[0])))
        self._state.event(event)


def turning(scenario: Scenario, energy: EnergyModel = TURNING) -> Scenario:
    return replace(scenario, robot_types=tuple(replace(kind, energy=energy) for kind in scenario.robot_types))


def judged(scenario: Scenario, strategy: str) -> tuple[Judge, Status]:
    judge = Judge(scenario)
    summary = simulate(scenario, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=1, observer=judge)
    return judge, summary.status


@pytest.mark.parametrize(("strategy", "rovers"), [("temporal", 1), ("heuristic", 1), ("closest-frontier", 0)])
def test_every_drive_takes_the_least_energy_from_how_its_robot_faces(strategy: str, rovers: int) -> None:
    scenario = turning(builtin_scenario("lobby", 1, rovers))
    judge, status = judged(with_routes(scenario, Routes.ENERGY), strategy)
    assert status is Status.COMPLETE
    assert len(judge.drives) >= 3
    taken, least = np.array(judge.drives).T
    assert taken == pytest.approx(least)


def test_the_shortest_ways_take_more() -> None:
    judge, _ = judged(turning(builtin_scenario("lobby", 1, 1)), "temporal")
    taken, least = np.array(judge.drives).T
    assert (taken >= least - 1e-9).all()
    assert taken.sum() > least.sum()


def test_the_clairvoyant_drives_as_it_planned() -> None:
    _, status = judged(with_routes(turning(builtin_scenario("lobby", 1, 1)), Routes.ENERGY), "clairvoyant")
    assert status is Status.COMPLETE


def test_a_type_that_drives_for_nothing_has_no_routes_of_least_energy() -> None:
    idle = turning(builtin_scenario("lobby", 1, 1), EnergyModel(stop_j=1.0))
    with pytest.raises(ScenarioError, match="routes: robot type 'carrier': no way takes less"):
        with_routes(idle, Routes.ENERGY)
    assert with_routes(idle, Routes.SHORTEST).robot_types == idle.robot_types

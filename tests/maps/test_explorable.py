from dataclasses import replace

import numpy as np
import pytest
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.library.missions import simulate
from marsupial.maps.explorable import explorable_area
from marsupial.maps.growth import reach_of
from marsupial.maps.territory import Territory
from marsupial.model import ROUGH, Budget, Mask, PlacedRobot, RobotType, Scenario, Status, TeamMember

BESIDE_A_PATCH = drawn_grid("##########", "#.......##", "#,,,,,,,,#", "#,,,,,,,,#", "#,,,,,,,,#", "##########")
"""A hall (y = 4) beside rough ground that is just as wide as a rover, which fits on 6 cells of it and covers 5."""

TEAM = (carrier_at(6, 4), rover_on("c1"))

TEAM_IN_HALL = (carrier_at(1, 3), rover_on("c1"))


def wide_rover(carrier_range_m: float) -> dict[str, RobotType]:
    """Return the two types: a rover's disc holds the cells beside its own, and it drives on rough ground only."""
    kinds = kinds_of(carrier_range_m=carrier_range_m)
    return {**kinds, "rover": replace(kinds["rover"], radius_m=1.2, terrains=frozenset({ROUGH}))}


def counted(carrier_range_m: float, team: tuple[PlacedRobot, ...] = TEAM) -> int:
    """Return the number of explorable cells: of the hall's 7, and of the 6 where a rover fits."""
    kinds = tuple(wide_rover(carrier_range_m).values())
    return int(np.count_nonzero(explorable_area(BESIDE_A_PATCH, kinds, team)))


def test_ground_beside_a_carrier_counts_only_where_some_robot_can_see_it() -> None:
    assert (counted(carrier_range_m=1.1), counted(carrier_range_m=4.0)) == (7, 13)


def test_ground_where_a_rover_starts_counts_whatever_carriers_see() -> None:
    assert counted(1.1, (carrier_at(6, 4), rover_at(3, 2))) == 13


@pytest.mark.parametrize(("carrier_range_m", "cells"), [(1.1, 7), (4.0, 13)])
def test_a_mission_that_sees_all_it_can_covers_the_whole_area(carrier_range_m: float, cells: int) -> None:
    members = [TeamMember(name=r.name, type=r.type, start=r.cell, carrier=r.carrier) for r in TEAM]
    scenario = Scenario(
        name="patch", grid=BESIDE_A_PATCH, robot_types=tuple(wide_rover(carrier_range_m).values()), team=tuple(members)
    )
    summary = simulate(scenario, strategy="heuristic", planner="greedy", budget=Budget(steps=1), seed=1)
    assert (summary.status, summary.coverage, summary.reachable_area_m2) == (Status.COMPLETE, 1.0, cells)


def test_where_rovers_can_be_set_down_on_the_carriers_own_ground_all_of_the_reach_counts() -> None:
    grid = drawn_grid("###########", "#.........#", "####,######", "#,,,,,,,,,#", "###########")
    kinds = tuple(kinds_of(carrier_range_m=1.1).values())
    reach: Mask = np.logical_or.reduce(list(reach_of(Territory(grid, kinds), TEAM_IN_HALL).by_type.values()))
    assert np.array_equal(explorable_area(grid, kinds, TEAM_IN_HALL), reach)

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from support.missions.small_teams import ANNEX, CORRIDOR, drawn_grid, kinds_of

from marsupial.errors import ScenarioError
from marsupial.maps.reach import largest_reach
from marsupial.mission.placement import place_team
from marsupial.model import Cell, PlacedRobot, Scenario, TeamMember

TWO_HALLS = ("############", "#..#.......#", "############")


def scenario_of(*team: TeamMember, lines: Sequence[str] = CORRIDOR, **options: float) -> Scenario:
    kinds = kinds_of(**options)  # type: ignore[arg-type]
    return Scenario(name="test", grid=drawn_grid(*lines), robot_types=tuple(kinds.values()), team=team)


def carriers(number: int) -> list[TeamMember]:
    return [TeamMember(name=f"c{i}", type="carrier") for i in range(1, number + 1)]


def cells(robots: Sequence[PlacedRobot]) -> list[Cell]:
    return [robot.cell for robot in robots if robot.cell is not None]


def test_the_first_carrier_starts_anywhere_in_the_largest_reach() -> None:
    scenario = scenario_of(*carriers(1), lines=TWO_HALLS)
    starts = {place_team(scenario, seed)[0].cell for seed in range(60)}
    assert starts == {Cell(x, 1) for x in range(4, 11)}


def test_the_same_seed_gives_the_same_starts() -> None:
    scenario = scenario_of(*carriers(3))
    assert place_team(scenario, 7) == place_team(scenario, 7)
    assert len({place_team(scenario, seed) for seed in range(20)}) > 1


def test_a_start_seed_of_the_scenario_goes_before_the_seed_of_the_mission() -> None:
    scenario = replace(scenario_of(*carriers(1)), start_seed=5)
    assert len({place_team(scenario, seed) for seed in range(20)}) == 1
    assert place_team(scenario, 1) == place_team(replace(scenario, start_seed=None), 5)


def test_the_others_start_as_near_to_the_first_as_there_is_room() -> None:
    for seed in range(10):
        first, *others = cells(place_team(scenario_of(*carriers(3)), seed))
        assert all(abs(other.x - first.x) <= 2 for other in others)


def test_robots_start_where_they_keep_clear_of_each_other() -> None:
    kinds = kinds_of()
    wide = replace(kinds["carrier"], radius_m=1.0)
    grid = drawn_grid(*(["#" * 20] * 2 + ["##" + "." * 16 + "##"] * 8 + ["#" * 20] * 2))
    scenario = Scenario(name="test", grid=grid, robot_types=(wide, kinds["rover"]), team=tuple(carriers(4)))
    placed = cells(place_team(scenario, 3))
    room = largest_reach(grid, wide)
    assert all(room[cell.y, cell.x] for cell in placed)
    assert all(math.dist(a, b) >= 2.0 for i, a in enumerate(placed) for b in placed[:i])


def test_given_starts_and_carriers_stay_as_they_are() -> None:
    team = [
        TeamMember(name="c1", type="carrier", start=Cell(2, 1)),
        TeamMember(name="r1", type="rover", carrier="c1"),
        TeamMember(name="c2", type="carrier"),
    ]
    placed = place_team(scenario_of(*team), 1)
    assert placed[0] == PlacedRobot(name="c1", type="carrier", cell=Cell(2, 1))
    assert placed[1] == PlacedRobot(name="r1", type="rover", carrier="c1")
    assert placed[2].cell in {Cell(1, 1), Cell(3, 1)}  # near the given start


def test_a_rover_that_can_not_stand_on_carriers_ground_still_starts_near_them() -> None:
    kinds = kinds_of()
    rover = replace(kinds["rover"], terrains=frozenset({2}))
    team = (TeamMember(name="c1", type="carrier", start=Cell(9, 3)), TeamMember(name="r1", type="rover"))
    scenario = Scenario(name="t", grid=drawn_grid(*ANNEX), robot_types=(kinds["carrier"], rover), team=team)
    assert place_team(scenario, 1)[1].cell == Cell(9, 1)


@pytest.mark.parametrize(("lines", "number"), [(CORRIDOR, 8), (("###", "#,#", "###"), 1)])
def test_a_robot_without_room_is_named(lines: Sequence[str], number: int) -> None:
    told = rf"team\[{number - 1}\]\.start: no room on the map for c{number} to start"
    with pytest.raises(ScenarioError, match=told):
        place_team(scenario_of(*carriers(number), lines=lines), 1)


def test_unknown_ground_is_no_place_to_start() -> None:
    scenario = scenario_of(*carriers(1), lines=("######", "#.????", "######"))
    assert {place_team(scenario, seed)[0].cell for seed in range(10)} == {Cell(1, 1)}

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import aboard, carrier, draw, on_map, picture, random_cells, rover, standing, where
from support.maps.from_scratch import flood

from marsupial.maps.discs import disc
from marsupial.maps.footprint import Contact, footprint_of
from marsupial.maps.growth import reach_of
from marsupial.maps.reach import parts
from marsupial.maps.sight import Sight
from marsupial.maps.targets import LITTLE_GROUND, Target, TargetFinder
from marsupial.maps.territory import Reach, Territory
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Terrain
from marsupial.model.mission import MapTarget, PlacedRobot
from marsupial.model.robots import RobotType
from marsupial.model.zones import Zone, ZoneKind, zoned

CARRIER, ROVER = carrier(), rover()

TOO_NARROW = "too narrow for every robot type of the team"


def look(
    grid: Grid, *robots: PlacedRobot, kinds: tuple[RobotType, ...], least_ground: float = 0.0
) -> tuple[TargetFinder, Reach]:
    territory = Territory(grid, kinds)
    return TargetFinder(territory, least_ground), reach_of(territory, robots)


def targets_of(grid: Grid, *robots: PlacedRobot, kinds: tuple[RobotType, ...] = (ROVER,)) -> tuple[Target, ...]:
    finder, reach = look(grid, *robots, kinds=kinds)
    return finder.find(finder.frontiers(reach))


def reasons(grid: Grid, *robots: PlacedRobot, kinds: tuple[RobotType, ...] = (ROVER,)) -> list[tuple[Cell, int, str]]:
    return _refused(*look(grid, *robots, kinds=kinds))


def _refused(finder: TargetFinder, reach: Reach) -> list[tuple[Cell, int, str]]:
    refused = finder.refused(finder.find(finder.frontiers(reach)), reach)
    return [(left.cell, left.frontier_cells, left.reason) for left in refused]


def _beside(cell: Cell, other: Cell) -> bool:
    return max(abs(cell.x - other.x), abs(cell.y - other.y)) <= 1


def test_a_frontier_is_known_ground_beside_the_unknown() -> None:
    grid = draw("#..?", "#...", ".,,#", "?,.?")
    finder, _ = look(grid, kinds=(ROVER,))
    assert picture(on_map(finder.frontier(), grid)) == ["..x.", "...x", "x...", ".xx."]
    finder, _ = look(grid, kinds=(CARRIER,))
    assert picture(on_map(finder.frontier(), grid)) == ["..x.", "...x", "x...", "..x."]


def test_a_frontier_as_a_whole_is_a_target_where_it_is_reached_soonest() -> None:
    grid = draw("??????????", "r........?", "##########", "?.........")
    finder, reach = look(grid, standing("r", Cell(0, 2), "rover"), kinds=(ROVER,))
    frontiers = finder.frontiers(reach)
    cells = frontiers["rover"].cells
    soonest_s = {"rover": np.abs(cells % grid.width - 3.0)}
    (target,) = finder.find_whole(frontiers, soonest_s)
    assert (target.cell, len(target.cells)) == (Cell(3, 2), len(cells))
    assert target.viewpoints == {"rover": Cell(3, 2)}
    assert finder.find_whole(frontiers, {"rover": np.full(len(cells), np.inf)}) == ()


def test_a_map_without_unknown_cells_has_no_target() -> None:
    assert targets_of(draw("r.", ".."), standing("r", Cell(0, 1), "rover")) == ()


def test_a_frontier_that_is_seen_from_its_middle_is_one_target() -> None:
    rows = ("???????", ".......", "...r...")
    (target,) = targets_of(draw(*rows), standing("r", *where("r", *rows), "rover"))
    assert target.name == "t_3_1"
    assert target.cell == Cell(3, 1)
    assert target.viewpoints == {"rover": Cell(3, 1)}
    assert target.cells.tolist() == [7, 8, 9, 10, 11, 12, 13]


def test_the_gain_of_a_target_is_the_unknown_area_in_sight_of_its_viewpoint() -> None:
    rows = ("r??#??",)
    (target,) = targets_of(draw(*rows, resolution_m=0.5), standing("r", Cell(0, 0), "rover"))
    assert target.reveal_m2 == 2 * 0.25
    (target,) = targets_of(draw("r????????"), standing("r", Cell(0, 0), "rover"))
    assert target.reveal_m2 == ROVER.sensor_range_m


def test_a_target_lists_the_types_that_can_explore_it() -> None:
    (target,) = targets_of(draw("r??"), standing("r", Cell(0, 0), "rover"))
    assert target.on_map() == MapTarget(
        name="t_0_0", cell=Cell(0, 0), explorers=("rover",), reveal_m2=2.0, frontier_cells=1
    )


def test_a_wall_between_two_frontiers_makes_two_targets() -> None:
    rows = ("??#??", "..#..", "..r..")
    found = targets_of(draw(*rows), standing("r", *where("r", *rows), "rover"))
    assert sorted(target.cells.tolist() for target in found) == [[5, 6], [8, 9]]


def test_a_frontier_longer_than_the_sensors_see_is_cut() -> None:
    rows = ("?" * 30, "." * 30)
    found = targets_of(draw(*rows), standing("r", Cell(0, 0), "rover"))
    assert all(abs(cell - target.cell.x) <= 4 for target in found for cell in target.cells.tolist())
    assert sorted(cell for target in found for cell in target.cells.tolist()) == list(range(30))


def test_longest_frontiers_come_first() -> None:
    rows = ("#?#????", "#.#....", "r......")
    found = targets_of(draw(*rows), standing("r", *where("r", *rows), "rover"))
    assert [len(target.cells) for target in found] == [4, 1]


def test_beside_a_frontier_for_both_one_for_rovers_alone_is_a_target_of_its_own() -> None:
    rows = ("#########??", "........#,?", ".c......,,?", "........#,?", "#########??")
    found = targets_of(draw(*rows), standing("c", *where("c", *rows)), aboard("r", "c"), kinds=(CARRIER, ROVER))
    assert [(sorted(target.viewpoints), target.cells.tolist()) for target in found] == [(["rover"], [20, 31, 42])]
    rows = ("?????????????????", "........#,,,,,,,,", ".c......,,,,,,,,,", "........#,,,,,,,,")
    found = targets_of(draw(*rows), standing("c", *where("c", *rows)), aboard("r", "c"), kinds=(CARRIER, ROVER))
    assert {tuple(sorted(target.viewpoints)) for target in found} == {("carrier", "rover"), ("rover",)}


def test_where_sight_ends_at_the_edge_of_the_unknown_the_robot_still_goes_there() -> None:
    hedge = Terrain(code=ROUGH, name="hedge", blocks_sight=True)
    grid = Grid(cells=draw("r,??").cells, resolution_m=1.0, terrains=(Terrain(code=FLOOR, name="floor"), hedge))
    (target,) = targets_of(grid, standing("r", Cell(0, 0), "rover"))
    assert target.viewpoints == {"rover": Cell(1, 0)}


@pytest.mark.parametrize("radius_m", [0.2, 1.2])
def test_where_sight_ends_at_the_area_to_explore_the_robot_still_goes_there(radius_m: float) -> None:
    hedge = Terrain(code=ROUGH, name="hedge", blocks_sight=True)
    cells = draw(*5 * ["???......,,,,???"]).cells
    grid = Grid(cells=cells, resolution_m=1.0, terrains=(Terrain(code=FLOOR, name="floor"), hedge))
    area = Zone(kind=ZoneKind.EXPLORE, polygon_m=((7.0, 0.0), (16.0, 0.0), (16.0, 5.0), (7.0, 5.0)))
    kind = rover(radius_m=radius_m)
    targets = targets_of(zoned(grid, {"area": area}), standing("r", Cell(7, 2), "rover"), kinds=(kind,))
    assert {target.viewpoints["rover"].x for target in targets} == {12 if radius_m < 1 else 11}


def test_a_frontier_no_robot_fits_at_is_refused_as_too_narrow() -> None:
    rows = ("##?##", "##.##", "##.##", "##.##", ".....", "..c..", ".....")
    grid = draw(*rows)
    assert targets_of(grid, standing("c", *where("c", *rows)), kinds=(CARRIER,)) == ()
    assert reasons(grid, standing("c", *where("c", *rows)), kinds=(CARRIER,)) == [(Cell(2, 5), 1, TOO_NARROW)]


@pytest.mark.parametrize(
    ("rows", "radius_m"),
    [
        (("##?##", "##.##", ".....", "..c..", "....."), 1.2),  # it covers the frontier
        (("#?###", "#..##", "#....", "..c..", "....."), 1.2),  # it stands diagonally beside it
        (
            ("###?###", "###.###", ".......", ".......", "...c...", ".......", "......."),
            2.2,
        ),  # only the rim of its footprint reaches it
    ],
)
def test_a_frontier_beside_which_a_robot_stands_is_not_too_narrow(rows: tuple[str, ...], radius_m: float) -> None:
    kind = carrier(radius_m=radius_m)
    ((_, _, reason),) = reasons(draw(*rows), standing("c", *where("c", *rows)), kinds=(kind,))
    assert reason == "robots can stand beside it, but none gets any farther"


MIXED = random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, ROUGH, UNKNOWN), smallest=2, largest=14)


@given(cells=MIXED, radius=st.sampled_from([0.2, 1.2, 1.5, 2.3]), data=st.data())
def test_the_reason_for_a_refused_frontier_matches_where_robots_can_stand(
    cells: CellArray, radius: float, data: st.DataObject
) -> None:
    grid = Grid(cells=cells, resolution_m=1.0)
    kinds = (CARRIER, rover(radius_m=radius))
    finder, reach = look(grid, *_team(grid, data), kinds=kinds)
    stood_on, reached = (
        [Cell(int(x), int(y)) for kind in kinds for y, x in np.argwhere(masks[kind.name])]
        for masks in ({kind.name: footprint_of(grid, kind).standable for kind in kinds}, reach.by_type)
    )
    # a group is reported by its middle cell only, so only groups of one cell are known in full
    for cell, count, reason in _refused(finder, reach):
        if count == 1 and any(_beside(cell, at) for at in reached):
            assert reason == "robots can stand beside it, but none gets any farther"
        elif count == 1 and any(_beside(cell, at) for at in stood_on):
            assert reason not in (TOO_NARROW, "not reached: no robot can stand close enough to reveal more")
        if any(_beside(cell, at) for at in stood_on):
            assert reason != TOO_NARROW


def test_a_frontier_behind_a_wall_is_refused_as_not_connected() -> None:
    rows = ("r.#.?",)
    assert reasons(draw(*rows), standing("r", Cell(0, 0), "rover")) == [
        (Cell(3, 0), 1, "no robot that fits there can get there: not connected to the reach of the team")
    ]


def test_a_frontier_of_a_diagonal_wall_is_judged_by_its_own_surroundings() -> None:
    # open ground is in its bounding box only
    rows = ("##########", "#.......#?", "#......#.#", "#.c...#.#?", "#....#.#.#", "#...#.#?##", "#######.##")
    grid = draw(*rows)
    found = reasons(grid, standing("c", *where("c", *rows)), kinds=(CARRIER,))
    assert found
    assert {reason for _, _, reason in found} == {TOO_NARROW}


def test_a_frontier_where_a_robot_may_fit_is_not_reported_as_too_narrow() -> None:
    rows = ("#######???", "...####.??", ".c.###..??", "...####.??", "#######???")
    found = reasons(draw(*rows), standing("c", *where("c", *rows)), kinds=(CARRIER,))
    assert [reason for _, _, reason in found] == ["not reached: no robot can stand close enough to reveal more"]


def test_every_frontier_cell_is_a_targets_or_refused() -> None:
    rows = ("??.#.??", "?..#..?", "?r.#..?")
    finder, reach = look(draw(*rows), standing("r", *where("r", *rows), "rover"), kinds=(ROVER,))
    targets = finder.find(finder.frontiers(reach))
    left = finder.refused(targets, reach)
    assert sum(len(t.cells) for t in targets) + sum(r.frontier_cells for r in left) == len(finder.frontier())
    assert len(left) == 1


def test_a_frontier_that_leads_to_less_ground_than_a_robot_covers_is_refused() -> None:
    kind = rover(radius_m=1.2)  # it covers five cells
    corner = ("#########", "#......?#", "#.r....?#", "#......?#", "#########")
    hall = tuple(row[:-2] + "?" * 8 for row in corner)
    edge = tuple(row[:-2] + "?" for row in corner)  # the map may go on
    robot = standing("r", Cell(2, 2), "rover")
    for rows, least_ground, targets in ((corner, 1, 0), (corner, 0, 1), (hall, 1, 1), (edge, 1, 1)):
        finder, reach = look(draw(*rows), robot, kinds=(kind,), least_ground=least_ground)
        assert len(finder.find(finder.frontiers(reach))) == targets
    (_, _, reason), *_ = _refused(*look(draw(*corner), robot, kinds=(kind,), least_ground=1))
    assert reason == LITTLE_GROUND


@given(cells=MIXED, data=st.data())
def test_targets_have_unique_names_and_members_in_sight(cells: CellArray, data: st.DataObject) -> None:
    grid = Grid(cells=cells, resolution_m=1.0)
    robots = _team(grid, data)
    finder, reach = look(grid, *robots, kinds=(CARRIER, ROVER))
    found = finder.find(finder.frontiers(reach))
    assert len({target.name for target in found}) == len(found)
    everyone = [cell for target in found for cell in target.cells.tolist()]
    assert len(everyone) == len(set(everyone))
    for target in found:
        assert target.cell.y * grid.width + target.cell.x in target.cells
        assert set(target.cells.tolist()) <= _hopefully_seen(grid, target)
        for name, cell in target.viewpoints.items():
            assert reach.by_type[name][cell.y, cell.x]


@given(
    truth=random_cells(smallest=2, largest=16),
    radius=st.sampled_from([0.0, 0.7, 1.0, 1.2, 1.5, 2.0, 2.3, 3.1]),
    range_m=st.sampled_from([0.0, 1.0, 2.5, 6.0]),
    least_ground=st.sampled_from([0.0, 1.0, 4.0]),
    data=st.data(),
)
def test_a_robot_that_goes_to_targets_until_none_is_left_knows_all_it_could_reach_but_for_little_ground(
    truth: CellArray, radius: float, range_m: float, least_ground: float, data: st.DataObject
) -> None:
    kind = rover(radius_m=radius, range_m=range_m)
    start, wanted = _start(truth, kind, data)
    known = np.full_like(truth, UNKNOWN)
    territory = Territory(Grid(cells=known, resolution_m=1.0), (kind,))
    finder = TargetFinder(territory, least_ground)
    at, visits = start, 0
    while True:
        territory.reveal(_sensed(truth, known, kind, at))
        reach = reach_of(territory, [standing("r", at, "rover")])
        found = finder.find(finder.frontiers(reach))
        if not found:
            break
        at = data.draw(st.sampled_from(found)).viewpoints["rover"]
        visits += 1
        assert visits <= truth.size
    reached = reach.by_type["rover"]
    assert not (reached & ~wanted).any()
    assert (known[reached] != UNKNOWN).all()
    missed = np.bincount(parts(wanted & ~reached)[0].ravel())[1:]
    assert (missed < least_ground * len(disc(radius))).all()  # not worth a target


@given(truth=random_cells(smallest=4, largest=16), data=st.data())
def test_a_carrier_with_a_rover_explores_all_that_either_can_reach(truth: CellArray, data: st.DataObject) -> None:
    start, _ = _start(truth, CARRIER, data)
    robots = (standing("c", start), aboard("r", "c"))
    whole = reach_of(Territory(Grid(cells=truth, resolution_m=1.0), (CARRIER, ROVER)), robots)
    known = np.full_like(truth, UNKNOWN)
    territory = Territory(Grid(cells=known, resolution_m=1.0), (CARRIER, ROVER))
    finder = TargetFinder(territory)
    kind, at = CARRIER, start
    while True:
        territory.reveal(_sensed(truth, known, kind, at))
        reach = reach_of(territory, robots)
        found = finder.find(finder.frontiers(reach))
        if not found:
            break
        name, at = data.draw(st.sampled_from(sorted(data.draw(st.sampled_from(found)).viewpoints.items())))
        kind = territory.kinds[name]
    for name, mask in whole.by_type.items():
        assert np.array_equal(reach.by_type[name], mask)


def _team(grid: Grid, data: st.DataObject) -> tuple[PlacedRobot, ...]:
    cells = st.builds(Cell, st.integers(0, grid.width - 1), st.integers(0, grid.height - 1))
    return standing("c", data.draw(cells)), aboard("r", "c"), standing("s", data.draw(cells), "rover")


def _hopefully_seen(grid: Grid, target: Target) -> set[int]:
    opaque = grid.opaque_codes()
    opaque[UNKNOWN] = 0
    range_m = min({"carrier": CARRIER, "rover": ROVER}[name].sensor_range_m for name in target.viewpoints)
    return set(Sight(grid.cells, opaque).visible(target.cell, range_m).tolist())


def _start(truth: CellArray, kind: RobotType, data: st.DataObject) -> tuple[Cell, np.ndarray]:
    """Clear a place for a robot; return the place and the reach from there."""
    height, width = truth.shape
    span = min(int(kind.radius_m) + 1, (height - 1) // 2, (width - 1) // 2)
    start = Cell(data.draw(st.integers(span, width - 1 - span)), data.draw(st.integers(span, height - 1 - span)))
    for dx, dy in disc(kind.radius_m):
        if 0 <= start.x + dx < width and 0 <= start.y + dy < height:
            truth[start.y + dy, start.x + dx] = FLOOR
    territory = Territory(Grid(cells=truth, resolution_m=1.0), (kind,))
    return start, flood(territory.footprints[kind.name].standable, [start])


def _sensed(truth: CellArray, known: CellArray, kind: RobotType, at: Cell) -> np.ndarray:
    """Reveal the cells that a robot sees and touches; return the new ones."""
    seen = Sight(truth, Grid(cells=truth, resolution_m=1.0).opaque_codes()).visible(at, kind.sensor_range_m)
    new = np.unique(np.concatenate([seen, Contact(kind, 1.0).touched(truth, at)]))
    new = new[known.ravel()[new] == UNKNOWN]
    known.ravel()[new] = truth.ravel()[new]
    return new

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.maps.drawn_maps import ONE_DOOR, carrier, draw, random_cells, rover, where

from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory, dock_range_cells
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Mask
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import Role
from marsupial.model.scenario import Goal
from marsupial.model.situation import UNREACHABLE, SituationGoal
from marsupial.model.world import RobotReport
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import travel_table_ms

CARRIER, ROVER = carrier(), rover()
KINDS = (CARRIER, ROVER)
RECOVER = Goal()

CLOSED = tuple(row.replace("?", "#") for row in ONE_DOOR)
(START,) = where("c", *ONE_DOOR)


def ground(codes: set[int]) -> Mask:
    return np.isin(draw(*ONE_DOOR).cells, sorted(codes))


def report(name: str, cell: Cell | None, kind: str = "carrier", *, on: str | None = None, **rest: int) -> RobotReport:
    return RobotReport(name=name, type=kind, cell=cell, carrier=on, **{"free_at_ms": 0, **rest})


CARRYING = (report("c", START), report("r", None, "rover", on="c"))


def surveyor(grid: Grid, goal: Goal = RECOVER, homes: dict[str, Cell] | None = None) -> Surveyor:
    return Surveyor(Territory(grid, KINDS), {} if homes is None else homes, goal)


def survey(*robots: RobotReport, rows: tuple[str, ...] = ONE_DOOR, now_ms: int = 0, goal: Goal = RECOVER) -> Survey:
    return surveyor(draw(*rows), goal, {r.name: r.cell for r in robots if r.cell is not None}).survey(robots, now_ms)


def test_places_are_starts_targets_meetings_and_homes() -> None:
    found = survey(*CARRYING, report("s", Cell(1, 1), "rover"), goal=Goal(return_home=True))
    situation = found.situation
    assert situation.places == (
        "s_c",
        "s_s",
        *(target.name for target in found.targets),
        *(point.name for point in found.meetings),
        "h_c",
    )
    assert set(found.poses) == set(situation.places)
    assert situation.robot_by_name["r"].place is None
    assert situation.robot_by_name["r"].carrier == "c"


def test_only_carriers_have_homes() -> None:
    found = survey(*CARRYING, report("s", Cell(1, 1), "rover"), goal=Goal(return_home=True))
    assert found.situation.homes == ("h_c",)
    assert {robot.name: robot.home for robot in found.situation.robots} == {"c": "h_c", "r": None, "s": None}
    assert found.poses["h_c"] == {"carrier": START}


def test_without_return_home_no_carrier_has_a_home() -> None:
    assert survey(*CARRYING).situation.homes == ()


def test_recovery_and_return_are_asked_for_only_once_no_target_is_left() -> None:
    asks = Goal(recover_rovers=True, return_home=True)
    assert survey(*CARRYING, goal=asks).situation.goal == SituationGoal()
    done = survey(*CARRYING, rows=CLOSED, goal=asks)
    assert done.targets == ()
    assert done.situation.goal == SituationGoal(recover_rovers=True, return_home=True)


@pytest.mark.parametrize(
    ("goal", "asked"),
    [
        (Goal(recover_rovers=False), SituationGoal()),
        (Goal(recover_rovers=True), SituationGoal(recover_rovers=True)),
        (Goal(recover_rovers=False, return_home=True), SituationGoal(recover_rovers=True, return_home=True)),
    ],
)
def test_carriers_that_return_home_bring_the_rovers(goal: Goal, asked: SituationGoal) -> None:
    assert survey(*CARRYING, rows=CLOSED, goal=goal).situation.goal == asked


def test_a_driving_robot_is_free_at_the_reported_place_and_time() -> None:
    found = survey(
        report("c", START, free_at_ms=12_500), report("r", None, "rover", on="c", free_at_ms=12_500), now_ms=10_000
    )
    states = found.situation.robot_by_name
    assert (states["c"].free_at_ms, states["c"].place) == (2_500, "s_c")
    assert (states["r"].free_at_ms, states["r"].carrier) == (0, "c")
    assert survey(report("c", START, free_at_ms=10_000), now_ms=10_000).situation.robots[0].free_at_ms == 0


def test_a_rover_being_set_down_is_on_the_ground_later() -> None:
    found = survey(
        report("c", START, free_at_ms=5_000), report("r", Cell(4, 4), "rover", free_at_ms=5_000), now_ms=1_000
    )
    assert found.situation.robot_by_name["r"].free_at_ms == 4_000
    assert found.poses["s_r"] == {"rover": Cell(4, 4)}


def test_lost_robots_are_left_out() -> None:
    found = survey(*CARRYING, report("d", Cell(7, 2), lost=True), report("s", None, "rover", on="d", lost=True))
    assert set(found.situation.robot_by_name) == {"c", "r"}
    assert "s_d" not in found.poses


def test_a_lost_carrier_has_no_reach_and_no_meeting_points() -> None:
    found = survey(report("c", START, lost=True), report("r", Cell(8, 7), "rover"))
    assert found.meetings == ()
    assert [set(target.viewpoints) for target in found.targets] == [{"rover"}]
    assert survey(report("c", START, lost=True), report("r", None, "rover", on="c", lost=True)).targets == ()


def test_a_target_lists_its_explorers() -> None:
    found = survey(*CARRYING)
    (target,), (told,) = found.targets, found.situation.targets
    assert (told.name, told.explorers, told.reveal_m2) == (target.name, {"rover"}, target.reveal_m2)
    assert found.situation.travel("carrier", "s_c", target.name) is None


@settings(max_examples=25)
@given(st.integers(0, 9999))
def test_travel_tables_hold_the_shortest_paths_of_each_type_while_the_map_grows(seed: int) -> None:
    """One type is a slow rover, another one has shorter diagonal steps."""
    rng = np.random.default_rng(seed)
    truth = rng.choice([FLOOR, ROUGH, OBSTACLE], (9, 12), p=[0.6, 0.2, 0.2]).astype(np.uint8)
    truth[3:6, 3:8] = FLOOR
    slow, square = replace(ROVER, name="slow", speed_mps=0.3), replace(ROVER, name="square", diagonal=1.0)
    kinds = replace(CARRIER, radius_m=0.6), ROVER, slow, square
    robots = [report(kind.name, Cell(4 + i, 4), kind.name) for i, kind in enumerate(kinds)]
    known = np.full_like(truth, UNKNOWN)
    territory = Territory(Grid(cells=known, resolution_m=0.5), kinds)
    looking = Surveyor(territory, {"carrier": Cell(5, 4)}, Goal(return_home=True))
    for part in np.array_split(np.argsort(np.abs(np.arange(truth.size) - 54), kind="stable"), 4):
        known.ravel()[part] = truth.ravel()[part]
        territory.reveal(part)
        found = looking.survey(robots, 0)
        for kind in kinds:
            names = [name for name in found.situation.places if kind.name in found.poses[name]]
            cells = [found.poses[name][kind.name] for name in names]
            search = PathSearch(territory.footprints[kind.name].standable, kind.diagonal)
            at = [found.situation.place_index[name] for name in names]
            expected = np.full_like(found.situation.travel_ms[kind.name], UNREACHABLE)
            expected[np.ix_(at, at)] = travel_table_ms(search.matrix(cells), 0.5, kind.speed_mps)
            assert np.array_equal(found.situation.travel_ms[kind.name], expected)


def test_a_meeting_point_is_a_place_for_all_types_that_reach_it() -> None:
    found = survey(*CARRYING)
    for point in found.meetings:
        assert found.poses[point.name] == {"carrier": point.carrier_cell, "rover": point.rover_cell}


@given(random_cells((OBSTACLE, FLOOR, FLOOR, ROUGH, UNKNOWN), 4), st.data())
def test_all_types_with_a_pose_at_a_meeting_point_can_dock_there(cells: CellArray, data: st.DataObject) -> None:
    grid = Grid(cells=cells, resolution_m=0.5)
    kinds = (carrier(radius_m=0.1), carrier("large", radius_m=0.45), rover(), rover("small", radius_m=0.0))
    territory = Territory(grid, kinds)
    floor = np.argwhere(territory.footprints["large"].standable)
    assume(len(floor))
    y, x = data.draw(st.sampled_from(floor.tolist()))
    team = [report("c", Cell(x, y)), report("l", Cell(x, y), "large")]
    team += [report("r", None, "rover", on="c"), report("s", None, "small", on="l")]
    found = Surveyor(territory, {}, Goal()).survey(team, 0)
    search = PathSearch(territory.see_through)
    for point in found.meetings:
        way = search.lengths(point.carrier_cell, [point.rover_cell])[0]
        here = [kind for kind in kinds if kind.name in found.poses[point.name]]
        for bearer in (kind for kind in here if kind.role is Role.CARRIER):
            for borne in (kind for kind in here if kind.role is Role.ROVER):
                assert way <= dock_range_cells(bearer, borne, grid.resolution_m)


def test_direct_times_run_over_all_ground_at_the_speed_of_the_carrier() -> None:
    found = survey(*CARRYING)
    (target,) = found.targets
    search = PathSearch(ground({FLOOR, ROUGH}))
    length = search.lengths(START, [target.viewpoints["rover"]])[0]
    assert found.direct_ms() == {"c": {target.name: pytest.approx(length * 1000, abs=1)}}


def test_targets_with_no_way_at_all_have_no_direct_time() -> None:
    rows = ("c.#r?",)
    grid = draw(*rows)
    kinds = (carrier(radius_m=0.2), ROVER)
    found = Surveyor(Territory(grid, kinds), {}, Goal()).survey(
        (report("c", Cell(0, 0)), report("r", Cell(3, 0), "rover")), 0
    )
    assert len(found.targets) == 1
    assert found.direct_ms() == {"c": {}}


def test_points_in_use_stay() -> None:
    kept = MapMeeting(
        name="kept", carrier_cell=Cell(4, 3), rover_cell=Cell(4, 5), carrier_type="carrier", rover_type="rover"
    )
    found = surveyor(draw(*ONE_DOOR)).survey(CARRYING, 0, [kept])
    assert kept in found.meetings
    assert found.connects["kept"] == {target.name for target in found.targets}


def test_remaining_frontiers_have_reasons() -> None:
    rows = ("#?#####.?", "#.#####.#", *CLOSED)
    rows = tuple(row.ljust(11, "#") for row in rows)
    looking = surveyor(draw(*rows))
    targets = looking.targets(CARRYING)
    assert targets == ()
    assert {left.reason for left in looking.remaining(targets, "never seen")} == {
        "no robot that fits there can get there: not connected to the reach of the team"
    }
    looking = surveyor(draw(*ONE_DOOR))
    targets = looking.targets(CARRYING)
    (left,) = looking.remaining(targets, "out of time")
    assert (left.cell, left.frontier_cells, left.reason) == (targets[0].cell, len(targets[0].cells), "out of time")


def test_a_survey_sees_what_was_revealed_since_the_last_one() -> None:
    known = draw(*ONE_DOOR).cells.copy()
    territory = Territory(Grid(cells=known, resolution_m=1.0), KINDS)
    looking = Surveyor(territory, {}, Goal())
    assert len(looking.survey(CARRYING, 0).targets) == 1
    known[8, 9] = OBSTACLE
    territory.reveal(np.array([8 * 11 + 9], dtype=np.int64))
    assert looking.survey(CARRYING, 0).targets == ()


def test_moved_robots_are_surveyed_again() -> None:
    looking = surveyor(draw(*ONE_DOOR))
    assert len(looking.targets(CARRYING)) == 1
    assert looking.targets((report("c", START),)) == ()
    assert len(looking.targets(CARRYING)) == 1

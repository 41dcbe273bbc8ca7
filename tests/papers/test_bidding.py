from collections.abc import Sequence
from math import dist, hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.maps.drawn_maps import draw
from support.maps.frontier_views import moment
from support.missions.small_missions import Recorder

from marsupial.library.missions import simulate
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Budget, Cell, DriveStarted, Grid, Status
from marsupial.papers.alkhawaldah.experiment import HOPPER, cell_world
from marsupial.papers.alkhawaldah.rule import Bidding
from marsupial.papers.sheng2006.rule import Sheng
from marsupial.strategies.frontier.rule import Explorer, FrontierView, counted

HALLWAY = draw("???????????", "???????????", "???.....???", "???..a.b???", "???.....???", "???????????")
A, B = Cell(5, 2), Cell(7, 2)


def robot(name: str, cell: Cell, goal: int | None = None, trail: tuple[Cell, ...] = ()) -> Explorer:
    return Explorer(name=name, kind=HOPPER, cell=cell, heading=0, goal=goal, trail=trail)


def chosen(view: FrontierView, rule: Bidding | Sheng) -> dict[str, Cell]:
    return {name: view.cell(cell) for name, cell in rule.choose(view).items()}


def unknown_near(grid: Grid, cell: Cell, but: Sequence[Cell] = ()) -> int:
    """Count the unknown neighbours of a cell that are not neighbours of the other cells."""
    count = 0
    for y, x in zip(*np.nonzero(grid.cells == UNKNOWN), strict=True):
        apart = max(abs(x - cell.x), abs(y - cell.y))
        count += apart == 1 and all(max(abs(x - other.x), abs(y - other.y)) > 1 for other in but)
    return count


@st.composite
def moments(draw_: st.DrawFn) -> FrontierView:
    """Draw a small map known in part, with two robots that stand side by side."""
    width, height = draw_(st.integers(5, 9)), draw_(st.integers(4, 8))
    rng = np.random.default_rng(draw_(st.integers(0, 10**6)))
    cells = rng.choice(np.array([FLOOR, FLOOR, FLOOR, OBSTACLE, UNKNOWN, UNKNOWN], dtype=np.uint8), (height, width))
    x, y = int(rng.integers(width - 1)), int(rng.integers(height))
    cells[y, x] = cells[y, x + 1] = FLOOR
    goal = int(rng.integers(cells.size))
    robots = [robot("a", Cell(x, y)), robot("b", Cell(x + 1, y), goal)]
    return moment(Grid(cells=cells, resolution_m=1.0), robots)


@given(view=moments(), weights=st.tuples(*[st.sampled_from([0.0, 0.5, 1.0, 2.0])] * 3))
def test_bids_are_those_of_equation_1(view: FrontierView, weights: tuple[float, float, float]) -> None:
    one, other = view.robots
    of_neighbours, of_partner, of_way = weights
    rule = Bidding(W_n=of_neighbours, W_p=of_partner, W_c=of_way)
    ways = view.ways(one)
    bids = rule.bids(view, one, ways, [other], [])
    for cell, way, bid in zip(view.frontier(one).cells.tolist(), ways.tolist(), bids.tolist(), strict=True):
        there = view.cell(cell)
        expected = of_neighbours * unknown_near(view.grid, there) + of_partner * dist(there, other.cell) - of_way * way
        assert bid == pytest.approx(expected, nan_ok=True)


@given(view=moments())
def test_gains_are_those_of_equation_2(view: FrontierView) -> None:
    one, other = view.robots
    assert other.goal is not None
    near = [other.cell, view.cell(other.goal)]
    bids = Sheng(w_2=0.0).bids(view, one, np.zeros(len(view.frontier(one).cells)), [other], [other.goal])
    for cell, bid in zip(view.frontier(one).cells.tolist(), bids.tolist(), strict=True):
        assert bid == unknown_near(view.grid, view.cell(cell), near)


@given(view=moments())
def test_a_robot_goes_to_the_first_of_its_highest_bids(view: FrontierView) -> None:
    one, other = view.robots
    ways = view.ways(one)
    bids = Bidding().bids(view, one, ways, [other], [])
    goal = Bidding().choose(view).get("a")
    if not np.isfinite(ways).any():
        assert goal is None
        return
    bids[~np.isfinite(ways)] = -np.inf
    order = [(-round(bid, 6), cell) for bid, cell in zip(bids, view.frontier(one).cells.tolist(), strict=True)]
    assert goal == min(order)[1]


@settings(max_examples=40)
@given(
    seed=st.integers(0, 1000),
    size=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    around=st.sets(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1),
)
def test_cells_around_are_counted_one_by_one(seed: int, size: tuple[int, int], around: set[tuple[int, int]]) -> None:
    mask = np.random.default_rng(seed).random(size) < 0.5
    found = counted(mask, np.array(sorted(around)), np.arange(mask.size))
    for index, count in enumerate(found.tolist()):
        y, x = divmod(index, size[1])
        cells = [(y + dy, x + dx) for dx, dy in around if 0 <= y + dy < size[0] and 0 <= x + dx < size[1]]
        assert count == sum(mask[cell] for cell in cells)


def test_partners_are_kept_apart() -> None:
    view = moment(HALLWAY, [robot("a", A), robot("b", B)])
    goals = chosen(view, Bidding())
    assert goals["a"].x == 3
    alone = chosen(moment(HALLWAY, [robot("b", B)]), Bidding())
    assert alone["b"].x == 7
    assert chosen(view, Bidding(W_n=0.0, W_p=0.0))["a"] in {Cell(5, 1), Cell(5, 3), Cell(4, 1), Cell(4, 3), Cell(6, 1)}


def test_cells_that_another_robot_will_see_are_no_gain() -> None:
    robots = [robot("a", A), robot("b", B, goal=3 * HALLWAY.width + 3)]
    goals = chosen(moment(HALLWAY, robots), Sheng(w_2=0.0))
    assert hypot(goals["a"].x - 3, goals["a"].y - 3) > 1.5
    first = chosen(moment(HALLWAY, [robot("a", A), robot("b", A)]), Sheng(w_2=0.0))
    assert first["a"] != first["b"]


def test_a_robot_that_goes_to_and_fro_steps_aside_by_lot() -> None:
    side = Cell(5, 3)
    going = robot("a", A, trail=(side, A, side, A))
    assert going.oscillates
    assert not robot("a", A, trail=(side, A, Cell(4, 2), A)).oscillates
    assert not robot("a", A, trail=(A, side, A)).oscillates
    aside = {chosen(moment(HALLWAY, [going, robot("b", B)], seed=seed), Bidding())["a"] for seed in range(60)}
    assert aside == {Cell(x, y) for x in (4, 5, 6) for y in (1, 2, 3)} - {A}


def test_steps_aside_cut_no_corners_and_end_on_the_map() -> None:
    corner = draw("???", ".#?", "..?")
    view = moment(corner, [robot("a", Cell(0, 0))])
    assert {view.cell(int(cell)) for cell in view.around(view.robots[0])} == {Cell(1, 0), Cell(0, 1)}
    boxed = draw("##?", ".#?")
    stuck = robot("a", Cell(0, 0), trail=(Cell(1, 0), Cell(0, 0)) * 2)
    assert Bidding().choose(moment(boxed, [stuck])) == {}


def test_of_several_shortest_ways_one_is_taken_by_lot() -> None:
    hall = draw("......", "......", ".#....", "......")
    robots = [robot("a", Cell(0, 2))]

    def steps(place: Cell) -> set[Cell]:
        return {moment(hall, robots, seed=seed).step_towards(robots[0], place) for seed in range(40)}

    assert steps(Cell(4, 2)) == {Cell(1, 2), Cell(1, 3)}
    assert steps(Cell(1, 0)) == {Cell(0, 1)}
    assert steps(Cell(1, 3)) == {Cell(1, 3)}
    assert steps(Cell(0, 2)) == {Cell(0, 2)}


@pytest.mark.parametrize("strategy", ["bidding", "sheng"])
def test_worlds_of_cells_are_explored_at_one_step_a_second(strategy: str) -> None:
    logs = []
    for _ in range(2):
        log = Recorder()
        world = cell_world("cells", 10, 9, 6, 2)
        summary = simulate(world, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=4, observer=log)
        assert (summary.status, summary.coverage, summary.plans_invalid) == (Status.COMPLETE, 1.0, 0)
        drives = log.of(DriveStarted)
        assert all(len(event.steps) == 1 and event.t_ms % 1000 == 0 for event in drives)
        logs.append((summary.exploration_time_s, drives))
    assert logs[0] == logs[1]


def test_bidding_is_faster_than_the_function_of_sheng() -> None:
    def steps(strategy: str) -> float:
        world = cell_world("cells", 16, 16, 8, 2)
        missions = [
            simulate(world, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=seed)
            for seed in range(1, 7)
        ]
        return float(np.mean([mission.exploration_time_s for mission in missions]))

    assert steps("bidding") < steps("sheng")

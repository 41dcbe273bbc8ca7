"""Robots that keep out of each other's footprints wait, drive around or make room, and all arrive."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import draw, where
from support.missions.small_missions import Recorder
from support.missions.small_teams import carrier_at, kinds_of, rover_at, rover_on

from marsupial.formats.loglines import LogDecoder, LogEncoder
from marsupial.generators.builtin import builtin_scenario
from marsupial.library import missions
from marsupial.library.metrics import Summary
from marsupial.mission.playback import Playback
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import Interference, MapMeeting, PlacedRobot, Status
from marsupial.model.plan import Action, ActionName
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import MissionLimits
from marsupial.model.world import News
from marsupial.paths.fields import PathSearch
from marsupial.sim.claims import Claims
from marsupial.sim.clearance import gap
from marsupial.sim.deadlocks import GIVE_UP_MS
from marsupial.sim.motion import Motion, Rule, SimulatedRobot
from marsupial.sim.world import SimulatedWorld

LATER = 10_000_000

LANE = ("###########", "#.........#", "#####.#####", "###########")
"""One lane, 9 cells long, with a niche in the middle."""

HALL = ("#######", "#.....#", "#.....#", "#.....#", "#######")


def bodies() -> dict[str, RobotType]:
    """Return robot types with one-metre footprints."""
    return {name: replace(kind, radius_m=0.4) for name, kind in kinds_of(carrier_range_m=20, rover_range_m=20).items()}


class WatchedWorld(SimulatedWorld):
    """A world with interference that records every pair of overlapping robots."""

    def __init__(self, truth: Grid, kinds: Mapping[str, RobotType], robots: Sequence[PlacedRobot]) -> None:
        super().__init__(truth, kinds, robots, interference=True)
        self.claims = self._claims
        self.watch = Watch(self._motion, self.claims)
        self._motion.rules.append(self.watch)


class Watch(Rule):
    """Records every pair of robots that overlap, and may not, after commands have begun and after each moment."""

    def __init__(self, motion: Motion, claims: Claims) -> None:
        self._motion = motion
        self._claims = claims
        self.faults: list[tuple[int, str, str]] = []
        self._near = self._overlapping()

    def settle(self) -> None:
        before, self._near = self._near, self._overlapping()
        for (one, other), distance in self._near.items():
            mates = {one.kind.role, other.kind.role} == {Role.CARRIER, Role.ROVER}
            excused = self._claims.meet(one, other) or one.partner is other or (mates and (one, other) in before)
            if not excused and distance < before.get((one, other), 1e9):
                self.faults.append((self._motion.now_ms, one.name, other.name))

    def _overlapping(self) -> dict[tuple[SimulatedRobot, SimulatedRobot], float]:
        near = {}
        for one, other in combinations(self._motion.team.values(), 2):
            claim, second = self._claims.claim(one), self._claims.claim(other)
            apart = self._claims.clearance.apart(one.kind, other.kind)
            if claim is not None and second is not None and (distance := gap(claim, second)) < apart:
                near[one, other] = distance
        return near


def crowd(rows: Sequence[str], *robots: PlacedRobot) -> WatchedWorld:
    """Return a world after the robots' first look."""
    world = WatchedWorld(draw(*rows), bodies(), robots)
    world.advance(0)
    return world


def at(world: SimulatedWorld) -> dict[str, Cell | None]:
    return {robot.name: robot.cell for robot in world.robots()}


def send(world: WatchedWorld, robot: str, goal: Cell) -> None:
    """Send a robot to a cell, on the shortest way over the known map."""
    start = at(world)[robot]
    assert start is not None
    route = PathSearch(world.claims.clearance.ground(bodies()["carrier"])).route(start, goal)
    assert route is not None
    world.drive(robot, route)


def ended(world: SimulatedWorld, *robots: str) -> list[News]:
    """Return the news until the commands of these robots have ended."""
    news: list[News] = []
    left = set(robots)
    while left:
        news.append(world.advance(LATER))
        assert world.now_ms < LATER, f"{left} never arrive"
        left -= {*news[-1].finished, *(name for name, _ in news[-1].failed)}
    return news


def test_robots_that_keep_clear_of_each_other_drive_as_if_alone() -> None:
    robots = [carrier_at(1, 1, 1), carrier_at(5, 3, 2)]
    worlds = [SimulatedWorld(draw(*HALL), bodies(), robots, interference=there) for there in (False, True)]
    for world in worlds:
        world.advance(0)
        world.drive("c1", [Cell(x, 1) for x in range(1, 6)])
    while (news := [world.advance(LATER) for world in worlds])[0].t_ms < LATER:
        assert (news[0].t_ms, news[0].finished) == (news[1].t_ms, news[1].finished)
    assert worlds[0].robots() == worlds[1].robots()
    assert worlds[1].interference() == Interference(waits=0, waited_s=0.0, deadlocks=0)


def test_a_robot_waits_until_another_one_has_crossed_its_way() -> None:
    world = crowd(HALL, carrier_at(1, 2, 1), carrier_at(3, 1, 2))
    world.drive("c2", [Cell(3, y) for y in (1, 2, 3)])
    world.drive("c1", [Cell(x, 2) for x in range(1, 6)])
    news = ended(world, "c1", "c2")
    assert not world.watch.faults
    assert at(world) == {"c1": Cell(5, 2), "c2": Cell(3, 3)}
    told = world.interference()
    assert (told.waits, told.waited_s, told.deadlocks) == (1, 1.0, 0)
    stands, goes_on = [passage for each in news for passage in each.passages]
    assert (stands, goes_on) == (("c1", (Cell(2, 2),)), ("c1", tuple(Cell(x, 2) for x in range(2, 6))))
    assert news[-1].t_ms == 5000


def test_two_robots_that_meet_in_a_lane_pass_each_other_at_a_niche() -> None:
    (west, east) = Cell(1, 2), Cell(9, 2)
    world = crowd(LANE, carrier_at(*west, 1), carrier_at(*east, 2))
    send(world, "c1", east)
    send(world, "c2", west)
    ended(world, "c1", "c2")
    assert not world.watch.faults
    assert at(world) == {"c1": east, "c2": west}
    assert world.interference().deadlocks > 0


@pytest.mark.parametrize(
    ("rows", "middle", "left_at"),
    [(LANE, Cell(5, 2), Cell(5, 1)), (HALL, Cell(3, 2), Cell(3, 2))],
    ids=["it makes room in a lane and stays there", "in a hall the other one drives around it"],
)
def test_a_robot_with_nothing_to_do_lets_another_one_pass(rows: Sequence[str], middle: Cell, left_at: Cell) -> None:
    world = crowd(rows, carrier_at(1, 2, 1), carrier_at(*middle, 2))
    goal = Cell(2 * middle.x - 1, 2)
    send(world, "c1", goal)
    ended(world, "c1")
    assert not world.watch.faults
    assert at(world) == {"c1": goal, "c2": left_at}


def test_a_robot_backs_off_to_let_one_out_of_a_niche_that_it_has_to_go_to() -> None:
    niche = Cell(5, 1)
    world = crowd(LANE, carrier_at(1, 2, 1), carrier_at(*niche, 2))
    send(world, "c1", niche)
    ended(world, "c1")
    assert not world.watch.faults
    assert at(world)["c1"] == niche
    assert world.now_ms < GIVE_UP_MS


def test_a_robot_that_makes_room_takes_a_command_as_any_other() -> None:
    world = crowd(LANE, carrier_at(1, 2, 1), carrier_at(5, 2, 2))
    send(world, "c1", Cell(9, 2))
    while at(world)["c2"] == Cell(5, 2):
        world.advance(LATER)
    send(world, "c2", Cell(1, 2))
    ended(world, "c2")
    assert not world.watch.faults
    assert at(world)["c2"] == Cell(1, 2)


def test_a_drive_for_which_no_robot_can_make_room_fails() -> None:
    lane = ("######", "#....#", "######")
    world = crowd(lane, carrier_at(1, 1, 1), carrier_at(4, 1, 2))
    send(world, "c1", Cell(4, 1))
    news = ended(world, "c1")[-1]
    assert news.failed == (("c1", "no way past c2"),)
    assert news.t_ms >= GIVE_UP_MS
    assert at(world) == {"c1": Cell(3, 1), "c2": Cell(4, 1)}


def test_a_stopped_robot_that_waits_stands_at_once() -> None:
    world = crowd(LANE, carrier_at(1, 2, 1), carrier_at(5, 2, 2))
    send(world, "c1", Cell(9, 2))
    while not any(name == "c1" for name, _ in world.advance(LATER).passages):
        pass
    world.stop("c1")
    assert world.advance(LATER).finished == ("c1",)
    assert at(world)["c1"] == Cell(4, 2)


def meeting(rover: Cell, carrier: Cell, name: ActionName) -> tuple[list[MapMeeting], list[Action]]:
    """Return a plan in which ``r1`` and ``c1`` meet."""
    point = MapMeeting(name="m", carrier_cell=carrier, rover_cell=rover, carrier_type="carrier", rover_type="rover")
    action = Action(name=name, start_ms=0, duration_ms=1, robot="r1", place="m", carrier="c1")
    return [point], [action]


def test_only_who_is_to_dock_may_come_to_where_the_carrier_stands() -> None:
    for planned in (True, False):
        world = crowd(HALL, carrier_at(3, 2, 1), rover_at(1, 2, 1))
        if planned:
            world.plan(*meeting(Cell(3, 2), Cell(3, 2), ActionName.DOCK))
        world.drive("r1", [Cell(x, 2) for x in (1, 2, 3)])
        ended(world, "r1")
        assert at(world)["c1"] == (Cell(3, 2) if planned else Cell(2, 3)) or not planned
        assert (world.interference().waits == 0) is planned


def test_a_rover_is_set_down_once_the_ground_is_clear() -> None:
    world = crowd(HALL, carrier_at(3, 2, 1), rover_on("c1", 1), rover_at(2, 2, 2))
    world.undock("r1", "c1", Cell(2, 2))
    told = next(robot for robot in world.robots() if robot.name == "r1")
    assert (told.cell, told.carrier, told.free_at_ms) == (Cell(2, 2), None, 5000)
    ended(world, "r1", "c1")
    assert not world.watch.faults
    assert at(world)["r1"] == Cell(2, 2) != at(world)["r2"]


def test_a_rover_that_made_room_comes_back_to_dock() -> None:
    rows = ("###########", "#.........#", "###########", "###########")
    world = crowd(rows, carrier_at(5, 2, 1), rover_at(4, 2, 1), carrier_at(1, 2, 2))
    send(world, "c2", Cell(3, 2))
    ended(world, "c2")
    world.dock("r1", "c1")
    ended(world, "r1", "c1")
    assert not world.watch.faults
    assert at(world)["r1"] is None


@st.composite
def crowds(draw_: st.DrawFn) -> tuple[tuple[str, ...], int, int]:
    """Return a small map of lanes and rooms, a number of robots and a seed for where they drive."""
    width, height = draw_(st.integers(4, 9)), draw_(st.integers(2, 6))
    rows = draw_(st.lists(st.text("....#", min_size=width, max_size=width), min_size=height, max_size=height))
    wall = "#" * (width + 2)
    return (wall, *(f"#{row}#" for row in rows), wall), draw_(st.integers(2, 5)), draw_(st.integers(0, 999))


@given(crowds())
def test_no_two_robots_ever_overlap_and_every_drive_ends(found: tuple[tuple[str, ...], int, int]) -> None:
    rows, count, seed = found
    rng = random.Random(seed)
    cells = where(".", *rows)
    if len(cells) < count:
        return
    starts = rng.sample(cells, count)
    world = crowd(rows, *(carrier_at(cell.x, cell.y, k) for k, cell in enumerate(starts)))
    busy: set[str] = set()
    sent = 0
    while sent < 12 or busy:
        for name, cell in at(world).items():
            if name in busy or sent >= 12:
                continue
            sent += 1
            route = PathSearch(world.claims.clearance.ground(bodies()["carrier"])).route(cell, rng.choice(cells))
            if cell is not None and route is not None:
                world.drive(name, route)
                busy.add(name)
        if not busy:
            continue
        news = world.advance(LATER)
        assert world.now_ms < LATER
        busy -= {*news.finished, *(name for name, _ in news.failed)}
        if busy and rng.random() < 0.05:
            world.stop(rng.choice(sorted(busy)))
    assert not world.watch.faults


def explore(name: str, strategy: str, carriers: int, rovers: int, seed: int = 1) -> tuple[Summary, Playback]:
    scenario = replace(
        builtin_scenario(name, carriers, rovers), interference=True, limits=MissionLimits(time_ms=7_200_000)
    )
    events = Recorder()
    summary = missions.simulate(
        scenario, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=seed, observer=events
    )
    encoder, decoder = LogEncoder(), LogDecoder()
    assert [decoder.event(encoder.line(event)) for event in events.events] == events.events
    return summary, Playback(events.events)


@pytest.mark.parametrize(
    ("name", "strategy", "carriers", "rovers"),
    [
        ("lobby", "assignment", 6, 2),
        ("lobby", "clairvoyant", 3, 2),
        ("lobby", "wurm2010", 6, 2),
        ("rooms", "closest-frontier", 6, 0),
        ("maze", "assignment", 4, 2),
    ],
)
def test_missions_are_complete_without_any_overlap(
    name: str, strategy: str, carriers: int, rovers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    worlds: list[WatchedWorld] = []

    def watched(truth: Grid, kinds: Mapping[str, RobotType], robots: Sequence[PlacedRobot], *_: object, **__: object):
        worlds.append(WatchedWorld(truth, kinds, robots))
        return worlds[-1]

    monkeypatch.setattr(missions, "SimulatedWorld", watched)
    summary, playback = explore(name, strategy, carriers, rovers, seed=2)
    assert (summary.status, summary.plans_invalid) == (Status.COMPLETE, 0), summary.reason
    assert [world.watch.faults for world in worlds] == [[]]
    assert summary.interference == worlds[0].interference()
    assert summary.interference.waits > 0
    assert playback.mission.interference
    assert {robot.name: robot.carrier for robot in playback.robots_at(playback.end_ms)} == {
        robot.name: robot.carrier for robot in worlds[0].robots()
    }


def test_the_same_crowd_does_the_same_again() -> None:
    first, again = (explore("rooms", "heuristic-plus", 4, 2, seed=3) for _ in range(2))
    assert first[1].events == again[1].events

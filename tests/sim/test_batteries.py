"""Batteries in the simulator: what drains and charges them, and what happens when one is empty."""

from dataclasses import replace

import pytest
from support.missions.small_teams import CORRIDOR, carrier_at, drawn_grid, kinds_of, rover_at, rover_on

from marsupial.model import Battery, Cell, EnergyModel, News, PlacedRobot
from marsupial.model.faults import Fault, FaultKind
from marsupial.sim.world import SimulatedWorld

LATER = 1_000_000
ENERGY = EnergyModel(idle_w=4.0, drive_w=6.0, metre_j=4.0)  # a rover at 0.5 m/s: 4 W standing, 12 W driving


@pytest.fixture(params=[False, True], ids=["alone", "interference"])
def begun(request: pytest.FixtureRequest):
    """Return a function that makes a corridor of 1 m cells in which rovers, and perhaps carriers, have batteries."""

    def made(
        *robots: PlacedRobot, rover_j: float = 1000.0, carrier_j: float | None = None, charger: Cell | None = None
    ) -> SimulatedWorld:
        kinds = kinds_of()
        kinds["rover"] = replace(kinds["rover"], energy=ENERGY, battery=Battery(capacity_j=rover_j, charge_w=50.0))
        if carrier_j is not None:
            battery = Battery(capacity_j=carrier_j, charge_w=100.0)
            kinds["carrier"] = replace(kinds["carrier"], energy=EnergyModel(idle_w=20.0, drive_w=60.0), battery=battery)
        grid = replace(drawn_grid(*CORRIDOR), chargers=() if charger is None else (charger,))
        faults = [Fault(kind=FaultKind.RETURNS, robot="r1", at_ms=200_000)]
        world = SimulatedWorld(grid, kinds, robots, faults, interference=request.param)
        world.advance(0)
        return world

    return made


def charge(world: SimulatedWorld, name: str) -> float | None:
    return next(robot.charge for robot in world.robots() if robot.name == name)


def until(world: SimulatedWorld, what: str) -> News:
    while not getattr(news := world.advance(LATER), what):
        assert news.t_ms < LATER, f"no {what}"
    return news


def test_standing_and_driving_discharge(begun) -> None:
    world = begun(rover_at(1, 1), carrier_at(6, 1))
    world.advance(10_000)
    assert charge(world, "r1") == pytest.approx(1 - 40 / 1000)
    world.drive("r1", tuple(Cell(x, 1) for x in range(1, 4)))
    # on its way a robot reports what it will have at its next cell: 2 s at 12 W later
    assert charge(world, "r1") == pytest.approx(1 - (40 + 24) / 1000)
    until(world, "finished")
    assert charge(world, "r1") == pytest.approx(1 - (40 + 48) / 1000)
    assert charge(world, "c1") is None


def test_a_rover_charges_aboard_and_its_carrier_pays(begun) -> None:
    world = begun(carrier_at(1, 1), rover_on("c1"), carrier_j=10_000.0)
    world.undock("r1", "c1", Cell(2, 1))
    until(world, "finished")
    level = 1000 - 5 * 4
    assert charge(world, "r1") == pytest.approx(level / 1000)
    world.dock("r1", "c1")
    assert charge(world, "r1") == pytest.approx((level - 40) / 1000)
    until(world, "finished")
    assert charge(world, "r1") == pytest.approx((level - 40) / 1000)
    assert charge(world, "c1") == pytest.approx((10_000 - 15 * 20) / 10_000)
    world.advance(world.now_ms + 10_000)  # it is full after 60 J
    assert charge(world, "r1") == pytest.approx(1)
    assert charge(world, "c1") == pytest.approx((10_000 - 25 * 20 - 60) / 10_000)


def test_robots_charge_where_they_stand_on_a_charging_place(begun) -> None:
    world = begun(carrier_at(1, 1), carrier_j=1000.0, charger=Cell(3, 1))
    world.drive("c1", tuple(Cell(x, 1) for x in range(1, 4)))
    until(world, "finished")
    assert charge(world, "c1") == pytest.approx(1 - 160 / 1000)
    world.advance(world.now_ms + 1000)
    assert charge(world, "c1") == pytest.approx(1 - 60 / 1000)
    world.advance(world.now_ms + 100_000)
    assert charge(world, "c1") == pytest.approx(1)


@pytest.mark.parametrize("drives", [False, True])
def test_a_robot_with_an_empty_battery_fails_in_time(begun, drives: bool) -> None:
    world = begun(rover_at(1, 1), carrier_at(7, 1), rover_j=60.0)
    if drives:
        world.drive("r1", tuple(Cell(x, 1) for x in range(1, 7)))
    news = until(world, "lost")
    assert news.lost == (("r1", "has an empty battery"),)
    # after 15 s standing; on its way at the next cell after 5 s
    assert news.t_ms == pytest.approx(6_000 if drives else 15_000, abs=110)
    news = until(world, "returned")  # without charge it fails again
    assert until(world, "lost").lost == (("r1", "has an empty battery"),)


def test_a_carrier_with_an_empty_battery_fails_with_its_rovers(begun) -> None:
    world = begun(carrier_at(1, 1), rover_on("c1"), carrier_j=100.0)
    news = until(world, "lost")
    assert news.lost == (("c1", "has an empty battery"), ("r1", "aboard c1, which has an empty battery"))
    assert news.t_ms == pytest.approx(5_000, abs=110)


def test_a_carrier_that_is_emptied_by_a_rover_aboard_fails_in_time(begun) -> None:
    world = begun(carrier_at(1, 1), rover_on("c1"), carrier_j=1440.0)
    world.undock("r1", "c1", Cell(2, 1))
    until(world, "finished")
    world.advance(55_000)
    world.dock("r1", "c1")
    assert until(world, "finished").t_ms == 65_000
    # 140 J are left, and the rover takes 50 W more
    assert until(world, "lost").t_ms == pytest.approx(67_000, abs=101)


def test_a_world_without_batteries_has_no_looks_at_them() -> None:
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds_of(), [carrier_at(1, 1)])
    world.advance(0)
    assert world.advance(LATER).t_ms == LATER

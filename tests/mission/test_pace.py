"""Speeds learned from drives that end late or early."""

from collections.abc import Sequence

import pytest
from support.missions.small_teams import carrier_at, drawn_grid, kinds_of

from marsupial.mission.belief.belief import Belief
from marsupial.mission.belief.pace import LEAST_SHARE
from marsupial.model import Cell, News
from marsupial.model.faults import Fault, FaultKind
from marsupial.sim.world import SimulatedWorld

HALL = ("#" * 32, "#" + "." * 30 + "#", "#" * 32)
LONG = tuple(Cell(x, 1) for x in range(1, 21))
SHORT = LONG[:5]


def slowed(share: float, at_ms: int = 0, *, reported: bool = False) -> Fault:
    return Fault(kind=FaultKind.SLOWS, robot="c1", share=share, at_ms=at_ms, reported=reported)


def paced(*faults: Fault) -> Belief:
    kinds = kinds_of()
    world = Belief(SimulatedWorld(drawn_grid(*HALL), kinds, [carrier_at(1, 1)], faults), kinds, (), lambda *_: None)
    world.advance(0)
    return world


def driven(world: Belief, *routes: Sequence[Cell]) -> list[tuple[str, float]]:
    """Drive routes to and fro; return the speeds learned, with those reported."""
    found: list[tuple[str, float]] = []
    for route in routes:
        for way in (route, route[::-1]):
            world.drive("c1", way)
            news = News(t_ms=0)
            while "c1" not in news.finished:
                news = world.advance(10**9)
                found += news.slowed
    return found


def test_three_late_drives_lower_the_speed_in_plans_to_what_they_show() -> None:
    world = paced(slowed(0.4))
    assert driven(world, LONG) == []
    assert world.robots()[0].speed == 1.0
    assert driven(world, LONG, LONG) == [("c1", 0.4)]
    assert world.robots()[0].speed == 0.4


@pytest.mark.parametrize("share", [1.0, 0.85, 1.6])
def test_drives_about_on_time_or_early_change_nothing(share: float) -> None:
    assert driven(paced(slowed(share)), LONG, LONG, LONG) == []


def test_short_drives_change_nothing() -> None:
    assert driven(paced(slowed(0.2)), *[SHORT] * 5) == []


def test_a_drive_on_time_between_late_ones_makes_them_begin_anew() -> None:
    world = paced(slowed(0.5), slowed(1.0, 70_000), slowed(0.5, 90_000))
    assert driven(world, LONG, LONG) == []  # 38 s each, then 19 s
    assert driven(world, LONG) == [("c1", 0.5)]


def test_early_drives_raise_the_speed_again_up_to_what_the_robot_says() -> None:
    world = paced(slowed(0.5), slowed(1.5, 120_000))
    assert driven(world, LONG, LONG) == [("c1", 0.5)]
    assert driven(world, LONG, LONG) == [("c1", 1.0)]
    assert driven(world, LONG, LONG) == []


def test_what_a_robot_says_replaces_what_was_learned() -> None:
    world = paced(slowed(0.5), slowed(0.8, 200_000, reported=True))
    assert driven(world, LONG, LONG, LONG) == [("c1", 0.5), ("c1", 0.8)]
    assert world.robots()[0].speed == 0.8


def test_no_robot_is_written_off() -> None:
    assert driven(paced(slowed(0.01)), LONG, LONG) == [("c1", LEAST_SHARE)]


def test_a_drive_that_was_stopped_counts_as_far_as_it_went() -> None:
    world = paced(slowed(0.4))
    assert driven(world, LONG) == []
    world.drive("c1", LONG)
    world.advance(world.now_ms + 30_000)
    world.stop("c1")
    news = world.advance(10**9)
    while not news.finished:
        news = world.advance(10**9)
    ((name, speed),) = news.slowed
    assert (name, speed) == ("c1", 0.4)

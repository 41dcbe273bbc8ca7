from __future__ import annotations

import numpy as np

from marsupial.cli.watch import Watch
from marsupial.model.grid import FLOOR, TERRAINS, Cell
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MissionStarted,
    PlacedRobot,
    Revealed,
    RobotLost,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import default_types
from marsupial.model.scenario import Goal


def watch() -> Watch:
    reachable = np.zeros((2, 4), dtype=np.bool_)
    reachable[1] = True
    seen = Watch(reachable)
    seen.event(
        MissionStarted(
            t_ms=0,
            scenario="strip",
            strategy="temporal",
            planner="greedy",
            seed=1,
            width=4,
            height=2,
            resolution_m=1.0,
            origin_m=(0.0, 0.0, 0.0),
            terrains=TERRAINS,
            types=default_types(1),
            robots=(
                PlacedRobot(name="carrier1", type="carrier", cell=Cell(0, 1)),
                PlacedRobot(name="rover1", type="rover", carrier="carrier1"),
            ),
            goal=Goal(),
        )
    )
    return seen


def dock(name: ActionName) -> Action:
    return Action(name=name, start_ms=0, duration_ms=5000, robot="rover1", carrier="carrier1", place="m")


def test_coverage_counts_reachable_cells_only() -> None:
    seen = watch()
    seen.event(Revealed(t_ms=0, robot="carrier1", runs=(2, 4, FLOOR)))
    assert seen.coverage == 0.5


def test_a_driving_robot_is_at_the_cell_it_passed_last() -> None:
    seen = watch()
    seen.event(DriveStarted(t_ms=1000, robot="carrier1", cell=Cell(0, 1), steps="00"))
    seen.t_ms = 2500
    assert seen.cell_of("carrier1") == Cell(1, 1)
    assert seen.cell_of("rover1") == Cell(1, 1)


def test_a_robot_that_was_stopped_stands_where_it_was_stopped() -> None:
    seen = watch()
    seen.event(DriveStarted(t_ms=0, robot="carrier1", cell=Cell(0, 1), steps="00"))
    seen.event(DriveEnded(t_ms=1000, robot="carrier1", cell=Cell(1, 1)))
    seen.t_ms = 9000
    assert seen.cell_of("carrier1") == Cell(1, 1)


def test_both_robots_say_what_they_do_in_a_docking() -> None:
    seen = watch()
    assert seen.doing("rover1") == "aboard carrier1"
    assert seen.aboard("carrier1") == ["rover1"]
    undock = dock(ActionName.UNDOCK)
    seen.event(ActionStarted(t_ms=0, revision=1, action=undock, cell=Cell(1, 1)))
    assert (seen.doing("rover1"), seen.doing("carrier1")) == ("leaving carrier1", "setting down rover1")
    seen.event(ActionEnded(t_ms=5000, revision=1, action=undock, end=ActionEnd.DONE))
    assert (seen.doing("rover1"), seen.doing("carrier1")) == ("waiting", "waiting")
    assert (seen.cell_of("rover1"), seen.aboard("carrier1")) == (Cell(1, 1), [])
    back = dock(ActionName.DOCK)
    seen.event(ActionStarted(t_ms=6000, revision=1, action=back, cell=Cell(1, 1)))
    assert (seen.doing("rover1"), seen.doing("carrier1")) == ("docking on carrier1", "picking up rover1")
    seen.event(ActionEnded(t_ms=9000, revision=1, action=back, end=ActionEnd.DONE))
    assert seen.doing("rover1") == "aboard carrier1"


def test_a_lost_robot_says_so() -> None:
    seen = watch()
    seen.event(RobotLost(t_ms=10, robot="carrier1", reason="failed"))
    assert seen.doing("carrier1") == "lost"

import numpy as np
from support.missions.small_teams import begun_on, drawn_grid

from marsupial.cli.display.picture import doing
from marsupial.cli.display.progress import MissionWatch
from marsupial.mission.state import RobotView
from marsupial.model import mission as m
from marsupial.model.grid import FLOOR, Cell
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import default_types


def watch() -> MissionWatch:
    reachable = np.zeros((2, 4), dtype=np.bool_)
    reachable[1] = True
    seen = MissionWatch()
    seen.reachable(reachable)
    robots = (
        m.PlacedRobot(name="carrier1", type="carrier", cell=Cell(0, 1)),
        m.PlacedRobot(name="rover1", type="rover", carrier="carrier1"),
    )
    seen.event(begun_on(drawn_grid("....", "...."), default_types(1), robots))
    return seen


def robot(seen: MissionWatch, name: str) -> RobotView:
    return next(view for view in seen.views() if view.name == name)


def place(seen: MissionWatch, name: str) -> tuple[float, float]:
    return robot(seen, name).x, robot(seen, name).y


def dock(name: ActionName) -> Action:
    return Action(name=name, start_ms=0, duration_ms=5000, robot="rover1", carrier="carrier1", place="m")


def test_coverage_counts_reachable_cells_only() -> None:
    seen = watch()
    seen.event(m.Revealed(t_ms=0, robot="carrier1", runs=(2, 4, FLOOR)))
    assert seen.coverage == 0.5


def test_a_driving_robot_is_at_the_cell_it_passed_last() -> None:
    seen = watch()
    seen.event(m.DriveStarted(t_ms=1000, robot="carrier1", cell=Cell(0, 1), steps="00"))
    seen.t_ms = 2500
    assert place(seen, "carrier1") == (1, 1)
    assert place(seen, "rover1") == (1, 1)


def test_a_robot_that_was_stopped_stands_where_it_was_stopped() -> None:
    seen = watch()
    seen.event(m.DriveStarted(t_ms=0, robot="carrier1", cell=Cell(0, 1), steps="00"))
    seen.event(m.DriveEnded(t_ms=1000, robot="carrier1", cell=Cell(1, 1)))
    seen.t_ms = 9000
    assert place(seen, "carrier1") == (1, 1)


def test_both_robots_of_a_docking_show_their_action() -> None:
    seen = watch()
    assert doing(robot(seen, "rover1")) == "aboard carrier1"
    assert robot(seen, "carrier1").cargo == ("rover1",)
    undock = dock(ActionName.UNDOCK)
    seen.event(m.ActionStarted(t_ms=0, revision=1, action=undock, cell=Cell(1, 1)))
    assert (doing(robot(seen, "rover1")), doing(robot(seen, "carrier1"))) == ("undock from carrier1", "undock rover1")
    seen.event(m.ActionEnded(t_ms=5000, revision=1, action=undock, end=m.ActionEnd.DONE))
    assert (doing(robot(seen, "rover1")), doing(robot(seen, "carrier1"))) == ("waits", "waits")
    assert (place(seen, "rover1"), robot(seen, "carrier1").cargo) == ((1, 1), ())
    back = dock(ActionName.DOCK)
    seen.event(m.ActionStarted(t_ms=6000, revision=1, action=back, cell=Cell(1, 1)))
    assert (doing(robot(seen, "rover1")), doing(robot(seen, "carrier1"))) == ("dock on carrier1", "dock rover1")
    seen.event(m.ActionEnded(t_ms=9000, revision=1, action=back, end=m.ActionEnd.DONE))
    assert doing(robot(seen, "rover1")) == "aboard carrier1"

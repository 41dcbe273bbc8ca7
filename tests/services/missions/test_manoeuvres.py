"""Headings, stops and turns of robots, derived from their reports."""

from mission_setup import Reports, brief

from marsupial.model.grid import Cell
from marsupial_service.missions.values import MissionReport
from marsupial_service.missions.world import RemoteWorld


class ReportedCarrier:
    """A carrier of the lobby whose drives and reports are scripted by a test."""

    def __init__(self) -> None:
        self.inbox = Reports()
        self.world = RemoteWorld(brief("lobby"), self.inbox)
        self.reports = self.drives = 0
        self.report(0)

    def report(self, t_ms: int, cell: Cell | None = None, *, finished: bool = False) -> None:
        self.reports += 1
        notes = [] if cell is None else [{"name": "carrier1", "cell": cell}]
        done = [self.drives] if finished else []
        self.inbox.coming.append(MissionReport(n=self.reports, t_ms=t_ms, robots=notes, finished=done))
        self.world.advance(t_ms)

    def drive(self, *cells: tuple[int, int]) -> None:
        self.drives += 1
        self.world.drive("carrier1", [Cell(*cell) for cell in cells])

    def heading(self) -> int | None:
        return next(robot.heading for robot in self.world.robots() if robot.name == "carrier1")

    def made(self) -> tuple[int, tuple[int, ...]]:
        made = self.world.manoeuvres("carrier1")
        return made.stops, made.turns


def test_turns_are_counted_along_the_route_up_to_where_the_robot_is() -> None:
    carrier = ReportedCarrier()
    assert carrier.heading() is None
    carrier.drive((5, 5), (6, 5), (7, 6), (7, 7), (6, 7))
    assert (carrier.heading(), carrier.made()) == (0, (0, (0, 0, 0, 0)))
    carrier.report(3000, Cell(7, 7))
    assert (carrier.heading(), carrier.made()) == (2, (2, (2, 0, 0, 0)))
    carrier.report(4000, Cell(6, 7), finished=True)
    assert (carrier.heading(), carrier.made()) == (4, (3, (2, 1, 0, 0)))


def test_going_on_at_once_is_no_stop_and_going_on_later_is_one() -> None:
    carrier = ReportedCarrier()
    carrier.drive((5, 5), (6, 5))
    carrier.report(1000, Cell(6, 5), finished=True)
    carrier.drive((6, 5), (7, 5))
    assert carrier.made() == (0, (0, 0, 0, 0))
    carrier.report(2000, Cell(7, 5), finished=True)
    carrier.report(5000)
    carrier.drive((7, 5), (8, 5))
    assert carrier.made() == (1, (0, 0, 0, 0))


def test_the_heading_of_a_robot_off_its_route_is_unknown() -> None:
    carrier = ReportedCarrier()
    carrier.drive((5, 5), (6, 5), (7, 5))
    carrier.report(1000, Cell(2, 9))
    assert (carrier.heading(), carrier.made()) == (None, (0, (0, 0, 0, 0)))

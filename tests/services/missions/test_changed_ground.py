"""Robots that meet changed ground have not failed; robots that fail on ground as known have."""

import pytest
from mission_setup import Reports, brief

from marsupial.model.grid import Cell
from marsupial.model.runs import Runs
from marsupial_service.missions.values import MissionReport
from marsupial_service.missions.world import RemoteWorld

WIDTH = brief("lobby").grid.width
FLOOR = tuple(number for y in range(2, 19) for number in (y * WIDTH + 2, 17, 1))  # cells 2 to 18 each way
MIDDLE = Cell(10, 10)


def block(*cells: tuple[int, int], code: int = 0) -> Runs:
    return tuple(number for x, y in sorted(cells, key=lambda c: (c[1], c[0])) for number in (y * WIDTH + x, 1, code))


class Carrier:
    """A carrier of the lobby in the middle of a floor, whose drives all fail."""

    def __init__(self) -> None:
        self.inbox = Reports()
        self.world = RemoteWorld(brief("lobby"), self.inbox)
        self.reports = self.drives = 0
        self.report(FLOOR)

    def report(self, runs: Runs = (), *, failed: bool = False) -> None:
        self.reports += 1
        self.inbox.coming.append(
            MissionReport(
                n=self.reports,
                t_ms=1000 * self.reports,
                revealed=[{"robot": "carrier1", "runs": runs}] if runs else [],
                robots=[{"name": "carrier1", "cell": MIDDLE}],
                failed=[{"id": self.drives, "reason": "no way"}] if failed else [],
            )
        )
        self.world.advance(1000 * self.reports)

    def fail(self, *steps: tuple[int, int], runs: Runs = (), before: Runs = ()) -> bool:
        """Let a drive fail together with changed cells, or after them; return whether the robot is lost."""
        self.drives += 1
        self.world.drive("carrier1", [MIDDLE, *(Cell(*cell) for cell in steps)])
        if before:
            self.report(before)
        self.report(runs, failed=True)
        return next(robot.lost for robot in self.world.robots() if robot.name == "carrier1")


EAST = [(11, 10), (12, 10), (13, 10), (14, 10)]
WEST = [(9, 10), (8, 10), (7, 10), (6, 10)]
NORTH_EAST = [(11, 11)]


@pytest.mark.parametrize("early", [False, True])
def test_a_robot_that_meets_changed_ground_has_not_failed(early: bool) -> None:
    carrier = Carrier()
    for steps, cell in [(EAST, (14, 10)), (WEST, (6, 10)), (EAST[:3], (13, 10)), (EAST[:2], (12, 10))]:
        runs = block(cell)
        assert not (carrier.fail(*steps, before=runs) if early else carrier.fail(*steps, runs=runs))


def test_a_corner_that_became_unknown_is_changed_ground() -> None:
    carrier = Carrier()
    for _ in range(3):  # its body touches the cell at the corner that its diagonal step passes only
        assert not carrier.fail(*NORTH_EAST, runs=block((12, 10), code=255))
        carrier.report(block((12, 10), code=1))


def test_changes_elsewhere_or_before_the_drive_excuse_no_robot() -> None:
    carrier = Carrier()
    assert not carrier.fail(*EAST, runs=block((14, 10)))
    assert not carrier.fail(*EAST)  # it was told to drive there all the same: the map was known
    assert not carrier.fail(*WEST, runs=block((10, 17)))
    assert carrier.fail(*WEST)

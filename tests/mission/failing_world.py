"""A simulated world in which commands fail."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from marsupial.model import Cell, Grid, News, PlacedRobot, RobotType
from marsupial.sim.world import SimulatedWorld


class FailingWorld(SimulatedWorld):
    """Every command for which `fails(number from 1, name)` is true ends without effect.

    Of a drive only the first step is made.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        fails: Callable[[int, str], bool],
    ) -> None:
        super().__init__(truth, kinds, robots)
        self._fails = fails
        self._commands = 0
        self._doomed: dict[str, Callable[[], None]] = {}

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        doomed = self._is_doomed("drive", (robot,), lambda: None)
        super().drive(robot, route[:2] if doomed else route)

    def dock(self, rover: str, carrier: str) -> None:
        cell = self._motion.team[rover].cell
        self._is_doomed("dock", (rover, carrier), lambda: self._put(rover, cell, None))
        super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._is_doomed("undock", (rover, carrier), lambda: self._put(rover, None, carrier))
        super().undock(rover, carrier, cell)

    def advance(self, until_ms: int) -> News:
        news = super().advance(until_ms)
        failed = tuple(name for name in news.finished if name in self._doomed)
        for name in failed:
            self._doomed.pop(name)()
        return replace(
            news,
            finished=tuple(name for name in news.finished if name not in failed),
            failed=tuple((name, "clumsy") for name in failed),
        )

    def _is_doomed(self, name: str, robots: tuple[str, ...], undo: Callable[[], None]) -> bool:
        self._commands += 1
        if self._fails(self._commands, name):
            self._doomed |= dict.fromkeys(robots, undo)
            return True
        return False

    def _put(self, robot: str, cell: Cell | None, carrier: str | None) -> None:
        mover = self._motion.team[robot]
        mover.cell, mover.carrier = cell, carrier

"""When to assign new frontiers: as soon as a robot has arrived, or its frontier has been seen by others."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from marsupial.arrays import Floats
from marsupial.maps.lookout import Lookout, setbacks_in
from marsupial.maps.survey import Survey
from marsupial.maps.targets import Target
from marsupial.model import Action, ActionName, Cell, FrameShift, News, PlanProgress, RobotReport
from marsupial.model.mission import Cause, MapMeeting, Trigger, Triggers


class OnArrival(Lookout):
    """Replans when a robot has arrived or failed, or when the frontier it drives to has already been seen."""

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        arrived = {action.robot for action in done if action.name is ActionName.EXPLORE}
        robots_by_cause = {Cause.ROBOT_FREE: sorted(arrived)}
        if news.revealed:
            robots_by_cause[Cause.GONE] = self._seen_through(self._aims(work))
        triggers = setbacks_in(news)
        triggers += tuple(Trigger(cause, tuple(names)) for cause, names in robots_by_cause.items() if names)
        if triggers or work.idle:
            return triggers or (Trigger(Cause.CARRIED_OUT),)
        if self._due:
            self._looked()
            if not self._surveyor.anything_left(self._world.robots()):
                return (Trigger(Cause.EXPLORED),)
        return ()

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        robots = self._world.robots()
        left = self._surveyor.anything_left(robots)
        if not late:
            self._note_explored(left=left)
        targets = self._targets([robot for robot in robots if not robot.lost]) if left else ()
        return self._surveyor.survey(robots, self._world.now_ms, keep, targets)

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        self._looked(fresh=since is not None)

    @abstractmethod
    def _aims(self, work: PlanProgress) -> Mapping[str, int]:
        """Return the frontier cell (row-major index) of each robot on its way to one, if it may give up that cell."""

    @abstractmethod
    def _targets(self, robots: Sequence[RobotReport]) -> tuple[Target, ...]:
        """Return the targets for the robots that are not lost, while something is left to explore."""

    def _seen_through(self, aims: Mapping[str, int]) -> list[str]:
        cells = np.array(list(aims.values()), dtype=np.int64)
        left = self._surveyor.finder.at_unknown(cells)
        return [name for name, still in zip(list(aims), left.tolist(), strict=True) if not still]


class WholeFrontiers(OnArrival):
    """Surveys with one target per frontier (group of touching cells), at the cell that a robot reaches first."""

    _cells: Mapping[str, Cell] = MappingProxyType({})

    def _move(self, shift: FrameShift) -> None:
        super()._move(shift)
        self._cells = shift.cells(self._cells)

    def _aims(self, work: PlanProgress) -> Mapping[str, int]:
        width = self._world.grid.width
        aims: dict[str, int] = {}
        for action in work.remainder():
            cell = self._cells.get(action.place)
            if action.name is ActionName.EXPLORE and cell is not None:
                aims.setdefault(action.robot, cell.y * width + cell.x)
        return aims

    def _targets(self, robots: Sequence[RobotReport]) -> tuple[Target, ...]:
        """Return the targets; a robot is not sent to its own cell."""
        now_ms, robots = self._world.now_ms, self._surveyor.outside(robots)
        frontiers = self._surveyor.frontiers(self._world.robots())
        soonest_s: dict[str, Floats] = {}
        for name, frontier in frontiers.items():
            soonest_s[name] = np.full(len(frontier.cells), np.inf)
            for robot in robots:
                if robot.type != name or robot.cell is None:
                    continue
                ways = self._surveyor.lengths(name, robot.cell, frontier.viewpoints, robot.heading)
                if robot.free_at_ms <= now_ms:  # another visit to its own cell reveals nothing
                    ways[ways == 0] = np.inf
                np.minimum(soonest_s[name], ways / self._kinds[name].speed_mps, out=soonest_s[name])
        targets = self._surveyor.finder.find_whole(frontiers, soonest_s)
        self._cells = {target.name: target.cell for target in targets}
        return targets

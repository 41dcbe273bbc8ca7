"""A map state: what a planner is to be asked about, before it is analysed. It is sent to the worker that does that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell, Grid
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.situation import Situation, SituationGoal
from marsupial.model.world import RobotReport


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapState:
    """The known map, the robots on it, and what is asked.

    Parameters
    ----------
    robots
        Where they are free next, with the time until then.
    homes
        Where each carrier has to end if the goal asks for it.
    meetings
        Meeting points in use.
    """

    grid: Grid
    kinds: tuple[RobotType, ...]
    robots: tuple[RobotReport, ...]
    homes: Mapping[str, Cell]
    meetings: tuple[MapMeeting, ...]
    goal: SituationGoal
    _surveyed: list[Survey] = field(default_factory=list, init=False, repr=False)

    def survey(self) -> Survey:
        """Return the situation, and what its places are on the map; the map is analysed once."""
        if not self._surveyed:
            goal = Goal(recover_rovers=self.goal.recover_rovers, return_home=self.goal.return_home)
            surveyor = Surveyor(Territory(self.grid, self.kinds), self.homes, goal)
            survey = surveyor.survey(self.robots, 0, self.meetings)
            # a mission asks for exploring alone while targets are left; here the goal is what was sent
            self._surveyed.append(replace(survey, situation=replace(survey.situation, goal=self.goal)))
        return self._surveyed[0]

    def situation(self) -> Situation:
        """Return what the planner is asked."""
        return self.survey().situation

    def places(self) -> Mapping[str, object]:
        """Return every place with its cell, and the centre of that in metres, for each robot type that can use it."""
        return {
            name: {
                kind: {"cell": [cell.x, cell.y], "point_m": list(self.grid.centre_m(cell))}
                for kind, cell in sorted(poses.items())
            }
            for name, poses in self.survey().poses.items()
        }

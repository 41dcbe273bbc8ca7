"""The clairvoyant's plan during the search: where to stop, and which robot does what in which order.

A stop is a target of the planning problem: a place to look from, with a site for each robot type that can see the
stop's cells. An `Outline` is the stops, the `Situation` that they make, and a plan for it without times: the order of
the robots' explorations and dockings, called errands. A `Tour` is what one robot drives between dockings.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from marsupial.arrays import Floats
from marsupial.maps.survey import Survey, planning_type
from marsupial.maps.targets import Target
from marsupial.maps.travel import Poses, travel_times
from marsupial.model import Action, ActionName, Cell, MapMeeting, PlacedRobot, Plan, RobotType, Unseen
from marsupial.model.situation import RobotState, Situation, TargetInfo, TravelTable
from marsupial.paths.routes import passing_times_ms
from marsupial.planning.schedule.timeline import replay
from marsupial.strategies.clairvoyant.ground import CellSet, Ground


@dataclass(slots=True)
class Tour:
    """What a robot drives between being set down and being picked up; it can be changed."""

    robot: str
    kind: str
    # names, cells: the places from the first to the last, and the robot's cells there
    names: list[str]
    cells: list[Cell]
    after: list[Action | None]  # the last errand at each place; None where the tour begins or ends
    seen: list[CellSet]  # what is seen at the first place, and then on each leg

    def ends_aboard(self) -> bool:
        """Return whether the robot is picked up at the last place."""
        return len(self.names) > 1 and self.after[-1] is None


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Stops, meeting points, and the errands of the robots: a plan's actions without moves, in plan order."""

    ground: Ground
    stops: tuple[Target, ...]  # without frontier cells; their viewpoints are sites
    meetings: tuple[MapMeeting, ...]
    errands: tuple[Action, ...] = ()

    @cached_property
    def poses(self) -> Poses:
        """Cells of each place, by robot type."""
        poses: dict[str, Mapping[str, Cell]] = {
            f"s_{robot.name}": {robot.type: robot.cell} for robot in self.ground.robots if robot.cell is not None
        }
        poses |= {stop.name: stop.viewpoints for stop in self.stops}
        poses |= {
            point.name: {point.carrier_type: point.carrier_cell, point.rover_type: point.rover_cell}
            for point in self.meetings
        }
        return poses

    @cached_property
    def situation(self) -> Situation:
        """The planning problem: explore every stop."""
        kinds = self.ground.territory.kinds
        robots = tuple(
            RobotState(
                name=robot.name,
                type=robot.type,
                place=None if robot.cell is None else f"s_{robot.name}",
                carrier=robot.carrier,
            )
            for robot in self.ground.robots
        )
        return Situation(
            types=tuple(planning_type(kind) for kind in kinds.values()),
            robots=robots,
            targets=tuple(TargetInfo(name=stop.name, explorers=frozenset(stop.viewpoints)) for stop in self.stops),
            meetings=tuple(point.name for point in self.meetings),
            travel_ms={name: self._table(kind) for name, kind in kinds.items()},
        )

    @property
    def survey(self) -> Survey:
        """The situation and its places on the map."""
        return Survey(
            situation=self.situation,
            targets=self.stops,
            meetings=self.meetings,
            connects={},
            poses=self.poses,
            direct_ms=dict,
            unseen=Unseen,
        )

    @cached_property
    def plan(self) -> Plan:
        """The errands with the drives between them, each as early as possible."""
        return replay(self.situation, Plan(actions=self.errands)).plan

    def tours(self) -> list[Tour]:
        """Return the tours of all robots."""
        return [tour for robot in self.ground.robots for tour in self._tours_of(robot)]

    @cached_property
    def missed(self) -> CellSet:
        """The wanted cells that no robot sees."""
        return missed_by(self.ground, self.tours())

    @cached_property
    def complete_ms(self) -> int:
        """When the last cell is seen; cells that are never seen do not count."""
        ground, looks = self.ground, self._looks()
        left = ground.wanted & ~self.missed
        last_ms = 0
        for t_ms, kind, cell in sorted(looks):
            if not left:
                break
            before = left
            left &= ~ground.view(kind, cell)
            if left != before:
                last_ms = t_ms
        return last_ms

    def with_plan(self, plan: Plan) -> Outline:
        """Return the outline with the errands of `plan`."""
        return replace(self, errands=tuple(a for a in plan.actions if a.name is not ActionName.MOVE))

    def without(self, names: Iterable[str]) -> Outline:
        """Return the outline without some stops."""
        gone = frozenset(names)
        return replace(
            self,
            stops=tuple(stop for stop in self.stops if stop.name not in gone),
            errands=tuple(a for a in self.errands if a.place not in gone),
        )

    def _tours_of(self, robot: PlacedRobot) -> Iterator[Tour]:
        visits: list[tuple[str, Action | None]] = [] if robot.cell is None else [(f"s_{robot.name}", None)]
        for errand in self.errands:
            if robot.name not in errand.robots:
                continue
            # several dockings of a carrier at one place are one visit
            if robot.name == errand.carrier and visits[-1][0] == errand.place:
                visits[-1] = (errand.place, errand)
            elif errand.name is ActionName.UNDOCK and robot.name == errand.robot:
                visits = [(errand.place, errand)]
            elif errand.name is ActionName.DOCK and robot.name == errand.robot:
                yield self._tour(robot, [*visits, (errand.place, None)])
                visits = []
            else:
                visits.append((errand.place, errand))
        if visits:
            yield self._tour(robot, visits)

    def _tour(self, robot: PlacedRobot, visits: Sequence[tuple[str, Action | None]]) -> Tour:
        names = [name for name, _ in visits]
        cells = [self.poses[name][robot.type] for name in names]
        seen = [
            self.ground.view(robot.type, cells[0]),
            *(self.ground.leg(robot.type, a, b) for a, b in pairwise(cells)),
        ]
        return Tour(robot.name, robot.type, names, cells, [errand for _, errand in visits], seen)

    def _looks(self) -> list[tuple[int, str, Cell]]:
        """Return (time, robot type, cell) for each cell that a robot passes."""
        ground, poses = self.ground, self.poses
        types = {robot.name: robot.type for robot in ground.robots}
        looks: list[tuple[int, str, Cell]] = []
        for action in self.plan.actions:
            kind = types[action.robot]
            if action.origin is not None:
                route = ground.route(kind, poses[action.origin][kind], poses[action.place][kind])
                robot = ground.kinds[kind]
                times = passing_times_ms(route, ground.territory.grid.resolution_m, robot.speed_mps, robot.diagonal)
                looks += [(action.start_ms + t, kind, c) for t, c in zip(times.tolist(), route, strict=True)]
            elif action.name is ActionName.UNDOCK:
                looks.append((action.end_ms, kind, poses[action.place][kind]))
        return looks

    def _table(self, kind: RobotType) -> TravelTable:
        ground = self.ground

        def lengths(cells: Sequence[Cell], _headings: Sequence[int | None]) -> Floats:
            found = np.full((len(cells), len(cells)), np.inf)
            if kind.name in ground.kinds:
                for row, cell in zip(found, cells, strict=True):
                    row[:] = ground.apart(kind.name, cell, cells)
            return found

        return travel_times([kind], self.poses, lengths, ground.territory.grid.resolution_m)[kind.name]


def missed_by(ground: Ground, tours: Iterable[Tour]) -> CellSet:
    """Return the wanted cells that are not seen on any of these tours."""
    missed = ground.wanted
    for tour in tours:
        for seen in tour.seen:
            missed &= ~seen
    return missed

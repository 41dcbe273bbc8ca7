"""From the known map and the robots to a planning problem, the `Situation`.

Theory of operation
-------------------
Each stage derives its result from the one before. Stages down to the frontiers process only what is new since the last
call, so their cost depends on the newly revealed cells, not on the size of the map:

    cells revealed ----> Territory         what each type may stand on (Footprint), what one can see through
                           | feeds: revealed, cleared, opened
                           v
    robots' poses -----> GrowingReach      what each type can get to; where pairs of types can dock
                           | Reach
                           v
                         TargetFinder.frontiers    cells at the unknown, each with a viewpoint, per type
                           | Frontier
                           v
                         TargetFinder.find         frontier cells in clusters, one target each
                           | Target                (only when targets are asked for, once per look)
                           v
    points in use -----> find_meetings     where carriers set rovers down and pick them up
                           |
                           v
                         Survey            poses of all places, and the Situation: travel times between them (travel.py)

Updates rely on one property: known cells never change, the map only grows. So an area only grows, from opened cells
(except that when a rover goes aboard, the part that only it could reach is removed), a known cell never becomes a
frontier cell again, and a distance only falls. A `Feed` passes new cells to any number of readers, each of which reads
them when needed. Exceptions cause a restart: a lost robot resets `GrowingReach`, and a map whose known cells changed,
or whose frame grew, gets a new `Surveyor` (lookout.py). If no frontier is left, `Landings` adds places from which a
robot may see ground to set rovers down on; if there is none either, everything is explored.

`_look` runs the stages down to the frontiers, unless neither map nor robots changed since. That answers "is anything
left to explore?", the question asked most. Targets, meeting points and travel times are recomputed for each planning
call, with two caches: fields of view (views.py) and distances between places (`marsupial.paths.distances`) are
recomputed only if revealed cells may have changed them.

Robots in no-go zones count as where they leave them (`marsupial.maps.exits`).

A place is a name (`t_...` target, `m_...` meeting point, `s_...` a robot's position, `h_...` a carrier's home,
`charge_...` a charging place) with a cell per robot type that can use it. A planner sees names and travel times only;
`Survey` stores what the names mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.maps.contact import unclaimed, unseen_with_waiting, with_waiting
from marsupial.maps.exits import Exits
from marsupial.maps.growth import GrowingReach, reach_of
from marsupial.maps.landings import Landings, Looks
from marsupial.maps.meetings import Meetings, find_meetings
from marsupial.maps.speeds import planning_battery, speeds_of, unseen_with_speeds, with_speeds
from marsupial.maps.targets import Frontier, Target, TargetFinder
from marsupial.maps.territory import Territory, dock_range_cells, within_range
from marsupial.maps.travel import AllGround, Poses, travel_times, ways_by_type
from marsupial.maps.unseen import UnseenPart
from marsupial.model import (
    UNREACHABLE,
    Battery,
    Cell,
    FrameShift,
    Goal,
    RobotReport,
    RobotType,
    Role,
    TravelTable,
    Unseen,
)
from marsupial.model.mission import MapMeeting, PlacedRobot, Remaining
from marsupial.model.situation import PlanningType, RobotState, Situation, SituationGoal, TargetInfo
from marsupial.paths.fields import SearchMemory
from marsupial.paths.routes import heading_of, travel_table_ms


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """A situation and its meaning on the map."""

    situation: Situation
    targets: tuple[Target, ...]
    meetings: tuple[MapMeeting, ...]
    connects: Mapping[str, frozenset[str]]
    poses: Poses  # the cell each robot type goes to at each place
    # direct_ms, unseen: see `marsupial.model.strategy.Briefing`
    direct_ms: Callable[[], Mapping[str, Mapping[str, int]]]
    unseen: Callable[[], Unseen]

    def moved(self, shift: FrameShift) -> Survey:
        """Return the survey with the targets, meetings and poses re-indexed for a larger frame."""
        return replace(
            self,
            targets=tuple(target.moved(shift) for target in self.targets),
            meetings=tuple(map(shift.meeting, self.meetings)),
            poses={name: shift.cells(cells) for name, cells in self.poses.items()},
        )


class Surveyor:
    """Surveys one growing map, whose territory the mission updates.

    `homes` has the home cell of each carrier by name, `goal` the mission's goal once no target is left, and `looks` the
    looks of robots so far.
    """

    def __init__(self, territory: Territory, homes: Mapping[str, Cell], goal: Goal, looks: Looks | None = None) -> None:
        self.territory = territory
        self._looks = Looks() if looks is None else looks
        self._exits = Exits(territory, homes if goal.return_home else {})
        self._homes = homes
        self._goal = goal
        self.finder = self._new_finder()
        self._looked_at: object = None
        self._growing = GrowingReach(territory)
        self._reach = self._growing.reach(())
        self._frontiers: Mapping[str, Frontier] = {}
        self._targets: tuple[Mapping[str, Frontier], tuple[Target, ...]] | None = None
        self._memory = SearchMemory(territory.see_through.shape)
        self._ways = ways_by_type(territory, self._memory)
        self._ranges = {
            kind.name: kind.sensor_range_m / territory.grid.resolution_m for kind in territory.kinds.values()
        }

    @cached_property
    def _all_ground(self) -> AllGround:
        return AllGround(self.territory, self._memory)

    @cached_property
    def _landings(self) -> Landings:
        return Landings(self.territory, self._looks, self._goal.least_ground)

    @cached_property
    def _unseen(self) -> UnseenPart:
        return UnseenPart(self.territory)

    def _new_finder(self) -> TargetFinder:
        return TargetFinder(self.territory, self._goal.least_ground)

    def outside(self, robots: Sequence[RobotReport]) -> tuple[RobotReport, ...]:
        """Return the reports of robots once they have left the no-go zones that they stand in."""
        zoned = self.territory.grid.zoning is not None
        return tuple(map(self._exits.outside, robots)) if zoned else tuple(robots)

    def targets(self, robots: Sequence[RobotReport]) -> tuple[Target, ...]:
        frontiers = self.frontiers(robots)
        if self._targets is None or self._targets[0] is not frontiers:
            self._targets = frontiers, self.finder.find(frontiers)
        return unclaimed(self._targets[1], robots, self._ranges)

    def anything_left(self, robots: Sequence[RobotReport]) -> bool:
        """Return whether there is a target, also of rovers out of contact; cheaper than finding them all."""
        return any(len(frontier.cells) for frontier in self.frontiers(robots).values())

    def remaining(
        self, targets: Sequence[Target], reason: str, robots: Sequence[RobotReport] = ()
    ) -> tuple[Remaining, ...]:
        """Return the frontiers left at the last survey: `targets` with `reason`, others with why not.

        Of the latter those that only robots that are lost among `robots` could explore come first.
        """
        reasons = [(target, reason) for target in targets]
        reasons += [(one, f"only {', '.join(names)} could explore it") for one, names in self.left_to_lost(robots)]
        left = (Remaining(cell=t.cell, frontier_cells=len(t.cells), reason=why) for t, why in reasons)
        return (*left, *self.finder.refused([target for target, _ in reasons], self._reach))

    def left_to_lost(self, robots: Sequence[RobotReport]) -> list[tuple[Target, list[str]]]:
        """Return the targets that only lost robots could explore if they could act, with the names of these."""
        lost = [robot for robot in robots if robot.lost]
        if not lost:
            return []
        territory, finder = self.territory, self._new_finder()
        able = self._new_finder().frontiers(reach_of(territory, placed(self.outside(robots))))
        explorable = np.concatenate([frontier.cells for frontier in able.values()])
        team = [replace(robot, lost=False) for robot in robots]
        targets = finder.find(finder.frontiers(reach_of(territory, placed(self.outside(team)))))
        left = [target for target in targets if not np.isin(target.cells, explorable).any()]
        # a lost carrier may be missing only because it brings those that could
        return [(one, [r.name for r in lost if r.type in one.viewpoints] or [r.name for r in lost]) for one in left]

    def route(self, kind: str, start: Cell, goal: Cell, heading: int | None = None) -> tuple[Cell, ...] | None:
        """Return the route of a robot type over the known map, from an initial heading."""
        way = self._exits.way(kind, start, goal)
        if way is None:
            return self._ways[kind].route(start, goal, heading)
        rest = self._ways[kind].route(way[-1], goal, heading_of(way[-2], way[-1]))
        return None if rest is None else way[:-1] + rest

    def frontiers(self, robots: Sequence[RobotReport]) -> Mapping[str, Frontier]:
        """Return what each robot type can explore, by name."""
        where = placed(self.outside(robots))
        self._look(where)
        if any(len(frontier.cells) for frontier in self._frontiers.values()):
            return self._frontiers
        rovers = {robot.type for robot in where if self.territory.kinds[robot.type].role is Role.ROVER}
        return self._landings.frontiers(self._reach.by_type, rovers)

    def lengths(self, kind: str, start: Cell, cells: Ints, heading: int | None = None) -> Floats:
        """Return the lengths (n,) in cells of a robot type's routes to n cells (row-major), inf without a route."""
        width = self.territory.grid.width
        return self._ways[kind].lengths(start, np.stack([cells % width, cells // width], axis=1), heading)

    def survey(
        self,
        robots: Sequence[RobotReport],
        now_ms: int,
        keep: Iterable[MapMeeting] = (),
        targets: Sequence[Target] | None = None,
        *,
        returning: bool = False,
        docking: bool = True,
    ) -> Survey:
        """Return the survey of the robots that are not lost.

        `keep` are meeting points in use, and `targets` replace all present ones. With `returning`, the situation has
        the mission's final goal even if targets are left; without `docking`, it has no meeting points.
        """
        active = self.outside([robot for robot in robots if not robot.lost])
        where = placed(active)
        self._look(where)
        reach, targets = self._reach, self.targets(active) if targets is None else tuple(targets)
        meetings = (
            find_meetings(self.territory, reach, targets, where, keep) if docking else Meetings(points=(), connects={})
        )
        states = tuple(self._state(robot, now_ms) for robot in active)
        chargers = self._chargers()
        poses = {**self._poses(active, states, targets, meetings), **chargers}
        headings = {f"s_{robot.name}": robot.heading for robot in active}
        goal = SituationGoal()
        if returning or not self.anything_left(active):
            goal = SituationGoal(recover_rovers=self._goal.aboard, return_home=self._goal.return_home)
        situation = Situation(
            types=tuple(planning_type(kind) for kind in self.territory.kinds.values()),
            robots=states,
            targets=tuple(
                TargetInfo(name=t.name, explorers=frozenset(t.viewpoints), reveal_m2=t.reveal_m2, priority=t.priority)
                for t in targets
            ),
            meetings=tuple(point.name for point in meetings.points),
            homes=tuple(state.home for state in states if state.home is not None),
            chargers=tuple(chargers),
            travel_ms=self._travel_ms(poses, headings),
            goal=goal,
        )
        kinds = self.territory.kinds
        speeds = speeds_of(active, kinds)
        paced = with_speeds(situation, active, speeds, kinds)
        planned, waiting = with_waiting(paced, active, meetings.points, kinds, self.territory.grid.resolution_m)
        return Survey(
            situation=planned,
            targets=targets,
            meetings=meetings.points,
            connects=meetings.connects,
            poses=poses,
            direct_ms=lambda: self._direct(situation, poses, {robot.name: robot.speed for robot in active}),
            unseen=lambda: unseen_with_waiting(unseen_with_speeds(self._unseen.now(targets, reach), speeds), waiting),
        )

    def _look(self, robots: tuple[PlacedRobot, ...]) -> None:
        """Find reach and frontiers, unless they are up to date for this map and these robots."""
        now = (self.territory.revision, robots)
        if now != self._looked_at:
            self._looked_at = now
            self._reach = self._growing.reach(robots)
            self._frontiers = self.finder.frontiers(self._reach)

    def _state(self, robot: RobotReport, now_ms: int) -> RobotState:
        carrier = self.territory.kinds[robot.type].role is Role.CARRIER
        home = carrier and self._goal.return_home and robot.name in self._homes
        return RobotState(
            name=robot.name,
            type=robot.type,
            place=None if robot.cell is None else f"s_{robot.name}",
            carrier=robot.carrier,
            free_at_ms=0 if robot.cell is None else max(0, robot.free_at_ms - now_ms),
            home=f"h_{robot.name}" if home else None,
            charge_j=_charge_j(robot, self.territory.kinds[robot.type].battery, now_ms),
        )

    def _poses(
        self, robots: Sequence[RobotReport], states: Sequence[RobotState], targets: Sequence[Target], meetings: Meetings
    ) -> Poses:
        poses: dict[str, Mapping[str, Cell]] = {}  # in the order of `Situation.places`
        for robot, state in zip(robots, states, strict=True):
            if state.place is not None and robot.cell is not None:
                poses[state.place] = {robot.type: robot.cell}
        poses |= {target.name: target.viewpoints for target in targets}
        for point in meetings.points:
            poses[point.name] = self._meeting_poses(point)
        for state in states:
            if state.home is not None:
                poses[state.home] = {state.type: self._homes[state.name]}
        return poses

    def _chargers(self) -> Poses:
        """Return the charging places that a robot type with a battery can reach, with the cells of these types."""
        reach = {name: self._reach.by_type[name] for name, kind in self.territory.kinds.items() if kind.battery}
        grid = self.territory.grid
        cells = grid.chargers if reach else ()
        places = {cell: {kind: cell for kind in reach if reach[kind][cell.y, cell.x]} for cell in cells}
        return {grid.name_of("charge", cell): poses for cell, poses in places.items() if poses}

    def _meeting_poses(self, point: MapMeeting) -> Mapping[str, Cell]:
        """Return the poses at a meeting point of all types that can use it, not only of its own two types."""
        poses: dict[str, Cell] = {}
        for kind in self.territory.kinds.values():
            cell = point.carrier_cell if kind.role is Role.CARRIER else point.rover_cell
            if self._reach.by_type[kind.name][cell.y, cell.x] and self._close_enough(kind, point):
                poses[kind.name] = cell
        return poses

    def _close_enough(self, kind: RobotType, point: MapMeeting) -> bool:
        """Return whether robots of a type can dock with all types of the other role at a meeting point."""
        if kind.name in (point.carrier_type, point.rover_type):
            return True
        others = (other for other in self.territory.kinds.values() if other.role is not kind.role)
        # the docking range is symmetric, so the order of carrier and rover does not matter
        limit = min(dock_range_cells(kind, other, self.territory.grid.resolution_m) for other in others)
        return within_range(point.carrier_cell, point.rover_cell, limit, self.territory.see_through)

    def _travel_ms(self, poses: Poses, headings: Mapping[str, int | None]) -> Mapping[str, TravelTable]:
        """Return each robot type's travel times between places; types with the same routes share a search."""
        metres = self.territory.grid.resolution_m
        tables: dict[str, TravelTable] = {}
        for ways in dict.fromkeys(self._ways.values()):
            kinds = [self.territory.kinds[name] for name, its in self._ways.items() if its is ways]
            tables |= travel_times(kinds, poses, ways.matrix, metres, headings)
        return tables

    def _direct(
        self, situation: Situation, poses: Poses, speeds: Mapping[str, float]
    ) -> Mapping[str, Mapping[str, int]]:
        """Return the carriers' travel times to all targets as if they could drive wherever some type can."""
        search = self._all_ground.search()
        cells = [next(iter(poses[target.name].values())) for target in situation.targets]
        direct: dict[str, Mapping[str, int]] = {}
        for carrier in situation.of_role(Role.CARRIER):
            if carrier.place is None:
                continue
            kind = self.territory.kinds[carrier.type]
            lengths = search.lengths(poses[carrier.place][carrier.type], cells)
            speed_mps = kind.speed_mps * speeds[carrier.name]
            times = travel_table_ms(lengths, self.territory.grid.resolution_m, speed_mps)
            direct[carrier.name] = {
                target.name: int(time)
                for target, time in zip(situation.targets, times, strict=True)
                if time != UNREACHABLE
            }
        return direct


def _charge_j(robot: RobotReport, battery: Battery | None, now_ms: int) -> float | None:
    """Return the charge of a robot as a situation has it: at the time when it is free there."""
    if battery is None or robot.charge is None:
        return None
    charge_j = min(1.0, robot.charge) * battery.capacity_j
    # a rover that docks counts as aboard, and so as charging, from now on: it must not gain by that
    ahead_s = max(0, robot.free_at_ms - now_ms) / 1000 if robot.cell is None else 0.0
    return max(0.0, charge_j - battery.charge_w * ahead_s)


def placed(robots: Iterable[RobotReport]) -> tuple[PlacedRobot, ...]:
    """Return the positions of the robots that are not lost."""
    return tuple(PlacedRobot(name=r.name, type=r.type, cell=r.cell, carrier=r.carrier) for r in robots if not r.lost)


def planning_type(kind: RobotType) -> PlanningType:
    """Return the properties of a robot type that planning uses."""
    return PlanningType(
        name=kind.name,
        role=kind.role,
        capacity=kind.capacity,
        dock_ms=kind.dock_ms,
        undock_ms=kind.undock_ms,
        battery=planning_battery(kind),
        seats=kind.seats,
    )

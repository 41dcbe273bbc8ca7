"""Executes plans: starts each action as soon as all robots that it needs are free.

Every robot has a queue of its actions in plan order. An action starts when it is at the head of the queues of all its
robots and none of them is busy. So a valid plan can't deadlock, and early robots wait. A new plan replaces the queues:
drives to the same place continue, other drives stop at the next cell, and docking is never interrupted.

The executor is on board: it learns at once what happens to rovers out of contact. Such a rover follows the plan that it
was told last, up to its first docking, and waits there; if it was not to dock any more, it drives back to where it was
set down. One that gets single commands ends its drive, and waits there or drives back.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import takewhile
from typing import NamedTuple, Self

from marsupial.maps.travel import Poses
from marsupial.mission.observer import Observer
from marsupial.model import Action, ActionName, Cell, Deployments, FrameShift, Plan, RobotReport, World
from marsupial.model.mission import ActionEnd, ActionEnded, ActionStarted, DriveEnded, DriveStarted
from marsupial.paths.routes import passed_cells, steps_of
from marsupial.planning.schedule.charges import ChargedFirst

Router = Callable[[str, Cell, Cell, int | None], Sequence[Cell] | None]
"""Finds the route of a robot type between two cells of the known map; the last argument is its heading."""

Reports = Callable[[], tuple[RobotReport, ...]]

Standing = Callable[[str, Sequence[Cell]], bool]
"""Returns whether a robot type can stand on all of these cells of the known map."""


class _Orders(NamedTuple):
    """A plan as robots follow it: its number, the cells of its places, and the actions before which robots charge."""

    revision: int
    poses: Poses
    charged: ChargedFirst

    def moved(self, shift: FrameShift) -> Self:
        return self._replace(poses={name: shift.cells(cells) for name, cells in self.poses.items()})


class Executor:
    """Executes one plan after the other in a world; `on_board` returns the robots as they know themselves."""

    def __init__(self, world: World, on_board: Reports, route: Router, observer: Observer) -> None:
        self._world, self._on_board = world, on_board
        self._route = route
        self._observer = observer
        self._types = {robot.name: robot.type for robot in on_board()}
        self._queues: dict[str, deque[Action]] = {name: deque() for name in self._types}
        self._running: dict[str, tuple[int, Action]] = {}  # by robot: revision of the plan, action
        self._goals: dict[str, Cell] = {}  # of the drives that run or ran last
        self._routes: dict[str, Sequence[Cell]] = {}
        self._ends: dict[str, ActionEnd] = {}  # how running actions will end that are not carried out to the end
        self._orders = _Orders(0, {}, {})
        self._told: dict[str, _Orders] = {}  # what rovers out of contact were told last
        self._changed = True  # whether an action may have become startable
        self.ready_ms: int | None = None  # when robots that now can't act yet can start their next action
        self.busy_ms = 0  # when the current plan ends
        self.deployments = Deployments()

    @property
    def idle(self) -> bool:
        return not self._running and not any(self._queues.values())

    @property
    def deployed_at(self) -> Mapping[str, str]:
        return self.deployments.at

    @property
    def revision(self) -> int:
        """The number of the current plan, 0 before the first."""
        return self._orders.revision

    @property
    def running(self) -> bool:
        """Whether an action runs."""
        return bool(self._running)

    @property
    def acts(self) -> bool:
        """Whether an action of a robot in contact runs."""
        return not self._running.keys() <= self._told.keys()

    @property
    def under_way(self) -> frozenset[str]:
        """Robots that have not arrived: rovers that are docking, and robots that are driving."""
        running = (action for _, action in self._running.values())
        return frozenset(action.robot for action in running if action.name is not ActionName.UNDOCK)

    def unemployed(self, robots: Iterable[str]) -> bool:
        return any(name not in self._running and not self._queues[name] for name in robots)

    def remainder(self) -> tuple[Action, ...]:
        running = [a for name, (_, a) in self._running.items() if name not in self._ends and name not in self._told]
        waiting = [action for name, queue in self._queues.items() if name not in self._told for action in queue]
        unique = {id(action): action for action in running + waiting}  # a docking is in two queues
        return Plan.of(unique.values()).actions

    def move(self, shift: FrameShift) -> None:
        """Re-index cells after the frame grew."""
        self._goals = shift.cells(self._goals)
        self._routes = {name: [shift.cell(cell) for cell in route] for name, route in self._routes.items()}
        self._orders = self._orders.moved(shift)
        self._told = {name: orders.moved(shift) for name, orders in self._told.items()}

    def stop_blocked(self, standing: Standing, without_zones: Standing) -> tuple[str, ...]:
        """Stop drives over cells where their robots can no longer stand; return the robots blocked now or later.

        Superseded drives stop anyway, and rovers out of contact can't be. A robot that stands on such a cell may drive
        away from it, and one in a no-go zone out of the zone: `without_zones` says where robots could stand if there
        were none.
        """
        blocked = dict.fromkeys(self._blocked_drives(standing, without_zones))
        for name in blocked:
            self._ends[name] = ActionEnd.BLOCKED
            self._queues[name].clear()
            self._world.stop(name)
        # actions that have not started would fail later: report their robots as well
        for name, queue in self._queues.items():
            cells = [self._orders.poses.get(action.place, {}).get(self._types[name]) for action in queue]
            if name not in self._told and not standing(self._types[name], [cell for cell in cells if cell is not None]):
                blocked[name] = None
        return tuple(blocked)

    def _blocked_drives(self, standing: Standing, without_zones: Standing) -> Iterator[str]:
        """Yield the robots whose route leads over a cell, or past a corner, where they can't stand."""
        at = {robot.name: robot.cell for robot in self._on_board()}
        for name, (_, action) in self._running.items():
            if action.carrier is not None or name in self._ends or name in self._told:
                continue
            route, here = self._routes[name], at[name]
            ahead = route[route.index(here) :] if here in route else route
            kind, cells = self._types[name], [ahead[0], *passed_cells(ahead)]
            leaving = _leading(cells, kind, standing, without_zones)
            if not standing(kind, cells[max(1, leaving) :]):
                yield name

    def adopt(self, plan: Plan, poses: Poses, revision: int, charged: ChargedFirst) -> None:
        """Follow `plan` (absolute times) from now on; `poses` are the cells of its places.

        Actions in `charged` wait until their robots have these charges.
        """
        self._orders, self._changed, self.busy_ms = _Orders(revision, poses, charged), True, plan.makespan_ms
        self._queues |= {name: deque(plan.of_robot(name)) for name in self._types if name not in self._told}
        for name, (_, action) in list(self._running.items()):
            # dockings and undockings can't be interrupted, and rovers out of contact can't be told
            if action.carrier is not None or name in self._told:
                continue
            queue = self._queues[name]
            new = queue[0] if queue and queue[0].carrier is None and queue[0].name is action.name else None
            goal = None if new is None else poses.get(new.place, {}).get(self._types[name])
            if new is not None and name not in self._ends and goal == self._goals[name]:
                self._running[name] = (revision, queue.popleft())  # it belongs to the new plan from now on
            else:
                self._ends.setdefault(name, ActionEnd.SUPERSEDED)
                self._world.stop(name)

    def start_due(self, *, drives_only: bool = False) -> tuple[str, ...]:
        """Start every action whose robots are all free; return the robots without a route."""
        now_ms = self._world.now_ms
        # most news contains newly seen cells only
        if not self._changed and (self.ready_ms is None or now_ms < self.ready_ms):
            return ()
        self._changed, self.ready_ms = False, None
        blocked: list[str] = []
        reports = {robot.name: robot for robot in self._on_board()}
        for robot in tuple(reports.values()):
            action = self._startable(robot.name)
            if action is None:
                continue
            ready_ms = max(reports[name].free_at_ms for name in action.robots)
            charged = self._told.get(robot.name, self._orders).charged
            for wait in charged.get(action, ()) if charged else ():
                ready_ms = max(ready_ms, now_ms + wait.after_ms(reports[wait.robot].charge))
            if ready_ms > now_ms:  # one of them is stuck, or still charges
                self.ready_ms = ready_ms if self.ready_ms is None else min(self.ready_ms, ready_ms)
                continue
            if drives_only and action.carrier is not None:
                self._changed = True  # it can start as soon as docking is allowed again
                continue
            if not self._start(robot, action) and robot.name not in self._told:
                blocked.append(robot.name)
        return tuple(blocked)

    def finished(self, robots: Iterable[str]) -> tuple[Action, ...]:
        """End the actions of `robots` whose commands ended; return those that are known to be done."""
        done: list[Action] = []
        for name in robots:
            if name not in self._running:  # its action has already ended, with its partner's
                continue
            revision, action = self._running.pop(name)
            self._changed = True
            if action.carrier is None:
                self._end_drive(name)
            elif action.carrier == name:
                continue  # the event is reported once, for the rover
            end = self._ends.pop(name, ActionEnd.DONE)
            self._end(action, revision, end)
            if end is ActionEnd.DONE and name not in self._told:
                done.append(action)
                self.deployments.done(action)
        return tuple(done)

    def failed(self, robots: Iterable[str]) -> tuple[Action, ...]:
        """End the actions of `robots` whose commands failed, and drop what was to follow; return these actions."""
        failed: list[Action] = []
        for name in robots:
            ends = name not in self._ends and name not in self._told
            action = self._cut_short(name, ActionEnd.FAILED)
            for partner in () if action is None else action.robots:
                self._queues[partner].clear()
            if action is not None and ends:
                failed.append(action)
        return tuple(failed)

    def lost(self, robots: Iterable[str]) -> None:
        """End the actions of `robots` that are lost, and drop what was to follow."""
        for name in robots:
            self._cut_short(name, ActionEnd.LOST)
            self._queues[name].clear()

    def part(
        self, name: str, meetings: Sequence[str], *, holds_plan: bool, returns: bool
    ) -> tuple[list[Sequence[Cell]], tuple[Cell, ...]]:
        """Let a rover out of contact carry out its drives up to its first docking, or else drive back and wait.

        Without the plan it ends its running drive only. If it `returns`, it drives back to where it was set down, or
        else to the nearest of `meetings`. Return its routes from now on, and the cells to which it drives to explore.
        """
        self._told[name], self._changed = self._orders, True
        routes, explores = self._drive_on(name)
        here = routes[-1][-1]
        follows: list[Action] = []
        queue = self._queues[name] if holds_plan else deque()
        for action in takewhile(lambda action: action.carrier is None, queue):
            way = self._ways(name, here, [action.place])
            if not way:
                break
            follows.append(action)
            routes.append(way[action.place])
            here = way[action.place][-1]
            explores += [here] if action.name is ActionName.EXPLORE else []
        if returns and (len(follows) == len(queue) or queue[len(follows)].carrier is None):
            own = self.deployments.at.get(name)
            ways = self._ways(name, here, [] if own is None else [own]) or self._ways(name, here, meetings)
            back = min(ways, key=lambda place: (len(ways[place]), place), default=None)
            if back is not None and len(ways[back]) > 1:
                now_ms = self._world.now_ms
                follows.append(
                    Action(name=ActionName.MOVE, start_ms=now_ms, duration_ms=0, robot=name, place=back, origin=None)
                )
                routes.append(ways[back])
        self._queues[name] = deque(follows if holds_plan else ())
        return routes, tuple(explores)

    def meet(self, name: str) -> None:
        """Let a rover that is in contact again finish its drive, and await a new plan."""
        self._told.pop(name)
        self._queues[name].clear()

    def _drive_on(self, name: str) -> tuple[list[Sequence[Cell]], list[Cell]]:
        """Return the route that a robot on the ground still has to drive, and its end if it explores there."""
        here = next(robot.cell for robot in self._on_board() if robot.name == name)
        assert here is not None, "rovers aboard are in contact"
        if name not in self._running or name in self._ends:  # it stops at its next cell
            return [[here]], []
        route, goal = self._routes[name], self._goals[name]
        rest = route[route.index(here) :] if here in route else self._route(self._types[name], here, goal, None)
        return [rest or [here]], [goal] if self._running[name][1].name is ActionName.EXPLORE else []

    def _ways(self, name: str, here: Cell, places: Iterable[str]) -> dict[str, Sequence[Cell]]:
        """Return the routes of a robot from a cell to those of these places that it can reach."""
        kind, poses = self._types[name], self._told[name].poses
        cells = {place: poses[place][kind] for place in places if kind in poses.get(place, {})}
        ways = {place: self._route(kind, here, cell, None) for place, cell in cells.items()}
        return {place: way for place, way in ways.items() if way is not None}

    def _cut_short(self, name: str, end: ActionEnd) -> Action | None:
        """End a robot's running action for all its robots; return the action."""
        if name not in self._running:
            return None
        revision, action = self._running[name]
        for partner in action.robots:
            self._running.pop(partner, None)
        self._changed = True
        if action.carrier is None:
            self._end_drive(name)
        self._ends.pop(name, None)
        self._end(action, revision, end)
        return action

    def _startable(self, name: str) -> Action | None:
        queue = self._queues[name]
        if not queue:
            return None
        action = queue[0]
        # a docking is in the queues of two robots; its rover starts it, so it starts once
        ready = all(r not in self._running and self._queues[r] and self._queues[r][0] is action for r in action.robots)
        return action if ready and name == action.robot else None

    def _start(self, robot: RobotReport, action: Action) -> bool:
        """Send the command for `action`; without a route, drop the robot's queue and return False."""
        revision, poses, _ = self._told.get(robot.name, self._orders)
        cell = poses[action.place].get(robot.type)
        route: Sequence[Cell] | None = None
        if action.carrier is None and cell is not None and robot.cell is not None:
            route = self._route(robot.type, robot.cell, cell, robot.heading)
        # the type may have no cell at this place: the map has changed since the survey
        if cell is None or (action.carrier is None and route is None):
            self._queues[robot.name].clear()
            self._end(action, revision, ActionEnd.BLOCKED)
            return False
        for name in action.robots:
            self._queues[name].popleft()
            self._running[name] = (revision, action)
        now = self._world.now_ms
        self._observer.event(ActionStarted(t_ms=now, revision=revision, action=action, cell=cell))
        if route is not None:
            self._goals[robot.name], self._routes[robot.name] = cell, route
            self._observer.event(DriveStarted(t_ms=now, robot=robot.name, cell=route[0], steps=steps_of(route)))
            self._world.drive(robot.name, route)
        elif action.name is ActionName.DOCK:
            self._world.dock(action.robot, str(action.carrier))
        else:
            self._world.undock(action.robot, str(action.carrier), cell)
        return True

    def _end_drive(self, name: str) -> None:
        cell = next(robot.cell for robot in self._on_board() if robot.name == name)
        if cell is not None:
            self._observer.event(DriveEnded(t_ms=self._world.now_ms, robot=name, cell=cell))

    def _end(self, action: Action, revision: int, end: ActionEnd) -> None:
        self._observer.event(ActionEnded(t_ms=self._world.now_ms, revision=revision, action=action, end=end))


def _leading(cells: Sequence[Cell], kind: str, standing: Standing, without_zones: Standing) -> int:
    """Return how many of the first cells are in a no-go zone."""
    inside = (not standing(kind, [cell]) and without_zones(kind, [cell]) for cell in cells)
    return next((count for count, zone in enumerate(inside) if not zone), len(cells))

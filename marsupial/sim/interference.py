"""A simulated world in which robots keep out of each other's footprints (`--interference`).

`SimulatedWorld` lets robots share cells and pass through each other. Here two robots on the ground are never nearer
than the sum of their radii. The mission loop only sees that robots arrive later, or take another route.

How it works
------------
::

    wait: the next step is claimed (`marsupial.sim.claims`) ──► set off as soon as it is clear
      │ after `PATIENCE_MS`, if no robot in the way moves or docks: a deadlock
      ▼
    1. a detour around the robots that stand, if it is at most `DETOUR_M` longer
    2. one robot steps aside, off the way of the other, and goes on once that one has passed:
       one that has nothing to do before one that drives, and this one before one that is to dock now;
       of equals the last in the order of the team
    3. the same, though others stand in its way: they will have to step aside in turn
    4. it backs off, and one that has nothing to do leaves the corner that it stands in
      │ none of it for `GIVE_UP_MS`, or some of it `MOST_DEADLOCKS` times
      ▼
    the drive fails, and the strategy plans anew

An idle robot that made room stays there. If it has to dock, it returns. A docking or undocking begins once both robots
are in place, and the ground on which a rover is set down is clear.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from marsupial.model import Cell, Mask, RobotReport, RobotType
from marsupial.paths.routes import Route, route_length
from marsupial.sim.claims import PATIENCE_MS, Wait, WaitingWorld
from marsupial.sim.world import RobotActivity, SimulatedRobot

DETOUR_M = 10.0
"""How much longer a detour may be than the direct route; beyond that, other robots make room instead."""

LET_PASS_MS = 60_000
"""Longest time that a robot waits aside for another one to pass."""

GIVE_UP_MS = 60_000
"""How long a robot waits before its drive, docking or undocking fails."""

MOST_DEADLOCKS = 5
"""How often a drive gets past others by a detour or because one makes room; then it fails too."""

_TRIES = 3
"""How many places out of a corner are tried."""


@dataclass(slots=True)
class _Aside:
    """A robot that makes room."""

    winner: str | None  # the robot it makes room for; None while it returns to its docking cell
    spot: Cell  # where it stood
    goal: Cell | None  # goal of its own drive, if any
    until_ms: int  # end of its wait
    arrived: bool = False


@dataclass(frozen=True, slots=True)
class _Handover:
    """A docking, or an undocking onto `landing`, that can't begin yet."""

    rover: str
    carrier: str
    landing: Cell | None
    begun_ms: int
    wait: Wait


class CrowdedWorld(WaitingWorld):
    """A simulated `World` in which robots keep out of each other's footprints, and out of deadlocks."""

    def _set_up(self, kinds: Mapping[str, RobotType]) -> None:
        super()._set_up(kinds)
        self._posts = {robot.name: robot.cell for robot in self._robots.values()}  # where commands have left them
        self._aside: dict[str, _Aside] = {}
        self._resolved = Counter[str]()  # how many deadlocks of a robot's last drive were resolved
        self._handovers: list[_Handover] = []

    # commands and reports

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        if self._declined(robot):
            return
        self._posts[robot], self._resolved[robot] = route[-1], 0
        errand = self._aside.get(robot)
        if errand is None:
            super().drive(robot, route)
        else:  # it makes room, and continues from there
            errand.goal = route[-1]
            mover = self._robots[robot]
            self._moment.passages.append((robot, mover.route[mover.step :]))

    def stop(self, robot: str) -> None:
        errand = self._aside.get(robot)
        if errand is not None and errand.goal is None:
            return
        self._aside.pop(robot, None)
        super().stop(robot)
        if errand is not None and errand.arrived:
            self._next_step(self._robots[robot])  # it stands: its drive ends here

    def dock(self, rover: str, carrier: str) -> None:
        self._hand_over(rover, carrier, None)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._hand_over(rover, carrier, cell)

    def _hand_over(self, rover: str, carrier: str, landing: Cell | None) -> None:
        if self._declined(rover, carrier):
            return
        wait = Wait(self.now_ms, self.now_ms + PATIENCE_MS)
        self._handovers.append(_Handover(rover, carrier, landing, self.now_ms, wait))
        self._wake(wait, carrier)
        for robot in (self._robots[rover], self._robots[carrier]):
            if robot.cell is not None and robot.cell != self._posts[robot.name]:  # it has made room since
                self._moment.passages.append((robot.name, (robot.cell,)))
        self._begin_handovers()

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        for asked in self._handovers:  # as the simulator reports those that have begun
            if robot.name in (asked.rover, asked.carrier):
                rover = self._robots[asked.rover].kind
                took_ms = rover.dock_ms if asked.landing is None else rover.undock_ms
                report = replace(report, free_at_ms=self.now_ms + took_ms)
            if robot.name == asked.rover:
                carrier = asked.carrier if asked.landing is None else None
                report = replace(report, cell=asked.landing, carrier=carrier)
        return report

    # motion

    def _step(self, robot: SimulatedRobot) -> bool:
        done, errand = super()._step(robot), self._aside.get(robot.name)
        if not done or errand is None:
            return done
        self._moment.passages.append((robot.name, robot.route[-1:]))
        if errand.goal is None:
            self._rest(robot)
        else:
            errand.arrived = True
        return False

    def _lose(self, robot: SimulatedRobot, what: str = "failed") -> list[tuple[str, str]]:
        lost = super()._lose(robot, what)
        for name, _ in lost:
            self._forget(name)
        return lost

    def _forget(self, name: str) -> None:
        """Drop what a robot was asked for and has not begun."""
        self._aside.pop(name, None)
        self._handovers = [each for each in self._handovers if name not in (each.rover, each.carrier)]

    def _halt(self, robot: SimulatedRobot) -> None:
        errand = self._aside.get(robot.name)
        if errand is not None and errand.goal is None and robot.cell is not None:  # no command's end tells where it is
            self._moment.passages.append((robot.name, (robot.cell,)))
        self._forget(robot.name)
        super()._halt(robot)
        self._posts[robot.name] = robot.cell

    def _rest(self, robot: SimulatedRobot) -> None:
        """Stop a robot that has no command."""
        self._aside.pop(robot.name, None)
        self._stop_waiting(robot)
        robot.due += 1
        self._end_command(robot)

    def _set_out(self, robot: SimulatedRobot, route: Route) -> None:
        """Send a standing robot along another route than commanded."""
        self._stop_waiting(robot)
        self._moment.passages.append((robot.name, route))
        self._follow(robot, route)

    # which robot blocks which

    def _meet(self, robot: SimulatedRobot, other: SimulatedRobot) -> bool:
        names = {robot.name, other.name}
        return super()._meet(robot, other) or any({each.rover, each.carrier} == names for each in self._handovers)

    def _goal(self, robot: SimulatedRobot) -> Cell | None:
        errand = self._aside.get(robot.name)
        return super()._goal(robot) if errand is None else errand.goal

    def _way(self, robot: SimulatedRobot) -> tuple[Cell, ...]:
        """Return the cells that a robot will pass or set a rover down on, its own cell first."""
        ahead = robot.route[robot.step :] if robot.activity is RobotActivity.DRIVING else ()
        landings = [each.landing for each in self._handovers if robot.name == each.carrier and each.landing is not None]
        here = () if robot.cell is None else (robot.cell,)
        return (*here, *ahead, *landings)

    # deadlocks

    def _settle(self, *, commanded: bool) -> None:
        self._begin_handovers()
        for name, errand in list(self._aside.items()) if commanded else ():
            if errand.arrived and self._passed(self._robots[name], errand):
                self._go_on(self._robots[name], errand)
        super()._settle(commanded=commanded)

    def _resolve(self, robot: SimulatedRobot, waited_ms: int) -> None:
        """Find a route for a robot that has waited, unless a robot in its way moves anyway."""
        ahead = robot.route[robot.step + 1]
        blockers = list(self._in_the_way(robot, ahead))
        if not blockers or any(self._busy(other) for other in blockers):
            return
        often = self._resolved[robot.name] >= MOST_DEADLOCKS
        if not often and (self._detour(robot) or self._make_room(robot, blockers)):
            self._deadlocks += 1
            self._resolved[robot.name] += 1
        elif often or waited_ms >= GIVE_UP_MS:
            commanded = self._goal(robot) is not None
            if commanded:
                self._moment.failed.append((robot.name, f"no way past {', '.join(other.name for other in blockers)}"))
            self._rest(robot)

    def _busy(self, robot: SimulatedRobot) -> bool:
        claim = self._claim(robot)
        return robot.partner is not None or claim is None or claim[0] != claim[1]

    def _detour(self, robot: SimulatedRobot) -> bool:
        """Send a robot on a detour around all standing robots; return whether a detour exists."""
        ahead = robot.route[robot.step :]
        room = self._room(robot, self._robots.values())
        route = self._clearance.route(robot.kind, ahead[0], ahead[-1], room)
        longest = route_length(ahead, robot.kind.diagonal) + DETOUR_M / self.grid.resolution_m
        if route is None or route_length(route, robot.kind.diagonal) > longest:
            return False
        self._set_out(robot, route)
        return True

    def _make_room(self, robot: SimulatedRobot, blockers: Sequence[SimulatedRobot]) -> bool:
        """Send one of the robots that block each other aside; return whether one can.

        Blocking robots that already make room are not sent again.
        """
        order = list(self._robots)
        able = [one for one in blockers if one.name not in self._aside or self._aside[one.name].arrived]
        several = sorted((robot, *able), key=lambda one: (self._precedence(one), -order.index(one.name)))
        for pushing in (False, True):
            for one in several:
                winner = blockers[0] if one is robot else robot
                asked = self._drives(winner) and self._precedence(one) <= self._precedence(winner)
                if asked and self._step_aside(one, winner, pushing=pushing):
                    return True
        return any(self._let_out(one, robot) for one in able if self._precedence(one) == 0)

    def _precedence(self, robot: SimulatedRobot) -> int:
        """Return 2 for a robot that has to dock now, 1 for a driving robot, 0 for an idle one.

        A robot on its way aside counts as a driving robot.
        """
        if any(robot.name in (each.rover, each.carrier) for each in self._handovers):
            return 2
        return int(self._drives(robot))

    def _drives(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot has a drive to finish, even if it waits."""
        return robot.activity is RobotActivity.DRIVING and robot.step < len(robot.route) - 1

    def _step_aside(self, robot: SimulatedRobot, winner: SimulatedRobot, *, pushing: bool) -> bool:
        """Send a robot to the nearest place off another robot's route; return whether there is one."""
        room = self._room(robot, [winner] if pushing else self._robots.values())
        route = self._refuge(robot, room, winner, self._way(winner))
        if route is not None:
            self._send_aside(robot, winner, route)
        return route is not None

    def _let_out(self, robot: SimulatedRobot, winner: SimulatedRobot) -> bool:
        """Send a robot out of a corner that another one wants to pass and bars; this one backs off first, if it can."""
        room = self._room(robot, [one for one in self._robots.values() if one is not winner])
        back_room, goal = self._room(winner, self._robots.values()), self._goal(winner)
        way, apart = self._way(winner), self._clearance.apart(robot.kind, winner.kind)
        for _ in range(_TRIES):
            out = self._refuge(robot, room, winner, way)
            back = None if out is None else self._refuge(winner, back_room, robot, out)
            on = None if back is None or goal is None else self._clearance.route(winner.kind, back[-1], goal)
            if out is None or back is None or on is None:
                return False
            if all(math.dist(cell, out[-1]) >= apart for cell in on):
                self._send_aside(winner, robot, back)
                self._send_aside(robot, winner, out)
                return True
            way += on  # it would be in the way again
        return False

    def _refuge(self, robot: SimulatedRobot, room: Mask, winner: SimulatedRobot, way: Iterable[Cell]) -> Route | None:
        """Return the route to the nearest place in a room that is off another robot's way; None if it can't act yet."""
        assert robot.cell is not None
        return None if self._is_stuck(robot) else self._clearance.refuge(robot.kind, robot.cell, room, way, winner.kind)

    def _send_aside(self, robot: SimulatedRobot, winner: SimulatedRobot, route: Route) -> None:
        """Send a robot along a route to make room for another one, after which it goes on."""
        assert robot.cell is not None
        goal = self._goal(robot) if robot.activity is RobotActivity.DRIVING else None
        self._aside[robot.name] = _Aside(winner.name, robot.cell, goal, self.now_ms + LET_PASS_MS)
        self._wake(Wait(None, self.now_ms + LET_PASS_MS), robot.name)
        self._set_out(robot, route)

    def _is_stuck(self, robot: SimulatedRobot) -> bool:
        """Return whether a robot that does nothing can't act yet."""
        return robot.activity is RobotActivity.NONE and robot.free_at_ms > self.now_ms

    def _passed(self, robot: SimulatedRobot, errand: _Aside) -> bool:
        """Return whether the robot that was let through has passed the spot or no longer comes, or time is up."""
        if errand.winner is None or self.now_ms >= errand.until_ms:
            return True
        winner = self._robots[errand.winner]
        gone = winner.cell is None or winner.lost or not self._drives(winner)
        apart = self._clearance.apart(robot.kind, winner.kind)
        return gone or all(math.dist(cell, errand.spot) >= apart for cell in self._way(winner)[1:])

    def _go_on(self, robot: SimulatedRobot, errand: _Aside) -> None:
        """Send a robot that made room to the goal of its drive."""
        assert robot.cell is not None
        assert errand.goal is not None
        route = self._clearance.route(robot.kind, robot.cell, errand.goal)
        del self._aside[robot.name]
        if route is None:
            self._moment.failed.append((robot.name, "no way on from where it made room"))
            self._rest(robot)
        else:
            self._set_out(robot, route)

    def _room(self, robot: SimulatedRobot, others: Iterable[SimulatedRobot]) -> Mask:
        """Return the mask of known cells on which a robot stands clear of these robots, except those that it meets."""
        assert robot.cell is not None
        claims = [
            (other.kind, claim)
            for other in others
            if other is not robot and (claim := self._claim(other)) is not None and not self._meet(robot, other)
        ]
        return self._clearance.room(robot.kind, robot.cell, claims)

    # dockings

    def _begin_handovers(self) -> None:
        """Begin the dockings and undockings for which both robots are in place and there is room."""
        for asked in tuple(self._handovers):
            rover, carrier = self._robots[asked.rover], self._robots[asked.carrier]
            landing = [] if asked.landing is None else list(self._in_the_way(rover, asked.landing))
            if self._in_place(asked, rover, carrier) and not landing:
                self._handovers.remove(asked)
                self._begin(asked, rover)
            elif asked.wait.due(self.now_ms):
                self._wake(asked.wait, asked.carrier)
                if self.now_ms - asked.begun_ms >= GIVE_UP_MS:
                    self._handovers.remove(asked)
                    self._moment.failed += [(name, "no room to dock") for name in (asked.rover, asked.carrier)]
                for one in landing:
                    if not self._busy(one):
                        self._deadlocks += any(self._step_aside(one, carrier, pushing=push) for push in (False, True))

    def _begin(self, asked: _Handover, rover: SimulatedRobot) -> None:
        if asked.landing is not None:
            super().undock(asked.rover, asked.carrier, asked.landing)
            self._posts[asked.rover] = asked.landing
            return
        if rover.cell is not None:
            self._docking[asked.rover] = rover.cell
        super().dock(asked.rover, asked.carrier)

    def _in_place(self, asked: _Handover, rover: SimulatedRobot, carrier: SimulatedRobot) -> bool:
        """Return whether both robots are free and near enough; a robot too far away after making room is sent back."""
        if any(robot.activity is not RobotActivity.NONE or self._is_stuck(robot) for robot in (rover, carrier)):
            return False
        if self._in_reach(rover, carrier, rover.cell if asked.landing is None else asked.landing):
            return True
        sent = [self._send_back(robot) for robot in (rover, carrier)]
        return not any(sent)

    def _send_back(self, robot: SimulatedRobot) -> bool:
        """Send a robot back to where its last command left it; return whether it was elsewhere."""
        post = self._posts[robot.name]
        if self._is_stuck(robot) or robot.cell is None or post is None or post == robot.cell:
            return False
        route = self._clearance.route(robot.kind, robot.cell, post)
        if route is not None:
            self._aside[robot.name] = _Aside(None, robot.cell, None, self.now_ms)
            self._set_out(robot, route)
        return True  # without a route, as a zone closes it, the docking fails in time

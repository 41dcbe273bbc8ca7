"""What robots do that wait for each other, and none of which would move: they drive around, or make room.

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

An idle robot that made room stays there. If it has to dock, it returns (`marsupial.sim.handovers`).
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from marsupial.model import Cell, Mask
from marsupial.paths.routes import Route, route_length
from marsupial.sim.claims import Aside, Claims, Wake
from marsupial.sim.motion import Motion, RobotActivity, Rule, SimulatedCommand, SimulatedDrive, SimulatedRobot

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


class Deadlocks(Rule):
    """Starts robots that can set off, and finds routes for those that have waited for some time."""

    def __init__(self, motion: Motion, claims: Claims) -> None:
        self._motion = motion
        self._claims = claims
        self._asides = claims.asides
        self._resolved = Counter[SimulatedRobot]()  # how many deadlocks of a robot's last drive were resolved

    def accepts(self, command: SimulatedCommand) -> bool:
        """Return whether no robot that is to drive makes room; one that does continues from there."""
        if not isinstance(command, SimulatedDrive):
            return True
        (robot,) = command.robots
        self._resolved[robot] = 0
        aside = self._asides.get(robot)
        if aside is None:
            return True
        aside.goal = command.route[-1]
        self._motion.moment.passages.append((robot.name, robot.route[robot.step :]))
        return False

    def may_stop(self, robot: SimulatedRobot) -> bool:
        aside = self._asides.get(robot)
        if aside is not None and aside.goal is None:
            return False  # it has no command that could end
        self._asides.pop(robot, None)
        return True

    def on_step(self, robot: SimulatedRobot, *, ended: bool) -> bool:
        aside = self._asides.get(robot)
        if not ended or aside is None:
            return ended
        self._motion.moment.passages.append((robot.name, robot.route[-1:]))
        if aside.goal is None:
            self._rest(robot)
        else:
            aside.arrived = robot.waits = True
        return False

    def on_halt(self, robot: SimulatedRobot) -> None:
        aside = self._asides.pop(robot, None)
        if aside is not None and aside.goal is None and robot.cell is not None and not robot.lost:
            # no command's end tells where it is
            self._motion.moment.passages.append((robot.name, (robot.cell,)))

    def settle(self) -> None:
        # a robot that has arrived may continue at once: its next command comes before others use its place
        commanded = not self._motion.moment.finished
        for robot, aside in list(self._asides.items()) if commanded else ():
            if aside.arrived and self._has_passed(robot, aside):
                self._go_on(robot, aside)
        blocked = self._claims.blocked
        order = [robot for robot in self._motion.team.values() if robot in blocked]
        waiting = len(order) + 1
        while len(blocked) < waiting:  # a robot that sets off may make room for the next
            waiting = len(blocked)
            for robot in order:
                if robot in blocked:
                    self._motion.next_step(robot)
        for robot, wait in list(blocked.items()):
            if blocked.get(robot) is not wait:  # it just got another route
                continue
            if wait.since_ms is None:
                self._claims.begin_waiting(robot, wait)
            elif self._claims.is_due(wait):
                self._resolve(robot, self._motion.now_ms - wait.since_ms)

    def _resolve(self, robot: SimulatedRobot, waited_ms: int) -> None:
        """Find a route for a robot that has waited, unless a robot in its way moves anyway."""
        blockers = list(self._claims.in_the_way(robot, robot.route[robot.step + 1]))
        if not blockers or any(self._claims.is_busy(other) for other in blockers):
            return
        often = self._resolved[robot] >= MOST_DEADLOCKS
        if not often and (self._detour(robot) or self._make_room(robot, blockers)):
            self._claims.deadlocks += 1
            self._resolved[robot] += 1
        elif often or waited_ms >= GIVE_UP_MS:
            if self._claims.goal(robot) is not None:  # it has a command
                reason = f"no way past {', '.join(other.name for other in blockers)}"
                self._motion.moment.failed.append((robot.name, reason))
            self._rest(robot)

    # detours

    def _detour(self, robot: SimulatedRobot) -> bool:
        """Send a robot on a detour around all standing robots; return whether a detour exists."""
        ahead, diagonal = robot.route[robot.step :], robot.kind.diagonal
        room = self._claims.room(robot, self._motion.team.values())
        route = self._claims.clearance.route(robot.kind, ahead[0], ahead[-1], room)
        longest = route_length(ahead, diagonal) + DETOUR_M / self._motion.grid.resolution_m
        if route is None or route_length(route, diagonal) > longest:
            return False
        self._set_out(robot, route)
        return True

    def _set_out(self, robot: SimulatedRobot, route: Route) -> None:
        """Send a standing robot along another route than commanded."""
        self._claims.stop_waiting(robot)
        self._motion.moment.passages.append((robot.name, route))
        self._motion.follow(robot, route)

    def _rest(self, robot: SimulatedRobot) -> None:
        """Stop a robot that has no command."""
        self._asides.pop(robot, None)
        self._claims.stop_waiting(robot)
        robot.due += 1
        self._motion.end_command(robot)

    # making room

    def _make_room(self, robot: SimulatedRobot, blockers: Sequence[SimulatedRobot]) -> bool:
        """Send one of the robots that block each other aside; return whether one can.

        Blocking robots that already make room are not sent again.
        """
        order = list(self._motion.team.values())
        able = [one for one in blockers if one not in self._asides or self._asides[one].arrived]
        several = sorted((robot, *able), key=lambda one: (self._precedence(one), -order.index(one)))
        for pushing in (False, True):
            for one in several:
                winner = blockers[0] if one is robot else robot
                asked = _drives(winner) and self._precedence(one) <= self._precedence(winner)
                if asked and self.step_aside(one, winner, pushing=pushing):
                    return True
        return any(self._let_out(one, robot) for one in able if self._precedence(one) == 0)

    def _precedence(self, robot: SimulatedRobot) -> int:
        """Return 2 for a robot that has to dock now, 1 for a driving robot, 0 for an idle one.

        A robot on its way aside counts as a driving robot.
        """
        return 2 if any(robot in asked.robots for asked in self._claims.handovers) else int(_drives(robot))

    def step_aside(self, robot: SimulatedRobot, winner: SimulatedRobot, *, pushing: bool) -> bool:
        """Send a robot to the nearest place off another robot's route; return whether there is one.

        `pushing`: even if others stand in its way.
        """
        room = self._claims.room(robot, [winner] if pushing else self._motion.team.values())
        route = self._refuge(robot, room, winner, self._claims.way(winner))
        if route is not None:
            self._send_aside(robot, winner, route)
        return route is not None

    def _let_out(self, robot: SimulatedRobot, winner: SimulatedRobot) -> bool:
        """Send a robot out of a corner that another one wants to pass and bars; this one backs off first, if it can."""
        claims, team = self._claims, self._motion.team.values()
        room, back_room = claims.room(robot, [one for one in team if one is not winner]), claims.room(winner, team)
        way, goal, apart = claims.way(winner), claims.goal(winner), claims.clearance.apart(robot.kind, winner.kind)
        for _ in range(_TRIES):
            out = self._refuge(robot, room, winner, way)
            back = None if out is None else self._refuge(winner, back_room, robot, out)
            on = None if back is None or goal is None else claims.clearance.route(winner.kind, back[-1], goal)
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
        if self._motion.is_stuck(robot):
            return None
        return self._claims.clearance.refuge(robot.kind, robot.cell, room, way, winner.kind)

    def _send_aside(self, robot: SimulatedRobot, winner: SimulatedRobot, route: Route) -> None:
        """Send a robot along a route to make room for another one, after which it goes on."""
        assert robot.cell is not None
        goal = self._claims.goal(robot) if robot.activity is RobotActivity.DRIVING else None
        until_ms = self._motion.now_ms + LET_PASS_MS
        self._asides[robot] = Aside(winner, robot.cell, goal, until_ms)
        self._motion.at(until_ms, Wake())
        self._set_out(robot, route)

    def send_back(self, robot: SimulatedRobot, post: Cell) -> None:
        """Send a robot that made room back to its post, if there is a way."""
        assert robot.cell is not None
        route = self._claims.clearance.route(robot.kind, robot.cell, post)
        if route is not None:
            self._asides[robot] = Aside(None, robot.cell, None, self._motion.now_ms)
            self._set_out(robot, route)

    def _has_passed(self, robot: SimulatedRobot, aside: Aside) -> bool:
        """Return whether the robot that was let through has passed the spot or no longer comes, or time is up."""
        winner = aside.winner
        if winner is None or self._motion.now_ms >= aside.until_ms or winner.cell is None or winner.lost:
            return True
        apart = self._claims.clearance.apart(robot.kind, winner.kind)
        ahead = self._claims.way(winner)[1:]
        return not _drives(winner) or all(math.dist(cell, aside.spot) >= apart for cell in ahead)

    def _go_on(self, robot: SimulatedRobot, aside: Aside) -> None:
        """Send a robot that made room to the goal of its drive."""
        assert robot.cell is not None
        assert aside.goal is not None
        route = self._claims.clearance.route(robot.kind, robot.cell, aside.goal)
        del self._asides[robot]
        if route is None:
            self._motion.moment.failed.append((robot.name, "no way on from where it made room"))
            self._rest(robot)
        else:
            self._set_out(robot, route)


def _drives(robot: SimulatedRobot) -> bool:
    """Return whether a robot has a drive to finish, even if it waits."""
    return robot.activity is RobotActivity.DRIVING and robot.step < len(robot.route) - 1

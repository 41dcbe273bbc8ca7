"""Dockings and undockings among robots that keep clear of each other.

One begins once both robots are in place, and the ground on which a rover is set down is clear. Robots that made room
after they had come to dock are sent back; robots that stand where a rover is to be set down are sent aside.
"""

from typing import Any

from marsupial.sim.claims import PATIENCE_MS, Claims, Wait, Wake
from marsupial.sim.deadlocks import GIVE_UP_MS, Deadlocks
from marsupial.sim.motion import (
    Motion,
    RobotActivity,
    Rule,
    SimulatedCommand,
    SimulatedDrive,
    SimulatedHandover,
    SimulatedRobot,
)


class Handovers(Rule):
    """Keeps dockings and undockings until they can begin."""

    def __init__(self, motion: Motion, claims: Claims, deadlocks: Deadlocks) -> None:
        self._motion = motion
        self._claims = claims
        self._deadlocks = deadlocks
        self._asked = claims.handovers
        self._posts = {robot: robot.cell for robot in motion.team.values()}  # where commands have left them

    def accepts(self, command: SimulatedCommand) -> bool:
        if isinstance(command, SimulatedDrive):
            self._posts[command.robots[0]] = command.route[-1]
            return True
        wait = Wait(self._motion.now_ms, self._motion.now_ms + PATIENCE_MS)
        self._asked[command] = wait
        self._motion.at(wait.look_ms, Wake())
        for robot in command.robots:
            if robot.cell is not None and robot.cell != self._posts[robot]:  # it has made room since
                self._motion.moment.passages.append((robot.name, (robot.cell,)))
        self.settle()
        return False

    def report(self, robot: SimulatedRobot, fields: dict[str, Any]) -> None:
        for asked in self._asked:  # as those that have begun are reported
            if robot in asked.robots:
                (rover, carrier), docks = asked.robots, asked.landing is None
                fields["free_at_ms"] = self._motion.now_ms + (rover.kind.dock_ms if docks else rover.kind.undock_ms)
                if robot is rover:
                    fields |= {"cell": asked.landing, "carrier": carrier.name if docks else None}

    def on_halt(self, robot: SimulatedRobot) -> None:
        for asked in [asked for asked in self._asked if robot in asked.robots]:
            del self._asked[asked]
        if not robot.lost:
            self._posts[robot] = robot.cell

    def settle(self) -> None:
        """Begin the dockings and undockings for which both robots are in place and there is room."""
        for asked, wait in list(self._asked.items()):
            (rover, carrier), landing = asked.robots, asked.landing
            barring = [] if landing is None else list(self._claims.in_the_way(rover, landing))
            if self._in_place(asked) and not barring:
                del self._asked[asked]
                self._motion.begin(asked)
                if landing is not None:
                    self._posts[rover] = landing
            elif self._claims.is_due(wait):
                if wait.since_ms is not None and self._motion.now_ms - wait.since_ms >= GIVE_UP_MS:
                    self._asked.pop(asked, None)
                    self._motion.moment.failed += [(robot.name, "no room to dock") for robot in asked.robots]
                for one in barring:
                    if not self._claims.is_busy(one):
                        step_aside = self._deadlocks.step_aside
                        self._claims.deadlocks += any(step_aside(one, carrier, pushing=push) for push in (False, True))

    def _in_place(self, asked: SimulatedHandover) -> bool:
        """Return whether both robots are free and near enough; a robot too far away after making room is sent back."""
        rover, carrier = asked.robots
        if any(robot.activity is not RobotActivity.NONE or self._motion.is_stuck(robot) for robot in (rover, carrier)):
            return False
        if self._motion.in_reach(rover, carrier, rover.cell if asked.landing is None else asked.landing):
            return True
        sent = [self._send_back(robot) for robot in (rover, carrier)]
        return not any(sent)

    def _send_back(self, robot: SimulatedRobot) -> bool:
        """Send a robot back to where its last command left it; return whether it was elsewhere."""
        post = self._posts[robot]
        if self._motion.is_stuck(robot) or robot.cell is None or post is None or post == robot.cell:
            return False
        self._deadlocks.send_back(robot, post)  # without a way, as a zone closes it, the docking fails in time
        return True

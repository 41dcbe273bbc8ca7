"""Commands of a mission become goals of actions; the ends of goals become events to report."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from marsupial_client.mission_documents import Command
from marsupial_ros.goals import ActionGoal, drive_goal, failure_of, handover_goal, replaced, succeeded
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.robots import IDLE_S, ActiveCommand, Progress, Takeover, TrackedRobot
from marsupial_ros.settings import Settings
from marsupial_ros.team import Team
from marsupial_ros.transforms import Frames
from marsupial_ros.transport import ActionResult, Actions, GoalStatus, Refusal

# pauses between attempts to send a goal that its action server does not accept
FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 30.0


class CommandedTeam(Team):
    """A team that carries out commands.

    Names of goals contain the id of the `mission` and how often it was resumed before (`starts`), so each name is used
    only once.
    """

    def __init__(
        self,
        settings: Settings,
        frames: Mapping[str, Frames],
        tracker: MapTracker,
        actions: Actions,
        say: Callable[[str], None],
    ) -> None:
        super().__init__(settings, frames, tracker, say)
        self._actions = actions
        self._ignored_goals: dict[str, str] = {}
        self.mission = ""
        self.starts = 0

    def execute(self, command: Command, now_s: float) -> None:
        robot = self.robots[command["robot"]]
        if command["name"] == "stop":
            if robot.active is not None and robot.active.command["id"] == command["id"]:
                self._cancel(robot.active, now_s)
            return
        active = ActiveCommand(command)
        team = self._participants(active)
        # the service commands a lost robot until its loss is reported, one report after the commands it finished
        if any(one.lost for one in team):
            return
        if away := [one.name for one in team if one.away_s is not None]:
            self.unreported.declined.append({"id": command["id"], "reason": f"{away[0]} is out of contact"})
            return
        for one in team:
            one.active = active
        active.waits_s = now_s
        self._send(active, now_s)

    def connected(self, now_s: float) -> None:
        """Resend all goals: they, or the messages that they ended, may be lost."""
        self._cancel_ignored_goals()
        for robot in self.robots.values():
            robot.since_s = now_s  # no transforms could arrive while disconnected
        for active in self.active_commands:
            self._resend(active, now_s)

    def apply_feedback(self, goal: str, feedback: Mapping[str, Any], now_s: float) -> None:
        """Apply the feedback of a drive; ignore feedback of earlier goals."""
        active = self._active(goal)
        if active is not None:
            self._accepted(active)
        if active is not None and active.drives:
            active.answered = True
            active.progress.apply_feedback(feedback, now_s)

    def ended(self, end: ActionResult) -> None:
        """Record the end of a goal; ignore earlier goals of a command that was sent again."""
        self._ignored_goals.pop(end.goal, None)
        active = self._active(end.goal)
        if active is None or active.goal is None:
            return
        if end.refusal is None:
            self._accepted(active)
        if succeeded(end) and self._looks(active):
            active.goal, active.arrived_s = None, math.inf
        elif succeeded(end):
            self._finish(active, arrived=True)
        elif active.drives and active.cancelled_s is not None:
            self._finish(active, arrived=False)
        elif end.refusal is not None:
            self._put_off(active, active.goal, end.refusal, end.values)
        elif end.status == GoalStatus.CANCELED and active.cancelled_s is None:
            # somebody else has taken over: the robot did not fail
            self._leave_alone(active, surely=True)
            self._fail(active, failure_of(active.goal, end), declined=True)
        elif active.drives and (other := replaced(end)) is not False:
            self._leave_alone(active, surely=other is True)
            active.replaced, active.goal = failure_of(active.goal, end), None
        else:
            self._fail(active, failure_of(active.goal, end))

    def stop(self, now_s: float) -> None:
        """Stop all driving robots."""
        for active in self.active_commands:
            if active.drives:
                self._cancel(active, now_s)

    def cancel_all(self, now_s: float) -> None:
        """Cancel every goal, including dockings and abandoned goals that may still be running."""
        self._cancel_ignored_goals()
        for active in self.goals:
            self._cancel(active, now_s)

    def _active(self, goal: str) -> ActiveCommand | None:
        return next((one for one in self.goals if one.name == goal), None)

    def _send(self, active: ActiveCommand, now_s: float) -> None:
        """Send the goal of a command, if now is the time; `watch` tries again."""
        if self._hindered(active, now_s):
            return
        pause_s = min(FIRST_PAUSE_S * 2 ** (active.refusals - 1), LONGEST_PAUSE_S) if active.refusals else 0.0
        if active.refusals and now_s - active.waits_s > self._waits.lost_s:
            self._fail(active, f"{active.refusal} for {self._waits.lost_s:g} s", declined=True)
        elif not active.refusals or now_s - active.since_s >= pause_s:
            self._start(active, now_s)

    def _looks(self, active: ActiveCommand) -> bool:
        """Return whether a robot has arrived where the next map may show new ground."""
        robot = self.robots[active.command["robot"]]
        at = robot.point
        if not active.drives or at is None or not self._tracker.repeats:
            return False
        return self._tracker.open_near(at, robot.settings.kind.sensor_range_m)

    def _hindered(self, active: ActiveCommand, now_s: float) -> bool:
        """Return whether its robots must not act now: somebody else leads them, or nobody knows where they are."""
        team = self._participants(active)
        if active.replaced or any(robot.taken is not None for robot in team):
            return True
        return active.drives and not team[0].has_place(now_s, self._waits.silent_s)

    def _leave_alone(self, active: ActiveCommand, *, surely: bool) -> None:
        robot = self._participants(active)[0]
        robot.taken = Takeover(surely)
        if surely:
            self._tell_takeover(robot)

    def _tell_takeover(self, robot: TrackedRobot) -> None:
        self._say(f"{robot.name}: somebody else leads it: left alone until it has stood still for {IDLE_S:g} s")

    def _put_off(self, active: ActiveCommand, goal: ActionGoal, refusal: Refusal, why: object) -> None:
        """Note that a goal was not accepted: its action server is absent or not active. The robot has not failed."""
        robot = self.robots[active.command["robot"]]
        active.goal, active.refusal = None, refusal
        active.refusals += 1
        if not robot.refusing:
            robot.refusing = True
            whose = f"nav2 of {robot.name}" if active.drives else f"the server of {goal.action}"
            self._say(f"{whose} does not accept goals ({goal.action}: {why}): it is asked again until it does")

    def _accepted(self, active: ActiveCommand) -> None:
        robot = self.robots[active.command["robot"]]
        if robot.refusing:
            self._say(f"{robot.name}: goals are accepted again")
        robot.refusing, active.refusals = False, 0

    def _start(self, active: ActiveCommand, now_s: float) -> None:
        """Send the goal of a command, or the rest of its drive."""
        goal = self._drive(active) if active.drives else self._handover(active)
        active.since_s = now_s
        active.progress, active.answered = Progress(moved_s=now_s), False
        if goal is None:
            self._finish(active, arrived=True)
            return
        active.attempt += 1
        active.goal = goal
        # a name of its own: the end of an earlier goal must not end this one
        active.name = f"{self.mission}:{active.command['id']}:{self.starts}.{active.attempt}"
        self._actions.send_goal(active.name, goal.action, goal.type, goal.values)

    def _resend(self, active: ActiveCommand, now_s: float) -> None:
        """Send the goal of a command again, or cancel it again: what was sent, or came back, may be lost."""
        if active.cancelled_s is not None:
            self._cancel(active, now_s)
        elif active.goal is not None:
            self._start(active, now_s)

    def _drive(self, active: ActiveCommand) -> ActionGoal | None:
        """Return the goal of a drive from where the robot is now; None if it has arrived."""
        robot = self.robots[active.command["robot"]]
        pose = robot.pose
        if pose is not None and (active.attempt or self.starts):
            active.advance(pose.point, self._waits.tolerance_m)
        route = active.route_m[active.passed :]
        if len(route) < 2:
            return None
        return drive_goal(self._settings, robot.settings, route, 0.0 if pose is None else pose.yaw)

    def _handover(self, active: ActiveCommand) -> ActionGoal:
        rover, carrier = self._participants(active)
        x, y = active.command.get("point_m") or rover.anchor or rover.point or (0.0, 0.0)
        beside = carrier.point or carrier.anchor
        return handover_goal(self._settings, self.mission, active.command, rover.settings, (x, y), beside)

    def _cancel(self, active: ActiveCommand, now_s: float) -> None:
        if active.goal is not None:
            active.cancelled_s = now_s
            self._actions.cancel_goal(active.name, active.goal.action)
        elif active.replaced:
            self._fail(active, active.replaced, declined=True)
        elif active.drives:
            self._finish(active, arrived=False)

    def _release(self, active: ActiveCommand) -> None:
        active.goal = None
        for robot in self._participants(active):
            robot.active = None

    def _finish(self, active: ActiveCommand, *, arrived: bool) -> None:
        """Record a command as finished: a drive at the end of its route, or where it was stopped."""
        rover = self._participants(active)[0]
        command = active.command
        if active.drives:
            at = rover.point
            end = active.route_m[-1]
            near = at is None or math.dist(at, end) <= self._waits.tolerance_m
            # an action may wrongly report success: then report where the robot really is
            if arrived and near:
                rover.anchor = end
            else:
                self._update_anchor(rover)
        else:
            rover.aboard = command["carrier"] if command["name"] == "dock" else None
            rover.away_s = None
            x, y = command.get("point_m") or (0.0, 0.0)
            rover.anchor = (x, y) if command["name"] == "undock" else None
        self._release(active)
        self.unreported.finished.append(command["id"])

    def _fail(self, active: ActiveCommand, reason: str, *, declined: bool = False) -> None:
        """Record a command as failed, or as refused."""
        if active.drives:
            self._update_anchor(self._participants(active)[0])
        self._release(active)
        ends, word = (self.unreported.declined, "refused") if declined else (self.unreported.failed, "failed")
        ends.append({"id": active.command["id"], "reason": reason})
        self._say(f"{active.command['robot']}: {active.command['name']} {word}: {reason}")

    def _abort(self, active: ActiveCommand, reason: str, *, declined: bool = False) -> None:
        self._cancel_ignored(active)
        self._fail(active, reason, declined=declined)

    def _cancel_ignored(self, active: ActiveCommand) -> None:
        """Cancel the goal of a command whose end no longer matters."""
        if active.goal is not None:
            self._ignored_goals[active.name] = active.goal.action
            self._actions.cancel_goal(active.name, active.goal.action)

    def _cancel_ignored_goals(self) -> None:
        for name, action in self._ignored_goals.items():
            self._actions.cancel_goal(name, action)

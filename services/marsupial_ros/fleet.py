"""The team in ROS: commands become goals; the ends of goals and the robots' places become reports."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from marsupial_client.mission_documents import Command, Failed, Lost, News, RobotNote
from marsupial_ros.goals import ActionGoal, drive_goal, failure_of, handover_goal, succeeded
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.robots import ActiveCommand, Progress, TrackedRobot
from marsupial_ros.rosbridge import ActionResult, GoalStatus, Rosbridge
from marsupial_ros.settings import Settings
from marsupial_ros.transforms import Frames, Point

# pause between cancellations of a goal: rosbridge ignores them until the action has accepted the goal
CANCEL_S = 1.0
# a robot told to stop counts as stopped once it has stood this long, even if its action says nothing
SETTLED_S = 3.0


@dataclass(slots=True)
class UnreportedEvents:
    """What has happened since the last report."""

    finished: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    lost: list[Lost] = field(default_factory=list)
    declined: list[Failed] = field(default_factory=list)
    returned: list[str] = field(default_factory=list)
    contact: list[str] = field(default_factory=list)  # rovers that are out of contact now, or in contact again

    @property
    def any(self) -> bool:
        """Whether anything has happened."""
        return bool(self.finished or self.failed or self.lost or self.declined or self.returned or self.contact)


class RobotFleet:
    """The robots of a mission; `frames` has their transforms by topic, `say` shows the user a line.

    Names of goals contain the id of the `mission` and how often it was resumed before (`starts`), so each name is used
    only once. `unreported` goes into the next report.
    """

    def __init__(
        self,
        settings: Settings,
        frames: Mapping[str, Frames],
        tracker: MapTracker,
        actions: Rosbridge,
        say: Callable[[str], None],
    ) -> None:
        self._settings = settings
        self._waits = settings.waits
        self._frame = settings.map.frame
        self._tracker = tracker
        self._actions = actions
        self._say = say
        self.unreported = UnreportedEvents()
        self._ignored_goals: dict[str, str] = {}
        self.mission = ""
        self.starts = 0
        self.robots = {one.name: TrackedRobot(one, frames[one.tf], one.carrier) for one in settings.robots}

    @property
    def active_commands(self) -> list[ActiveCommand]:
        """The commands that have not ended."""
        # both robots of a docking have the same command: count it once, by identity
        found = {id(robot.active): robot.active for robot in self.robots.values() if robot.active is not None}
        return list(found.values())

    @property
    def driving(self) -> bool:
        """Whether any robot in contact is driving."""
        return any(active.drives and not self._is_away(active) for active in self.active_commands)

    def missing_poses(self, now_s: float, away: Collection[str] = ()) -> list[str]:
        """Return the robots on the ground that tf does not place on the map yet, and the transform each lacks.

        Those `away` are known to be out of contact.
        """
        found = []
        for robot in self.robots.values():
            if robot.name in away:
                continue
            if robot.on_ground and robot.pose(self._frame) is None:
                found.append(f"{robot.name} (no {self._link(robot)})")
            elif robot.on_ground and robot.silence_s(self._frame, now_s) > self._waits.silent_s:
                found.append(f"{robot.name} (no new {self._link(robot)})")
        return found

    def _link(self, robot: TrackedRobot) -> str:
        return f"{self._frame} -> {robot.settings.base_frame} on {robot.settings.tf}"

    def place(self) -> None:
        """Place robots on the ground where tf has them, or on the nearest free ground."""
        for robot in self.robots.values():
            if robot.on_ground and robot.anchor is None:
                robot.anchor = self._standing_point(robot)

    def resume(self, aboard: Mapping[str, str], lost: Collection[str], unreported: UnreportedEvents) -> None:
        """Restore the team: each rover's carrier, the lost robots, and the events still to report."""
        self.unreported = unreported
        for robot in self.robots.values():
            robot.aboard, robot.lost = aboard.get(robot.name), robot.name in lost

    def part(self, names: Iterable[str], now_s: float) -> None:
        """Note that rovers are out of contact."""
        for name in names:
            self.robots[name].away_s = now_s

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
        self._start(active, now_s)

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
        if active is not None and active.drives:
            active.progress.apply_feedback(feedback, now_s)

    def ended(self, end: ActionResult) -> None:
        """Record the end of a goal; ignore earlier goals of a command that was sent again."""
        self._ignored_goals.pop(end.goal, None)
        active = self._active(end.goal)
        if active is None or active.goal is None:
            return
        if succeeded(end):
            self._finish(active, arrived=True)
        elif active.drives and active.cancelled_s is not None:
            self._finish(active, arrived=False)
        elif end.status == GoalStatus.CANCELED and active.cancelled_s is None:
            # somebody else has taken over: the robot did not fail
            self._fail(active, failure_of(active.goal, end), declined=True)
        else:
            self._fail(active, failure_of(active.goal, end))

    def watch(self, now_s: float) -> None:
        """Check robots for missing transforms, and commands for lack of progress."""
        for robot in self.robots.values():
            if robot.lost:
                self._check_return(robot, now_s)
            elif robot.on_ground and robot.settings.kind.radio_range_m is not None:
                self._check_contact(robot, now_s)
            elif robot.on_ground:
                self._check_silence(robot, now_s)
        for active in self.active_commands:
            if not active.drives or not self._is_away(active):
                self._check(active, now_s)

    def stop(self, now_s: float) -> None:
        """Stop all driving robots."""
        for active in self.active_commands:
            if active.drives:
                self._cancel(active, now_s)

    def cancel_all(self, now_s: float) -> None:
        """Cancel every goal, including dockings and abandoned goals that may still be running."""
        self._cancel_ignored_goals()
        for active in self.active_commands:
            self._cancel(active, now_s)

    def report(self) -> News:
        """Return where the robots are and what has happened since the last call."""
        unreported, self.unreported = self.unreported, UnreportedEvents()
        returned: list[str] = []
        if unreported.lost:  # a robot returns after its loss is reported
            self.unreported.returned = unreported.returned
        elif unreported.returned:
            returned = [one for name in unreported.returned for one in self._take_back(name)]
        news: News = {"t_ms": 0, "robots": self.notes()}
        if returned:
            news["returned"] = returned
        if away := [name for name in unreported.contact if self.robots[name].away_s is not None]:
            news["out_of_contact"] = [{"robot": name} for name in away]
        if heard := [name for name in unreported.contact if self.robots[name].away_s is None]:
            news["in_contact"] = heard
        if unreported.declined:
            news["declined"] = unreported.declined
        if unreported.finished:
            news["finished"] = unreported.finished
        if unreported.failed:
            news["failed"] = unreported.failed
        if unreported.lost and unreported.finished:
            # the service accepts no ends from a lost robot: report what it finished first
            self.unreported.lost = unreported.lost
        elif unreported.lost:
            news["lost"] = unreported.lost
        return news

    def notes(self) -> list[RobotNote]:
        """Return where the robots on the ground are (driving ones: on their routes), and charges that are new."""
        found: dict[str, RobotNote] = {}
        for robot in self._standing_or_driving():
            self._update_anchor(robot)
            if robot.anchor is not None:
                found[robot.name] = {"name": robot.name, "pose_m": list(robot.anchor)}
                if robot.speed is not None:
                    found[robot.name]["speed_share"] = robot.speed
        for name, robot in self.robots.items():
            if robot.charge is not None and not robot.lost:
                found.setdefault(name, {"name": name})["charge"] = robot.charge
            robot.charge = None  # reported once: a topic may go silent, and then the mission estimates
        return list(found.values())

    def points(self) -> dict[str, Point]:
        """Return where the robots on the ground are, in metres of the map frame."""
        places = {robot.name: robot.point(self._frame) or robot.anchor for robot in self._standing_or_driving()}
        return {name: point for name, point in places.items() if point is not None}

    def _standing_or_driving(self) -> Iterator[TrackedRobot]:
        """Yield the robots that stand or drive by themselves: all on the ground but docking and undocking rovers."""
        for robot in self.robots.values():
            active = robot.active
            if robot.on_ground and (active is None or active.drives or active.command["robot"] != robot.name):
                yield robot

    def _update_anchor(self, robot: TrackedRobot) -> None:
        """Update the reported place of a robot; one that isn't driving has to be off it by more than the tolerance."""
        at = robot.point(self._frame)
        if at is None:
            return
        if robot.active is not None and robot.active.drives:
            robot.anchor = robot.active.advance(at, self._waits.tolerance_m) or self._standing_point(robot)
        elif robot.anchor is None or math.dist(at, robot.anchor) > self._waits.tolerance_m:
            robot.anchor = self._standing_point(robot)

    def _standing_point(self, robot: TrackedRobot) -> Point | None:
        at = robot.point(self._frame)
        if at is None:
            return robot.anchor
        return self._tracker.standing(robot.settings.kind, at, self._waits.tolerance_m) or at

    def _is_away(self, active: ActiveCommand) -> bool:
        """Return whether the robot of a command is out of contact."""
        return self.robots[active.command["robot"]].away_s is not None

    def _active(self, goal: str) -> ActiveCommand | None:
        return next((one for one in self.active_commands if one.name == goal and one.goal is not None), None)

    def _participants(self, active: ActiveCommand) -> list[TrackedRobot]:
        command = active.command
        names = [command["robot"]] if active.drives else [command["robot"], command["carrier"]]
        return [self.robots[name] for name in names]

    def _start(self, active: ActiveCommand, now_s: float) -> None:
        """Send the goal of a command, or the rest of its drive."""
        goal = self._drive(active) if active.drives else self._handover(active)
        active.since_s = now_s
        active.progress = Progress(moved_s=now_s)
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
        else:
            self._start(active, now_s)

    def _drive(self, active: ActiveCommand) -> ActionGoal | None:
        """Return the goal of a drive from where the robot is now; None if it has arrived."""
        robot = self.robots[active.command["robot"]]
        pose = robot.pose(self._frame)
        if pose is not None and (active.attempt or self.starts):
            active.advance(pose.point, self._waits.tolerance_m)
        route = active.route_m[active.passed :]
        if len(route) < 2:
            return None
        return drive_goal(self._settings, robot.settings, route, 0.0 if pose is None else pose.yaw)

    def _handover(self, active: ActiveCommand) -> ActionGoal:
        rover, carrier = self._participants(active)
        x, y = active.command.get("point_m") or rover.anchor or rover.point(self._frame) or (0.0, 0.0)
        beside = carrier.point(self._frame) or carrier.anchor
        return handover_goal(self._settings, self.mission, active.command, rover.settings, (x, y), beside)

    def _cancel(self, active: ActiveCommand, now_s: float) -> None:
        if active.goal is not None:
            active.cancelled_s = now_s
            self._actions.cancel_goal(active.name, active.goal.action)

    def _release(self, active: ActiveCommand) -> None:
        active.goal = None
        for robot in self._participants(active):
            robot.active = None

    def _finish(self, active: ActiveCommand, *, arrived: bool) -> None:
        """Record a command as finished: a drive at the end of its route, or where it was stopped."""
        rover = self._participants(active)[0]
        command = active.command
        if active.drives:
            at = rover.point(self._frame)
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

    def _abort(self, active: ActiveCommand, reason: str) -> None:
        self._cancel_ignored(active)
        self._fail(active, reason)

    def _cancel_ignored(self, active: ActiveCommand) -> None:
        """Cancel the goal of a command whose end no longer matters."""
        if active.goal is not None:
            self._ignored_goals[active.name] = active.goal.action
            self._actions.cancel_goal(active.name, active.goal.action)

    def _cancel_ignored_goals(self) -> None:
        for name, action in self._ignored_goals.items():
            self._actions.cancel_goal(name, action)

    def _check(self, active: ActiveCommand, now_s: float) -> None:
        """Give up a command that makes no progress; cancel again the goal of a robot that has not stopped."""
        if not active.drives:
            if now_s - active.since_s > self._waits.handover_s:
                self._abort(active, f"not finished after {self._waits.handover_s:g} s")
            return
        at = self.robots[active.command["robot"]].point(self._frame)
        if at is not None:
            active.progress.apply_position(at, now_s)
        if active.cancelled_s is not None:
            if active.progress.standing_s(now_s) > SETTLED_S:
                self._finish(active, arrived=False)
            elif now_s - active.cancelled_s > CANCEL_S:
                self._cancel(active, now_s)
        elif fault := active.progress.fault(now_s, self._waits.stuck_s):
            self._abort(active, fault)

    def _check_silence(self, robot: TrackedRobot, now_s: float) -> None:
        """Tell the user of a robot without new transforms, and mark it as lost after `lost_s`."""
        silent_s = robot.silence_s(self._frame, now_s)
        where = f"no new {self._link(robot)}"
        if silent_s <= self._waits.silent_s:
            if robot.silent:
                self._say(f"{robot.name}: transforms arrive again")
            robot.silent = False
            return
        if not robot.silent:
            robot.silent = True
            self._say(f"{robot.name}: {where} for {silent_s:.0f} s")
            if robot.active is not None and robot.active.drives:
                self._abort(robot.active, f"{where} for {self._waits.silent_s:g} s")
        if silent_s > self._waits.lost_s:
            self._mark_lost(robot, f"{where} for {self._waits.lost_s:g} s")

    def _check_contact(self, robot: TrackedRobot, now_s: float) -> None:
        """Note that a rover with a limited radio has no new transforms, or has some again; its drive goes on meanwhile.

        A drive of which there is no sign that it has begun may not have reached it.
        """
        active = robot.active if robot.active is not None and robot.active.drives else None
        if robot.away_s is None and robot.silence_s(self._frame, now_s) > self._waits.silent_s:
            self._say(f"{robot.name}: out of contact: no new {self._link(robot)} for {self._waits.silent_s:g} s")
            robot.away_s = now_s
            self._update_anchor(robot)
            if active is not None and not active.passed and active.progress.feedback_s < active.since_s:
                self._cancel_ignored(active)
                self._fail(active, "out of contact", declined=True)
        elif robot.away_s is not None and robot.heard_since(self._frame, robot.away_s):
            self._say(f"{robot.name}: in contact again")
            robot.away_s = None
            if active is not None:
                self._resend(active, now_s)
        else:
            return
        self.unreported.contact = [*(name for name in self.unreported.contact if name != robot.name), robot.name]

    def _check_return(self, robot: TrackedRobot, now_s: float) -> None:
        """Note that a lost robot has transforms again; it returns with the next report."""
        if robot.aboard is not None or robot.name in self.unreported.returned:
            return
        if robot.silence_s(self._frame, now_s) <= self._waits.silent_s:
            self._say(f"{robot.name}: returned: transforms arrive again")
            self.unreported.returned.append(robot.name)

    def _take_back(self, name: str) -> list[str]:
        """Let a lost robot act again, with the rovers aboard it; return them."""
        found = [one for one in self.robots.values() if one.lost and name in (one.name, one.aboard)]
        for robot in found:
            robot.lost, robot.silent = False, False
            if robot.on_ground:
                robot.anchor = self._standing_point(robot)
        return [robot.name for robot in found]

    def _mark_lost(self, robot: TrackedRobot, reason: str) -> None:
        self._say(f"{robot.name}: lost: {reason}")
        if robot.active is not None:
            self._cancel_ignored(robot.active)
            self._release(robot.active)
        robot.lost = True
        self.unreported.lost.append({"robot": robot.name, "reason": reason})
        for rider in self.robots.values():
            rider.lost = rider.lost or rider.aboard == robot.name

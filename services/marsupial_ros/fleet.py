"""The team in ROS: commands become goals; the ends of goals and the robots' places become reports."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from marsupial_client.mission_documents import Command, Failed, Lost, News, RobotNote
from marsupial_ros.chart import Chart
from marsupial_ros.goals import ActionGoal, drive_goal, failure_of, handover_goal, succeeded
from marsupial_ros.robots import Errand, Progress, TrackedRobot
from marsupial_ros.rosbridge import ActionResult, Rosbridge
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

    @property
    def any(self) -> bool:
        """Whether anything has happened."""
        return bool(self.finished or self.failed or self.lost)


class RobotFleet:
    """The robots of a mission; `frames` has their transforms by topic, `say` shows the user a line.

    Names of goals contain the id of the `mission` and how often it was resumed before (`starts`), so each name is used
    only once. `gathered` goes into the next report.
    """

    def __init__(
        self,
        settings: Settings,
        frames: Mapping[str, Frames],
        chart: Chart,
        actions: Rosbridge,
        say: Callable[[str], None],
    ) -> None:
        self._settings = settings
        self._waits = settings.waits
        self._frame = settings.map.frame
        self._chart = chart
        self._actions = actions
        self._say = say
        self.gathered = UnreportedEvents()
        self._given_up: dict[str, str] = {}
        self.mission = ""
        self.starts = 0
        self.robots = {one.name: TrackedRobot(one, frames[one.tf], one.carrier) for one in settings.robots}

    @property
    def errands(self) -> list[Errand]:
        """The commands that have not ended."""
        # two robots share the errand of a docking: count it once, by identity
        found = {id(robot.errand): robot.errand for robot in self.robots.values() if robot.errand is not None}
        return list(found.values())

    @property
    def driving(self) -> bool:
        """Whether any robot is driving."""
        return any(errand.drives for errand in self.errands)

    def unplaced(self, now_s: float) -> list[str]:
        """Return the robots on the ground that tf does not place on the map yet, and the transform each lacks."""
        found = []
        for robot in self.robots.values():
            if robot.on_ground and robot.pose(self._frame) is None:
                found.append(f"{robot.name} (no {self._link(robot)})")
            elif robot.on_ground and robot.silent_for(self._frame, now_s) > self._waits.silent_s:
                found.append(f"{robot.name} (no new {self._link(robot)})")
        return found

    def _link(self, robot: TrackedRobot) -> str:
        return f"{self._frame} -> {robot.settings.base_frame} on {robot.settings.tf}"

    def place(self) -> None:
        """Place robots on the ground where tf has them, or on the nearest free ground."""
        for robot in self.robots.values():
            if robot.on_ground and robot.anchor is None:
                robot.anchor = self._standing(robot)

    def take_up(self, aboard: Mapping[str, str], lost: Collection[str], gathered: UnreportedEvents) -> None:
        """Restore the team: each rover's carrier, the lost robots, and the events still to report."""
        self.gathered = gathered
        for robot in self.robots.values():
            robot.aboard, robot.lost = aboard.get(robot.name), robot.name in lost

    def obey(self, command: Command, now_s: float) -> None:
        """Carry out a command."""
        robot = self.robots[command["robot"]]
        if command["name"] == "stop":
            if robot.errand is not None and robot.errand.command["id"] == command["id"]:
                self._cancel(robot.errand, now_s)
            return
        errand = Errand(command)
        team = self._taking_part(errand)
        # the service commands a lost robot until its loss is reported, one report after the commands it finished
        if any(one.lost for one in team):
            return
        for one in team:
            one.errand = errand
        self._start(errand, now_s)

    def connected(self, now_s: float) -> None:
        """Resend all goals: they, or the messages that they ended, may be lost."""
        self._cancel_given_up()
        for robot in self.robots.values():
            robot.since_s = now_s  # no transforms could arrive while disconnected
        for errand in self.errands:
            if errand.cancelled_s is not None:
                self._cancel(errand, now_s)
            else:
                self._start(errand, now_s)

    def hear(self, goal: str, feedback: Mapping[str, Any], now_s: float) -> None:
        """Apply the feedback of a drive; ignore feedback of earlier goals."""
        errand = self._errand(goal)
        if errand is not None and errand.drives:
            errand.progress.hear(feedback, now_s)

    def ended(self, end: ActionResult) -> None:
        """Record the end of a goal; ignore earlier goals of a command that was sent again."""
        self._given_up.pop(end.goal, None)
        errand = self._errand(end.goal)
        if errand is None or errand.goal is None:
            return
        if succeeded(end):
            self._finish(errand, arrived=True)
        elif errand.drives and errand.cancelled_s is not None:
            self._finish(errand, arrived=False)
        else:
            self._fail(errand, failure_of(errand.goal, end))

    def watch(self, now_s: float) -> None:
        """Check robots for missing transforms, and commands for lack of progress."""
        for robot in self.robots.values():
            if robot.on_ground:
                self._listen(robot, now_s)
        for errand in self.errands:
            self._check(errand, now_s)

    def stop(self, now_s: float) -> None:
        """Stop all driving robots."""
        for errand in self.errands:
            if errand.drives:
                self._cancel(errand, now_s)

    def abandon(self, now_s: float) -> None:
        """Cancel every goal, including dockings and abandoned goals that may still be running."""
        self._cancel_given_up()
        for errand in self.errands:
            self._cancel(errand, now_s)

    def report(self) -> News:
        """Return where the robots are and what has happened since the last call."""
        gathered, self.gathered = self.gathered, UnreportedEvents()
        news: News = {"t_ms": 0, "robots": self.notes()}
        if gathered.finished:
            news["finished"] = gathered.finished
        if gathered.failed:
            news["failed"] = gathered.failed
        if gathered.lost and gathered.finished:
            # the service accepts no ends from a lost robot: report what it finished first
            self.gathered.lost = gathered.lost
        elif gathered.lost:
            news["lost"] = gathered.lost
        return news

    def notes(self) -> list[RobotNote]:
        """Return where the robots on the ground are; for driving robots, their points on the route."""
        found: list[RobotNote] = []
        for robot in self._grounded():
            self._follow(robot)
            if robot.anchor is not None:
                found.append({"name": robot.name, "pose_m": list(robot.anchor)})
        return found

    def points(self) -> dict[str, Point]:
        """Return where the robots on the ground are, in metres of the map frame."""
        places = {robot.name: robot.point(self._frame) or robot.anchor for robot in self._grounded()}
        return {name: point for name, point in places.items() if point is not None}

    def _grounded(self) -> Iterator[TrackedRobot]:
        """Yield the robots that stand or drive by themselves: all on the ground but docking and undocking rovers."""
        for robot in self.robots.values():
            errand = robot.errand
            if robot.on_ground and (errand is None or errand.drives or errand.command["robot"] != robot.name):
                yield robot

    def _follow(self, robot: TrackedRobot) -> None:
        """Update the reported place of a robot; one that isn't driving has to be off it by more than the tolerance."""
        at = robot.point(self._frame)
        if at is None:
            return
        if robot.errand is not None and robot.errand.drives:
            robot.anchor = robot.errand.pass_by(at, self._waits.tolerance_m) or self._standing(robot)
        elif robot.anchor is None or math.dist(at, robot.anchor) > self._waits.tolerance_m:
            robot.anchor = self._standing(robot)

    def _standing(self, robot: TrackedRobot) -> Point | None:
        at = robot.point(self._frame)
        if at is None:
            return robot.anchor
        return self._chart.standing(robot.settings.kind, at, self._waits.tolerance_m) or at

    def _errand(self, goal: str) -> Errand | None:
        return next((one for one in self.errands if one.name == goal and one.goal is not None), None)

    def _taking_part(self, errand: Errand) -> list[TrackedRobot]:
        command = errand.command
        names = [command["robot"]] if errand.drives else [command["robot"], command["carrier"]]
        return [self.robots[name] for name in names]

    def _start(self, errand: Errand, now_s: float) -> None:
        """Send the goal of a command, or the rest of its drive."""
        goal = self._drive(errand) if errand.drives else self._handover(errand)
        errand.since_s = now_s
        errand.progress = Progress(moved_s=now_s)
        if goal is None:
            self._finish(errand, arrived=True)
            return
        errand.attempt += 1
        errand.goal = goal
        # a name of its own: the end of an earlier goal must not end this one
        errand.name = f"{self.mission}:{errand.command['id']}:{self.starts}.{errand.attempt}"
        self._actions.send_goal(errand.name, goal.action, goal.type, goal.values)

    def _drive(self, errand: Errand) -> ActionGoal | None:
        """Return the goal of a drive from where the robot is now; None if it has arrived."""
        robot = self.robots[errand.command["robot"]]
        pose = robot.pose(self._frame)
        if pose is not None and (errand.attempt or self.starts):
            errand.pass_by((pose.x, pose.y), self._waits.tolerance_m)
        route = errand.route_m[errand.passed :]
        if len(route) < 2:
            return None
        return drive_goal(self._settings, robot.settings, route, 0.0 if pose is None else pose.yaw)

    def _handover(self, errand: Errand) -> ActionGoal:
        rover, carrier = self._taking_part(errand)
        x, y = errand.command.get("point_m") or rover.anchor or rover.point(self._frame) or (0.0, 0.0)
        beside = carrier.point(self._frame) or carrier.anchor
        return handover_goal(self._settings, self.mission, errand.command, rover.settings, (x, y), beside)

    def _cancel(self, errand: Errand, now_s: float) -> None:
        if errand.goal is not None:
            errand.cancelled_s = now_s
            self._actions.cancel_goal(errand.name, errand.goal.action)

    def _release(self, errand: Errand) -> None:
        errand.goal = None
        for robot in self._taking_part(errand):
            robot.errand = None

    def _finish(self, errand: Errand, *, arrived: bool) -> None:
        """Record a command as finished: a drive at the end of its route, or where it was stopped."""
        rover = self._taking_part(errand)[0]
        command = errand.command
        if errand.drives:
            at = rover.point(self._frame)
            end = errand.route_m[-1]
            near = at is None or math.dist(at, end) <= self._waits.tolerance_m
            # an action may wrongly report success: then report where the robot really is
            if arrived and near:
                rover.anchor = end
            else:
                self._follow(rover)
        else:
            rover.aboard = command["carrier"] if command["name"] == "dock" else None
            x, y = command.get("point_m") or (0.0, 0.0)
            rover.anchor = (x, y) if command["name"] == "undock" else None
        self._release(errand)
        self.gathered.finished.append(command["id"])

    def _fail(self, errand: Errand, reason: str) -> None:
        if errand.drives:
            self._follow(self._taking_part(errand)[0])
        self._release(errand)
        self.gathered.failed.append({"id": errand.command["id"], "reason": reason})
        self._say(f"{errand.command['robot']}: {errand.command['name']} failed: {reason}")

    def _give_up(self, errand: Errand, reason: str) -> None:
        self._drop(errand)
        self._fail(errand, reason)

    def _drop(self, errand: Errand) -> None:
        """Cancel the goal of a command whose end no longer matters."""
        if errand.goal is not None:
            self._given_up[errand.name] = errand.goal.action
            self._actions.cancel_goal(errand.name, errand.goal.action)

    def _cancel_given_up(self) -> None:
        for name, action in self._given_up.items():
            self._actions.cancel_goal(name, action)

    def _check(self, errand: Errand, now_s: float) -> None:
        """Give up a command that makes no progress; cancel again the goal of a robot that has not stopped."""
        if not errand.drives:
            if now_s - errand.since_s > self._waits.handover_s:
                self._give_up(errand, f"not finished after {self._waits.handover_s:g} s")
            return
        at = self.robots[errand.command["robot"]].point(self._frame)
        if at is not None:
            errand.progress.see(at, now_s)
        if errand.cancelled_s is not None:
            if errand.progress.stood_for(now_s) > SETTLED_S:
                self._finish(errand, arrived=False)
            elif now_s - errand.cancelled_s > CANCEL_S:
                self._cancel(errand, now_s)
        elif fault := errand.progress.fault(now_s, self._waits.stuck_s):
            self._give_up(errand, fault)

    def _listen(self, robot: TrackedRobot, now_s: float) -> None:
        """Tell the user of a robot without new transforms, and mark it as lost after `lost_s`."""
        silent_s = robot.silent_for(self._frame, now_s)
        where = f"no new {self._link(robot)}"
        if silent_s <= self._waits.silent_s:
            if robot.silent:
                self._say(f"{robot.name}: transforms arrive again")
            robot.silent = False
            return
        if not robot.silent:
            robot.silent = True
            self._say(f"{robot.name}: {where} for {silent_s:.0f} s")
            if robot.errand is not None and robot.errand.drives:
                self._give_up(robot.errand, f"{where} for {self._waits.silent_s:g} s")
        if silent_s > self._waits.lost_s:
            self._lose(robot, f"{where} for {self._waits.lost_s:g} s")

    def _lose(self, robot: TrackedRobot, reason: str) -> None:
        self._say(f"{robot.name}: lost: {reason}")
        if robot.errand is not None:
            self._drop(robot.errand)
            self._release(robot.errand)
        robot.lost = True
        self.gathered.lost.append({"robot": robot.name, "reason": reason})
        for rider in self.robots.values():
            rider.lost = rider.lost or rider.aboard == robot.name

"""Watch the robots of a mission while they carry out commands: which are late, stuck, out of contact or lost."""

from marsupial_ros.commands import CommandedTeam
from marsupial_ros.robots import ActiveCommand, Takeover, TrackedRobot
from marsupial_ros.transport import Refusal

# a map that is not renewed for this long has stalled: the user is told, and robots that have arrived wait no longer
MAP_LATE_S = 30.0
# pause between cancellations of a goal: rosbridge ignores them until the action has accepted the goal
CANCEL_S = 1.0
# a robot told to stop counts as stopped once it has stood this long, even if its action says nothing
SETTLED_S = 3.0


class RobotFleet(CommandedTeam):
    """The robots of a mission; call `watch` often."""

    def watch(self, now_s: float) -> None:
        """Check robots for missing transforms, and commands for lack of progress."""
        for robot in self.robots.values():
            if robot.lost:
                self._check_return(robot, now_s)
            elif robot.on_ground and robot.settings.kind.radio_range_m is not None:
                self._check_contact(robot, now_s)
            elif robot.on_ground:
                self._check_silence(robot, now_s)
        for robot in self.robots.values():
            if robot.taken is not None:
                self._check_takeover(robot, robot.taken, now_s)
        for active in self.active_commands:
            if active.arrived_s is not None:
                # until a map is made that shows what the robot sees, its frontier would count as still unknown
                active.arrived_s = min(active.arrived_s, now_s)
                if self._tracker.made_s > active.arrived_s or now_s - active.arrived_s > MAP_LATE_S:
                    self._finish(active, arrived=True)
            elif active.goal is None:
                self._send(active, now_s)
            elif not active.drives or not self._is_away(active):
                self._check(active, now_s)

    def _check_takeover(self, robot: TrackedRobot, taken: Takeover, now_s: float) -> None:
        """Lead a robot again once it stands idle; only then it is clear how its last drive ended."""
        at, surely = robot.point, taken.surely
        idle = at is not None and taken.idle(at, now_s)
        if taken.surely and not surely:
            self._tell_takeover(robot)
        if not idle:
            return
        robot.taken = None
        active = robot.active
        if active is not None and active.replaced:
            self._fail(active, active.replaced, declined=taken.surely)

    def _check(self, active: ActiveCommand, now_s: float) -> None:
        """Give up a command that makes no progress; cancel again the goal of a robot that has not stopped."""
        if not active.drives:
            if now_s - active.since_s > self._waits.handover_s:
                self._abort(active, f"not finished after {self._waits.handover_s:g} s")
            return
        at = self.robots[active.command["robot"]].point
        if at is not None:
            active.progress.apply_position(at, now_s)
        if active.cancelled_s is not None:
            if active.progress.standing_s(now_s) > SETTLED_S:
                self._finish(active, arrived=False)
            elif now_s - active.cancelled_s > CANCEL_S:
                self._cancel(active, now_s)
        elif fault := active.progress.fault(now_s, self._waits.stuck_s):
            if active.goal is not None and not active.begun:
                # rosbridge up to 2.1 does not say that a goal was rejected, or has no action server
                self._cancel_ignored(active)
                self._put_off(active, active.goal, Refusal.UNANSWERED, f"no answer for {self._waits.stuck_s:g} s")
            else:
                self._abort(active, fault)

    def _check_silence(self, robot: TrackedRobot, now_s: float) -> None:
        """Tell the user of a robot without new transforms, and mark it as lost after `lost_s`."""
        silent_s = robot.silence_s(now_s)
        where = robot.lacks
        if silent_s <= self._waits.silent_s:
            if robot.silent:
                self._say(f"{robot.name}: transforms arrive again")
            robot.silent = False
            return
        if not robot.silent:
            robot.silent = True
            self._say(f"{robot.name}: {where} for {silent_s:.0f} s")
            if robot.active is not None and robot.active.drives:
                # no failure of the robot: a busy machine passes transforms on late, and three failures would lose it
                self._abort(robot.active, f"{where} for {self._waits.silent_s:g} s", declined=True)
        if silent_s > self._waits.lost_s:
            self._mark_lost(robot, f"{where} for {self._waits.lost_s:g} s")

    def _check_contact(self, robot: TrackedRobot, now_s: float) -> None:
        """Note that a rover with a limited radio has no new transforms, or has some again; its drive goes on meanwhile.

        A drive of which there is no sign that it has begun may not have reached it.
        """
        active = robot.active if robot.active is not None and robot.active.drives else None
        if robot.away_s is None and robot.silence_s(now_s) > self._waits.silent_s:
            self._say(f"{robot.name}: out of contact: {robot.lacks} for {self._waits.silent_s:g} s")
            robot.away_s = now_s
            self._update_anchor(robot)
            if active is not None and not active.begun:
                self._abort(active, "out of contact", declined=True)
        elif robot.away_s is not None and robot.heard_since(robot.away_s):
            self._say(f"{robot.name}: in contact again")
            robot.away_s = None
            if active is not None:
                self._resend(active, now_s)
        else:
            return
        self.unreported.contact = [*(name for name in self.unreported.contact if name != robot.name), robot.name]

    def _check_return(self, robot: TrackedRobot, now_s: float) -> None:
        """Note that a lost robot has transforms again; it returns with the next report."""
        carrier = robot.aboard
        if robot.name in self.unreported.returned or (carrier is not None and self.robots[carrier].lost):
            return  # rovers aboard return with their carrier
        if robot.lost_s is not None and now_s - robot.lost_s < self._trial_s(robot):
            return
        if robot.aboard is None and not robot.has_place(now_s, self._waits.silent_s):
            return
        self._say(
            f"{robot.name}: returned: {'transforms arrive again' if robot.lost_s is None else 'it is tried again'}"
        )
        self.unreported.returned.append(robot.name)

    def _trial_s(self, robot: TrackedRobot) -> float:
        """Return after how many seconds a robot that failed is tried again: longer each time."""
        return self._waits.lost_s * 2.0 ** (robot.losses - 1)

    def count_lost(self, name: str, reason: str, now_s: float) -> None:
        """Note that the service counts a robot as lost: its commands failed."""
        robot = self.robots[name]
        if robot.lost:
            return
        robot.losses += 1
        robot.lost_s = now_s
        self._lose(robot)
        self._say(f"{name}: lost: {reason}; see to it: it is tried again in {self._trial_s(robot):g} s")

    def _mark_lost(self, robot: TrackedRobot, reason: str) -> None:
        self._say(f"{robot.name}: lost: {reason}")
        self._lose(robot)
        self.unreported.lost.append({"robot": robot.name, "reason": reason})
        for rider in self.robots.values():
            rider.lost = rider.lost or rider.aboard == robot.name

    def _lose(self, robot: TrackedRobot) -> None:
        robot.lost = True
        if robot.active is not None:
            self._cancel_ignored(robot.active)
            self._release(robot.active)

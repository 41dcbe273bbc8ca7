"""The loop of one mission: messages from ROS become reports, commands of the mission become goals.

The bridge sends a report once it has the commands that answer the last one, so a slow service gets fewer reports.
Meanwhile the robots carry on, and the bridge collects what happens.
"""

import asyncio
import json
import math
from collections.abc import Callable, Collection, Sequence
from contextlib import aclosing, suppress
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

from marsupial.errors import InputError
from marsupial.formats.scenario.write import task_document
from marsupial.formats.scenario.zones import zone_fields
from marsupial.model.grid import OBSTACLE, Cell, Grid
from marsupial_client import AsyncClient, AsyncMission, Conflict, Invalid, Refused, TooLarge
from marsupial_client.mission_documents import Brief, MissionEnded, Report
from marsupial_ros.fleet import CANCEL_S, MAP_LATE_S, RobotFleet
from marsupial_ros.followed_plan import FollowedPlan
from marsupial_ros.journal import Journal, Record
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.ros_listener import Clock, RosListener
from marsupial_ros.settings import Settings
from marsupial_ros.team import UnreportedEvents
from marsupial_ros.transforms import Frames, Point
from marsupial_ros.transport import RosTransport, first_of

# pause between checks of the robots: checking dozens of them takes less than a hundredth of that
TICK_S = 0.05
# pause between reminders of what is missing before a mission can begin
REMIND_S = 10.0
# pause between subscriptions to topics that stay silent while something is missing
RENEW_S = 10.0
# pause between questions for the action servers, and how long the answer to the first may take
ASK_S, ANSWER_S = 1.0, 3.0
# how long the service may take to end a mission when the user asks; after that the bridge leaves
STOP_S = 30.0
# how long the service may be unreachable; robots finish their drives meanwhile, and wait
PATIENCE_S = 300.0
# how long cancelled goals may take to end when the bridge ends
LEAVE_S = 5.0
# how long sending the remaining messages may take after that
FLUSH_S = 2.0
# how often to resend a report that crossed with new commands, with the robots' places at that moment
CONFLICTS = 3


@dataclass(slots=True)
class BridgeOutcome:
    """How a run ended: the mission's own end, or None if the bridge left before; the mission's id, if there was one."""

    ended: MissionEnded | None = None
    mission: str | None = None


class Bridge:
    """Drives one mission over a transport of the `subscriptions`.

    `stops` counts the user's stop requests: one ends the mission, two leave at once.
    """

    def __init__(
        self,
        settings: Settings,
        transport: RosTransport,
        client: AsyncClient,
        journal: Journal,
        say: Callable[[str], None],
        stops: Callable[[], int],
    ) -> None:
        self._settings = settings
        self._client = client
        self._journal = journal
        self._say = say
        self._stops = stops
        self._clock = Clock(simulated=settings.clock is not None)
        one = settings.map
        self._tracker = MapTracker(settings.terrains, one.masks, one.free_thresh, one.occupied_thresh)
        frames = {robot.tf: Frames() for robot in settings.robots}
        self._ros = transport
        self._fleet = RobotFleet(settings, frames, self._tracker, self._ros, say)
        self._listener = RosListener(settings, frames, self._tracker, self._clock, self._fleet, say, transport.name)
        self._record = Record(mission="", frame={})
        self._reported_ms = 0
        self._over = False
        self._said: set[str] = set()
        self._missed: list[str] = []
        self._stalled = False
        self.outcome = BridgeOutcome()
        self.mission: AsyncMission | None = None
        self.state = "waiting"  # of the mission, with its reason
        self.plan = FollowedPlan()

    async def run(self) -> BridgeOutcome:
        """Drive the mission until it ends or the user leaves. Raises UsageError, InputError, ClientError."""
        record = self._journal.read()
        if record is not None:
            if others := sorted(record.robots - self._fleet.robots.keys()):
                raise InputError(
                    f"belongs to a mission with other robots: {', '.join(others)}", source=str(self._journal.path)
                )
            self._tracker.expect(record.frame)
        connection = asyncio.ensure_future(self._ros.run(self._listener))
        try:
            # the end of the connection is an error; the shield keeps it open while goals are cancelled
            await first_of(asyncio.shield(connection), self._mission(record), self._watch())
        finally:
            try:
                await self._cancel_goals(connection)
            finally:
                connection.cancel()
                await asyncio.gather(connection, return_exceptions=True)
        return self.outcome

    @property
    def fleet(self) -> RobotFleet:
        return self._fleet

    def point_m(self, cell: Sequence[int]) -> Point:
        """Return the centre of a cell of the mission's frame, in metres of the map frame."""
        return self._tracker.point_m(Cell(*cell))

    async def _cancel_goals(self, connection: asyncio.Future[None]) -> None:
        """Cancel all goals and wait briefly for their ends."""
        loop = asyncio.get_running_loop()
        until_s = loop.time() + LEAVE_S
        self._fleet.cancel_all(self._clock.now_s)
        again_s = loop.time() + CANCEL_S
        while self._fleet.goals and not connection.done() and loop.time() < until_s:
            await asyncio.sleep(TICK_S)
            if loop.time() > again_s:
                self._fleet.cancel_all(self._clock.now_s)
                again_s = loop.time() + CANCEL_S
        for active in self._fleet.goals:
            command = active.command
            self._say(f"{command['robot']}: {command['name']} was cancelled, but its end was not confirmed")
        with suppress(TimeoutError):
            await asyncio.wait_for(self._ros.flush(), FLUSH_S)

    async def _mission(self, record: Record | None) -> None:
        """Wait for the team, begin or resume the mission, and drive it to its end."""
        await self._wait_for_team(record)
        mission = await (self._begin() if record is None else self._resume(record))
        self.mission, self.outcome.mission = mission, mission.id
        self.state = mission.document["state"]
        await first_of(self._events(mission), self._reports(mission))

    async def _watch(self) -> None:
        """Check the robots until the user asks to leave at once, or a mission that should end does not."""
        loop = asyncio.get_running_loop()
        stopping, until_s, renewed_s = False, math.inf, loop.time()
        while self._stops() < 2 and not (self._stops() and self.outcome.mission is None) and loop.time() < until_s:
            if self._ros.open and self._clock.known and self.outcome.mission is not None:
                self._fleet.watch(self._clock.now_s)
                for text in self._left_out():
                    self._once(f"{text} (does more than one node publish it, or did the mapper begin anew?)")
                self._check_map()
            if loop.time() > renewed_s + RENEW_S:
                renewed_s = loop.time()
                began = self.outcome.mission is not None
                if self._fleet.missing_poses(self._clock.now_s) if began else self._missed:
                    self._ros.renew()
            if self._stops() and not stopping:
                stopping, until_s = True, loop.time() + STOP_S
                self._fleet.stop(self._clock.now_s)
            await asyncio.sleep(TICK_S)

    def _check_map(self) -> None:
        """Tell the user when maps stop, and when they go on."""
        late = self._tracker.repeats and self._clock.now_s > self._tracker.made_s + MAP_LATE_S
        topic = self._settings.map.topic
        if late != self._stalled:
            self._say(f"no map on {topic} for {MAP_LATE_S:g} s" if late else f"maps arrive on {topic} again")
        self._stalled = late

    async def _wait_for_team(self, record: Record | None) -> None:
        """Wait until there is a map and every robot in contact has a place on it; meanwhile say what is missing."""
        said, said_s, asked_s, first_s = None, 0.0, -math.inf, math.inf
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        while True:
            missing = self._missed = self._missing(() if record is None else record.away, begins=record is None)
            answered = record is not None or self._ros.servers_known or loop.time() > first_s + ANSWER_S
            if answered and not missing:
                return
            if self._ros.open and loop.time() > asked_s + ASK_S:
                self._ros.ask_for_servers(self._fleet.actions)
                asked_s, first_s = loop.time(), min(first_s, loop.time())
            if missing and (missing != said or loop.time() > said_s + REMIND_S):
                self.state = f"waiting for {'; '.join(missing)}"
                self._say(self.state)
                said, said_s = missing, loop.time()
            if self._ros.open and loop.time() > began_s + REMIND_S and missing != self._absent():  # a topic is missing
                topic = self._settings.map.topic
                self._once(f"{self._ros.hint}; `ros2 topic info -v {topic}` shows who publishes")
            await asyncio.sleep(2 * TICK_S)

    def _missing(self, away: Collection[str], *, begins: bool) -> list[str]:
        if not self._ros.open:
            return [f"{self._ros.name} at {self._ros.url}"]
        found = [] if self._clock.known else [f"the time on {self._settings.clock}"]
        if self._tracker.grid is None:
            found.append(f"a map on {self._settings.map.topic}")
        elif begins:  # a mission can begin only with places on its map
            found += self._left_out() + self._absent()
        return found + self._fleet.missing_poses(self._clock.now_s, away)

    def _absent(self) -> list[str]:
        """Return the action servers that do not exist, if anybody can tell."""
        actions = self._fleet.actions
        servers = actions if self._ros.servers is None else self._ros.servers
        return [f"{one}, an action server" for one in actions if one not in servers]

    def _left_out(self) -> list[str]:
        return [f"{self._settings.map.topic} does not contain {name}" for name in self._fleet.off_map()]

    async def _begin(self) -> AsyncMission:
        grid = self._tracker.begin()
        self._fleet.place()
        for point in self._settings.chargers:
            if _charger(grid, point) is None:
                self._say(f"the charging place at {list(point)} is left out: it is not on the free ground of the map")
        brief = brief_of(self._settings, grid, self._fleet)
        mission = await self._client.begin(brief)
        self._clock.begin()
        self._record = Record(mission=mission.id, frame=dict(brief["frame"]))
        self._fleet.mission = mission.id
        self._save()
        self._say(f"mission {mission.id} started")
        return mission

    async def _resume(self, record: Record) -> AsyncMission:
        """Resume a mission: resend the report that may not have arrived, and all goals."""
        mission = await self._client.mission(record.mission)
        if record.report is not None and mission.n < record.report["n"]:
            await self._deliver(mission, record.report, conflicts=0)
        self._tracker.resume(await mission.known_map())
        self._clock.begin((await mission.refresh())["t_ms"])
        self._record = record
        self._record.report = None
        self._record.starts += 1
        self._fleet.mission, self._fleet.starts = mission.id, record.starts
        self._fleet.resume(record.aboard, record.lost, UnreportedEvents(**record.unreported))
        self._fleet.place()
        for command in record.active_commands:
            self._fleet.execute(command, self._clock.now_s)
        self._fleet.part(record.away, self._clock.now_s)
        self._save()
        self._say(f"mission {mission.id} resumed after report {mission.n}")
        return mission

    async def _events(self, mission: AsyncMission) -> None:
        async with aclosing(mission.events(self._record.after)) as events:
            async for event in events:
                if event.type == "commands":
                    self._record.answered, self._record.until_ms = event.data["n"], event.data["until_ms"]
                    for command in event.data["commands"]:
                        self._fleet.execute(command, self._clock.now_s)
                elif event.type == "state":
                    reason = event.data.get("reason", "")
                    self.state = event.data["state"] + (f": {reason}" if reason else "")
                    self._say(f"mission {self.state}")
                elif event.type == "end":
                    self.outcome.ended = event.data
                    self.state = f"{event.data['status']}: {event.data['reason']}"
                    self._journal.forget()
                    return
                elif event.type == "log":
                    self.plan.take(event.data)
                lost = _lost(event.data) if event.type == "log" else None
                if lost is not None:
                    self._fleet.count_lost(*lost, self._clock.now_s)
                if event.type != "log" or lost is not None:
                    self._record.after = event.id
                    self._save()

    async def _reports(self, mission: AsyncMission) -> None:
        """Report whenever something has happened, and end the mission when the user asks."""
        stopped = False
        while True:
            if self._stops() == 1 and not stopped:  # a second request doesn't change that
                stopped = True
                await mission.cancel()
            elif self._due(mission.n):
                await self._report(mission)
            await asyncio.sleep(TICK_S)

    def _due(self, n: int) -> bool:
        """Return whether a report is due after report `n`."""
        until_ms = self._record.until_ms
        if self._over or until_ms is None or self._record.answered < n:
            return False
        now_ms = self._clock.mission_ms
        if n == 0 or self._fleet.unreported.any or now_ms >= until_ms:
            return True
        passed = now_ms - self._reported_ms >= 1000 * self._settings.waits.report_s
        return passed and (self._fleet.driving or self._tracker.fresh)

    async def _report(self, mission: AsyncMission) -> None:
        """Report to the service what has happened since the last report."""
        self._reported_ms = self._clock.mission_ms
        places = self._fleet.points()
        # before the team's news: its places are those of the frame that has grown
        frame, revealed = self._tracker.changes(places) if self._tracker.fresh and places else (None, [])
        report: Report = {**self._fleet.report(), "t_ms": self._reported_ms, "n": mission.n + 1}
        if frame is not None:
            report["frame"], report["revealed"] = frame, revealed
        await self._deliver(mission, report)

    async def _deliver(self, mission: AsyncMission, report: Report, conflicts: int = CONFLICTS) -> None:
        """Send a report without what the service refuses of it: robots that are out must not lose their mission."""
        while True:
            self._record.report = report
            self._save()  # before sending: the report may arrive even if the bridge dies
            try:
                self._over = await mission.report(report) is None
                break
            except (Conflict, Invalid, TooLarge) as error:
                if isinstance(error, Conflict) and conflicts:
                    conflicts -= 1
                    await asyncio.sleep(1)
                    report["robots"] = self._fleet.notes()
                    continue
                self._record.report = None
                self._save()
                left = _without(report, error)
                if left is None:
                    raise
                self._once(f"left out of a report: {error}")
                if left.keys() != report.keys():  # cells that the service has not taken are to be reported again
                    self._tracker.resume(await mission.known_map())
                report = left
        self._record.report = None

    def _once(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._say(text)

    def _save(self) -> None:
        record = self._record
        record.active_commands = [active.command for active in self._fleet.active_commands]
        record.aboard = {r.name: r.aboard for r in self._fleet.robots.values() if r.aboard is not None}
        record.unreported = asdict(self._fleet.unreported)
        record.away = [robot.name for robot in self._fleet.robots.values() if robot.away_s is not None]
        record.lost = [robot.name for robot in self._fleet.robots.values() if robot.lost]
        self._journal.write(record)


def _without(report: Report, error: Refused) -> Report | None:
    """Return a report without the entries that its refusal names; None if it names none."""
    named: dict[str, set[str]] = {}
    for one in error.errors:
        _, key, place, *_ = *str(one.get("pointer", "")).split("/"), "", "", ""
        named.setdefault(key, set()).add(place)
    if "frame" in named or isinstance(error, TooLarge):  # cells are those of the frame
        named |= {"frame": {""}, "revealed": {""}}
    left: dict[str, Any] = {}
    for key, value in report.items():
        if key not in named or key in ("n", "t_ms"):
            left[key] = value
        elif isinstance(value, list) and "" not in named[key]:
            left[key] = [one for place, one in enumerate(value) if str(place) not in named[key]]
    return None if left == report else cast(Report, left)


def _lost(line: str) -> tuple[str, str] | None:
    """Return the robot that a line of the mission log says is lost, and why."""
    if not line.startswith('{"event":"lost"'):  # other lines have whole maps
        return None
    told = json.loads(line)
    return told["robot"], told["reason"]


def _charger(grid: Grid, point: Point) -> Cell | None:
    """Return the cell of a charging place; None if the map does not have it, or has an obstacle there."""
    cell = grid.cell_at_m(*point)
    return cell if grid.contains(cell) and grid.cells[cell.y, cell.x] != OBSTACLE else None


def brief_of(settings: Settings, grid: Grid, fleet: RobotFleet) -> Brief:
    """Return the brief for a team with known places, in the frame of the map, none of whose cells is reported yet."""
    planning = settings.planning
    team = []
    for robot in fleet.robots.values():
        where = {"carrier": robot.aboard} if robot.anchor is None else {"pose_m": list(robot.anchor)}
        team.append({"name": robot.name, "type": robot.settings.kind.name, **where})
    chargers = tuple(cell for point in settings.chargers if (cell := _charger(grid, point)) is not None)
    grid = replace(grid, chargers=chargers)
    task = task_document(grid, settings.kinds, settings.goal, settings.limits, planning.planning_time)
    document = {"name": settings.name, **task, "team": team, "budget": {"seconds": planning.budget_s}}
    chosen: dict[str, Any] = {"strategy": planning.strategy, "planner": planning.planner}
    chosen["zones"] = list(map(zone_fields, settings.zones)) or None
    return cast(Brief, document | {key: value for key, value in chosen.items() if value is not None})

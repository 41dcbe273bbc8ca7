"""The simulator: robots drive through a hidden map, dock, and reveal what they see.

It is a discrete-event simulation in integer milliseconds: `advance` jumps from event to event and never sleeps.
`SimulatedWorld` is what a mission knows of it, `marsupial.sim.motion` has robots, clock and queue. What else happens to
a robot, or keeps it from what it is told, is a rule in a file of its own.

The order of the rules
----------------------
Each rule is asked and told in this order; one that says no ends the asking (`marsupial.sim.motion.Rule`).

1. `sensing`: what a robot sees is known before a fault asks for it.
2. `radio`: who is in contact, and hands in what it has seen, is known before routes are searched on the known map.
3. `claims`: a robot waits for others before it notices that the ground ahead has closed, as it looks when it sets off.
4. `batteries`: a robot with an empty one is lost before its docking can fail or its drive end.
5. `faults`: a robot that declines a command has not got it, whatever the rules below would do with it.
6. `handovers`: dockings begin before robots in their way look for something better to do.
7. `deadlocks`: last, robots that wait set off, and those that would wait for ever get another way.

Without interference no robot claims ground: robots share cells and pass through each other.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from marsupial.model import Action, Cell, Grid, Manoeuvres, MapMeeting, News, PlacedRobot, RobotReport, RobotType
from marsupial.model.faults import Fault
from marsupial.model.mission import Interference
from marsupial.model.world import MomentNews
from marsupial.model.zones import ZoneChange
from marsupial.sim.batteries import Batteries
from marsupial.sim.claims import Claims
from marsupial.sim.deadlocks import Deadlocks
from marsupial.sim.faults import Faults
from marsupial.sim.handovers import Handovers
from marsupial.sim.motion import Motion, RobotActivity, SimulatedDrive, SimulatedHandover, SimulatedRobot
from marsupial.sim.radio import Radio
from marsupial.sim.sensing import Sensing
from marsupial.sim.sensors import Sensor


class SimulatedWorld:
    """A simulated `World`; its faults are dated (`marsupial.model.faults.dated`).

    Robots on the ground see their surroundings at time 0: the first news of `advance`. Without a `sensor` they have the
    exact field of view. With `interference` they keep out of each other's footprints.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        faults: Sequence[Fault] = (),
        sensor: Sensor | None = None,
        *,
        interference: bool = False,
    ) -> None:
        self._motion = motion = Motion(truth, kinds, robots)
        self._sensing = Sensing(motion, kinds, sensor, faults)
        self._claims = Claims(motion, kinds)
        self._batteries = Batteries(motion)
        deadlocks = Deadlocks(motion, self._claims)
        motion.rules = [
            self._sensing,
            Radio(motion, kinds),
            *([self._claims] if interference else []),
            self._batteries,
            Faults(motion, self._sensing, faults),
            *([Handovers(motion, self._claims, deadlocks), deadlocks] if interference else []),
        ]

    @property
    def grid(self) -> Grid:
        return self._motion.grid

    @property
    def now_ms(self) -> int:
        return self._motion.now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        return tuple(map(self._report, self._motion.team.values()))

    def distance_m(self, robot: str) -> float:
        return self._motion.team[robot].distance_cells * self.grid.resolution_m

    def driving_ms(self, robot: str) -> int:
        return self._motion.team[robot].driving_ms

    def manoeuvres(self, robot: str) -> Manoeuvres:
        return self._motion.team[robot].odometer.manoeuvres

    def charge(self, robot: str) -> float | None:
        """Return the share of its battery's capacity that a robot has now; None without a battery."""
        return self._batteries.charge(self._motion.team[robot])

    # interference

    def interference(self) -> Interference:
        """Return how often and how long robots have waited for each other so far."""
        return self._claims.interference()

    def plan(self, meetings: Iterable[MapMeeting], actions: Iterable[Action]) -> None:
        """Store which rover and carrier meet where in the current plan: they may come near each other there."""
        self._claims.plan(meetings, actions)

    def change_zone(self, change: ZoneChange) -> None:
        """Take note that a zone holds from now on, or no more: robots make no room and no detours in no-go zones."""
        self._claims.clearance.change_zone(change)

    # commands

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._motion.give(SimulatedDrive((self._motion.team[robot],), route))

    def stop(self, robot: str) -> None:
        self._motion.end_drive(self._motion.team[robot])

    def dock(self, rover: str, carrier: str) -> None:
        self._motion.give(SimulatedHandover((self._motion.team[rover], self._motion.team[carrier]), None))

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._motion.give(SimulatedHandover((self._motion.team[rover], self._motion.team[carrier]), cell))

    # time

    def advance(self, until_ms: int) -> News:
        self._motion.settle()
        moment = self._motion.moment  # commands may have had effects at once
        if (moment.failed or moment.declined or moment.passages) and (news := self._gathered()):
            return news
        while self._motion.is_due(until_ms):
            self._motion.pass_moment()
            if (news := self._gathered()) is not None:
                return news
        self._motion.now_ms = max(self.now_ms, until_ms)
        return News(t_ms=self.now_ms)

    def _gathered(self) -> News | None:
        """Return the news of the present moment so far, None if there is none, and begin anew."""
        news = self._motion.moment.news(self.now_ms)
        if news is not None:
            self._motion.moment = MomentNews()
        return news

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        # a driving robot can stop at the next cell of its route at the earliest
        driving = robot.activity is RobotActivity.DRIVING
        fields: dict[str, Any] = {
            "name": robot.name,
            "type": robot.kind.name,
            "cell": robot.route[robot.step] if driving else robot.cell,
            "carrier": robot.carrier,
            "free_at_ms": max(int(robot.times_ms[robot.step]) if driving else robot.free_at_ms, self.now_ms),
            "lost": robot.lost,
            "heading": robot.odometer.heading,
            "speed": robot.told_speed,
        }
        for rule in self._motion.rules:
            rule.report(robot, fields)
        return RobotReport(**fields)

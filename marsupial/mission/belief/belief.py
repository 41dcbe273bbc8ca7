"""What a mission believes of its world: one object, with one map that plans are made from.

All that a world reports passes through filters before anybody plans with it, its news and its robots alike::

    world ──> pace ──> radio ──> steady ──> zones ──> the mission
               │         │         │          └ zones are drawn in the map
               │         │         └ flickering cells keep a value, and cells that no look reveals are left out
               │         └ rovers out of contact are where they are expected; what happens to them is known later
               └ robots have the speeds that their drives show

Nothing is lost on the way: the log holds the map as it is reported, and the executor knows the robots as they know
themselves (`Belief.world`, `Belief.reported`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

from marsupial.maps.targets import Target
from marsupial.mission.belief.pace import PaceFilter
from marsupial.mission.belief.radio import RadioFilter
from marsupial.mission.belief.steady import SteadyFilter
from marsupial.mission.belief.vain import VainLooks
from marsupial.mission.belief.zones import ZoneFilter
from marsupial.model import Cell, DatedZone, Grid, Manoeuvres, News, Remaining, RobotReport, RobotType, World


class Belief:
    """A `World` as it is planned with, made of the `world` that is reported.

    `kinds` has the robot types by name; `way` returns the route of a robot type between two cells, or None.
    """

    def __init__(
        self,
        world: World,
        kinds: Mapping[str, RobotType],
        zones: Iterable[DatedZone],
        way: Callable[[str, Cell, Cell], Sequence[Cell] | None],
    ) -> None:
        self.world, self.kinds = world, kinds
        self.reported = News(t_ms=world.now_ms)  # the last news of all robots, those out of contact included
        self._pace = PaceFilter(world, kinds)
        self._radio = RadioFilter(world, kinds)
        self._steady = SteadyFilter(world, kinds, self.robots)
        self._zones = ZoneFilter(world.grid, zones)
        self.looks = VainLooks(self, kinds, way)

    @property
    def grid(self) -> Grid:
        """The map that plans are made from."""
        return self._zones.grid

    @property
    def now_ms(self) -> int:
        return self.world.now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        return self._radio.reports(self._pace.reports(self.world.robots()))

    def advance(self, until_ms: int) -> News:
        until_ms = self._radio.until(self._zones.until(until_ms, self.now_ms))
        self.reported = news = self._pace.news(self.world.advance(until_ms))
        if news.moved is not None:
            self.looks.move(news.moved)
        news = self._zones.news(self._steady.news(self._radio.news(news)), self._steady.grid)
        self._radio.note_seen(news)
        return news

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._pace.set_out(robot, route)
        self.world.drive(robot, route)

    def stop(self, robot: str) -> None:
        self.world.stop(robot)

    def dock(self, rover: str, carrier: str) -> None:
        self.world.dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self.world.undock(rover, carrier, cell)

    def distance_m(self, robot: str) -> float:
        return self.world.distance_m(robot)

    def driving_ms(self, robot: str) -> int:
        return self.world.driving_ms(robot)

    def manoeuvres(self, robot: str) -> Manoeuvres:
        return self.world.manoeuvres(robot)

    @property
    def awaits(self) -> bool:
        """Whether a rover out of contact may still come to where it is expected."""
        return self._radio.awaits

    @property
    def no_go(self) -> str:
        """The no-go zones that hold, in words."""
        return self._zones.no_go

    def expect(
        self, name: str, routes: Iterable[Sequence[Cell]], explores: tuple[Cell, ...], targets: Iterable[Target]
    ) -> RobotReport:
        """Note that a rover out of contact drives these routes and explores these cells; return where it will wait.

        The cells are viewpoints of some of these `targets`.
        """
        reports = self._pace.reports(self.world.robots())
        robot = self._radio.expect(next(one for one in reports if one.name == name), routes, explores)
        self.looks.send(name, (target for target in targets if target.viewpoints.get(robot.type) in explores))
        return robot

    def unheard(self) -> list[RobotReport]:
        """Return the rovers out of contact that have something to tell."""
        return [robot for robot in self.robots() if robot.away is not None and robot.name not in self._radio.heard]

    def give_up(self, news: News) -> News | None:
        """Leave out what looks do not reveal, and take it up again when it changes; return the resulting news."""
        looks = self.looks
        if not (looks.any and looks.update(self.world.grid.cells, (cells for _, cells in news.changed))):
            return None
        return self._zones.news(self._steady.give_up(looks.left_out), self._steady.grid)

    def release(self) -> News | None:
        """Accept flickering cells as reported; return the resulting news, or None."""
        news = self._steady.release()
        return None if news is None else self._zones.news(news, self._steady.grid)

    def remaining(self) -> tuple[Remaining, ...]:
        """Return the flickering and given-up cells, and the frontiers in no-go zones."""
        return self._steady.remaining() + self._zones.remaining(self.kinds.values())

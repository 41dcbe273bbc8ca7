"""A fake world controlled by tests, and scripted strategies."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from marsupial.model.grid import FLOOR, Cell, Grid
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.planning import Outcome
from marsupial.model.strategy import Briefing, Decision, PlanningReport, Strategy
from marsupial.model.world import Manoeuvres, News, RobotReport


class FakeWorld:
    """A `World` that records commands and does nothing by itself; tests move robots with `put`."""

    def __init__(self, *robots: RobotReport) -> None:
        self.commands: list[tuple[object, ...]] = []
        self.now_ms = 0
        self._robots = {robot.name: robot for robot in robots}
        self._grid = Grid(cells=np.full((3, 30), FLOOR, dtype=np.uint8), resolution_m=1.0)

    @property
    def grid(self) -> Grid:
        return self._grid

    def put(self, name: str, cell: Cell | None, carrier: str | None = None) -> None:
        self._robots[name] = replace(self._robots[name], cell=cell, carrier=carrier)

    def robots(self) -> tuple[RobotReport, ...]:
        return tuple(self._robots.values())

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self.commands.append(("drive", robot, route[-1]))

    def stop(self, robot: str) -> None:
        self.commands.append(("stop", robot))

    def dock(self, rover: str, carrier: str) -> None:
        self.commands.append(("dock", rover, carrier))

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self.commands.append(("undock", rover, carrier, cell))

    def advance(self, until_ms: int) -> News:
        self.now_ms = until_ms
        return News(t_ms=until_ms)

    def distance_m(self, robot: str) -> float:
        return 0.0

    def driving_ms(self, robot: str) -> int:
        return 0

    def manoeuvres(self, robot: str) -> Manoeuvres:
        return Manoeuvres(stops=0, turns=(0, 0, 0, 0))


class Scripted:
    """A strategy made of a function from briefing to plan; it counts calls and keeps the briefings."""

    name = "scripted"

    def __init__(self, plan: Callable[[Briefing], Plan], *, wall_s: float = 0.0) -> None:
        self._plan = plan
        self._wall_s = wall_s
        self.briefings: list[Briefing] = []

    def decide(self, briefing: Briefing) -> Decision:
        self.briefings.append(briefing)
        report = PlanningReport(planner=self.name, outcome=Outcome.SATISFICING, wall_s=self._wall_s)
        return Decision(plan=self._plan(briefing), report=report)


class Timed:
    """Another strategy, with a reported time of `wall_s` seconds for each decision."""

    def __init__(self, inner: Strategy, wall_s: float) -> None:
        self.name = inner.name
        self._inner = inner
        self.wall_s = wall_s
        self.briefings: list[Briefing] = []

    def decide(self, briefing: Briefing) -> Decision:
        self.briefings.append(briefing)
        decision = self._inner.decide(briefing)
        return replace(decision, report=replace(decision.report, wall_s=self.wall_s))


def plan_of(actions: Iterable[Action]) -> Plan:
    """Return the plan in which these actions start one second apart."""
    return Plan(actions=tuple(replace(action, start_ms=1000 * i) for i, action in enumerate(actions)))


def drive(name: ActionName, robot: str, place: str, origin: str) -> Action:
    """Return a move or explore of one second."""
    return Action(name=name, start_ms=0, duration_ms=1000, robot=robot, place=place, origin=origin)


def meet(name: ActionName, rover: str, carrier: str, place: str) -> Action:
    """Return a dock or undock of one second."""
    return Action(name=name, start_ms=0, duration_ms=1000, robot=rover, place=place, carrier=carrier)

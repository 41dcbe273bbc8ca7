"""The simulator as a client of missions: it carries out commands and reports what happens."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from marsupial.errors import ScenarioError
from marsupial.formats.fields import Fields
from marsupial.formats.scenario.faults import read_faults
from marsupial.formats.scenario.write import task_document
from marsupial.formats.scenario.zones import zone_fields
from marsupial.model.faults import Fault, dated
from marsupial.model.grid import UNKNOWN, Cell, CellArray, Grid, Mask
from marsupial.model.mission import PlacedRobot
from marsupial.model.planning import Budget, Outcome
from marsupial.model.robots import RobotType
from marsupial.model.runs import drawn, known_runs, runs_of
from marsupial.model.scenario import Scenario
from marsupial.model.strategy import PlanningReport
from marsupial.model.world import HeldNews, News, RobotReport
from marsupial.sim.world import SimulatedWorld
from marsupial_service.missions.values import MissionBrief, MissionReport
from marsupial_service.schemas.missions import FailedBody, LostBody, PartedBody, RevealedBody, RobotNoteBody


class SimulatedTeam:
    """A simulated world that receives commands and returns reports, both as JSON.

    While the mission is `paused`, time advances only as long as a robot in contact is busy. Rovers out of contact drive
    back the way they came to where they were set down.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        faults: Sequence[Fault] = (),
        limit_ms: int = 0,
        seed: int = 0,
    ) -> None:
        kinds_of = [(robot.name, kinds[robot.type]) for robot in robots]
        roles = {name: kind.role for name, kind in kinds_of}
        drawn = tuple(dated(faults, roles, limit_ms, seed))
        self._world = SimulatedWorld(truth, kinds, robots, drawn)
        # robots that may be later than the service predicts
        self._late = {fault.robot for fault in drawn if not fault.reported}
        self._ids: dict[str, int] = {}
        self._n = 0
        self._parted: dict[str, tuple[RobotReport, float, float | None]] = {}  # rovers out of contact, as last reported
        self._unheard = HeldNews()
        self._refused: list[FailedBody] = []  # commands that did not reach them
        self._trails = {name: list[Cell]() for name, kind in kinds_of if kind.radio_range_m is not None}
        self._going_back: set[str] = set()
        self.paused = False

    def answer(self, batch: Mapping[str, Any]) -> dict[str, Any] | None:
        """Carry out commands as `report` does, and return the report as JSON."""
        report = self.report(batch)
        return None if report is None else report.model_dump(mode="json", exclude_none=True)

    def report(self, batch: Mapping[str, Any]) -> MissionReport | None:
        """Carry out a batch of commands until something happens, and report that.

        Returns None if the batch wants no report: it is the last, or answers an earlier report than the last.
        """
        for command in batch["commands"]:
            self._execute(command)
        waits = self.paused and self._ids.keys() <= self._parted.keys()
        if batch["n"] != self._n or batch["until_ms"] is None or waits:
            return None
        before = [self._parted.get(one[0].name, one) for one in self._state()]
        news = self._heard(self._world.advance(batch["until_ms"]))
        self._n += 1
        ids = dict.fromkeys(self._ids.pop(name) for name in news.finished)
        failed, declined = self._ended(news.failed), self._ended(news.declined) + self._refused
        self._refused = []
        for name, _ in news.lost:
            self._ids.pop(name, None)
        ended = {
            *news.finished,
            *news.returned,
            *(name for name, _ in (*news.failed, *news.declined)),
            *news.in_contact,
        }
        after = self._state(ended)
        # a drive that fails at once leaves its robot where it was, not on its way as the service predicts
        unsure = self._late.union(name for name, _ in news.failed)
        cells = self._world.grid.cells.ravel()
        returning = {new.name for new, _, _ in after if new.returns}
        report = MissionReport(
            n=self._n,
            t_ms=news.t_ms,
            revealed=[
                RevealedBody(robot=name, runs=runs_of(seen, cells)) for name, seen in (*news.revealed, *news.changed)
            ],
            robots=[
                self._update(new, charge, slowed=new.speed != old.speed)
                for (old, drove, _), (new, driven, charge) in zip(before, after, strict=True)
                if new.name not in self._parted
                and ((new, driven) != (old, drove) or new.name in unsure or charge is not None)
                and (new.cell is not None or new.speed != old.speed or charge is not None)
                and not (new.lost and old.lost)
            ],
            finished=list(ids),
            failed=failed,
            declined=declined,
            lost=[LostBody(robot=name, reason=reason, returns=name in returning) for name, reason in news.lost],
            returned=list(news.returned),
            out_of_contact=[PartedBody(robot=name, returns=True) for name in news.out_of_contact],
            in_contact=list(news.in_contact),
        )
        self._parted |= {one[0].name: one for one in after if one[0].name in news.out_of_contact}
        for name in news.out_of_contact:
            if name not in self._ids:
                self._go_back(name)
        return report

    def _heard(self, news: News) -> News:
        """Return what is heard of news: what happens to rovers out of contact is heard once they are in contact."""
        parted, self._parted = self._parted, {n: old for n, old in self._parted.items() if n not in news.in_contact}
        if not parted and not self._going_back:
            return news
        back = self._going_back.intersection(news.finished)
        self._going_back.difference_update(back, (name for name, _ in (*news.failed, *news.lost)))
        news = replace(news, finished=tuple(name for name in news.finished if name not in back))
        for name in news.finished:
            if name in self._parted:
                self._go_back(name)
        for name in news.in_contact:
            if name in self._going_back:
                self._world.stop(name)
        news = self._unheard.told(news, self._parted)
        # a rover that was lost out of contact, and can act again, has failed only
        able = {robot.name for robot in self._world.robots() if robot.name in parted and not robot.lost}
        return replace(
            news,
            failed=news.failed + tuple(one for one in news.lost if one[0] in able),
            lost=tuple({one[0]: one for one in news.lost if one[0] not in able}.values()),
            returned=tuple(name for name in news.returned if name not in parted),
        )

    def _go_back(self, name: str) -> None:
        """Send a rover out of contact back to where it was set down, if it knows the way."""
        robot = next(robot for robot in self._world.robots() if robot.name == name)
        trail = self._trails[name]
        if robot.cell in trail[1:] and robot.free_at_ms <= self._world.now_ms:
            self._going_back.add(name)
            self._world.drive(name, trail[trail.index(robot.cell) :: -1])

    def _note(self, trail: list[Cell], route: Sequence[Cell]) -> None:
        """Add a route to the trail of a rover; where it comes by again, the trail gets shorter."""
        if route[0] not in trail:  # it is beside its trail
            trail.clear()
            return
        for cell in route:
            del trail[trail.index(cell) + 1 if cell in trail else len(trail) :]
            if cell != trail[-1]:
                trail.append(cell)

    def _ended(self, robots: Iterable[tuple[str, str]]) -> list[FailedBody]:
        """Return the commands of these robots, which have ended, with their reasons; a robot may have none."""
        ended = {self._ids.pop(name): reason for name, reason in robots if name in self._ids}
        return [FailedBody(id=number, reason=reason) for number, reason in ended.items()]

    def _state(self, ended: Container[str] = ()) -> list[tuple[RobotReport, float, float | None]]:
        """Return every robot, how far it has driven, and its charge if it has just `ended` something.

        In between, the mission knows the charge as well.
        """
        return [
            (
                replace(robot, charge=None),
                self._world.distance_m(robot.name),
                self._world.charge(robot.name) if robot.name in ended else None,
            )
            for robot in self._world.robots()
        ]

    def _execute(self, command: Mapping[str, Any]) -> None:
        robot, name = command["robot"], command["name"]
        if robot in self._parted:
            if name != "stop":
                self._refused.append(FailedBody(id=command["id"], reason="out of contact"))
            return
        if name == "stop":
            self._world.stop(robot)
            return
        for one in (robot, command.get("carrier")):
            if one is not None:
                self._ids[one] = command["id"]
        if name == "drive":
            route = [Cell(*cell) for cell in command["route"]]
            self._world.drive(robot, route)
            if robot in self._trails:
                self._note(self._trails[robot], route)
        elif name == "dock":
            self._world.dock(robot, command["carrier"])
        else:
            self._world.undock(robot, command["carrier"], Cell(*command["cell"]))
            if robot in self._trails:
                self._trails[robot] = [Cell(*command["cell"])]

    def _update(self, robot: RobotReport, charge: float | None = None, *, slowed: bool = False) -> RobotNoteBody:
        return RobotNoteBody.model_construct(
            name=robot.name,
            cell=robot.cell,
            free_at_ms=robot.free_at_ms,
            distance_m=self._world.distance_m(robot.name),
            driving_ms=self._world.driving_ms(robot.name),
            speed_share=robot.speed if slowed else None,
            charge=charge,
        )


def planning_of(document: Mapping[str, Any]) -> PlanningReport:
    """Return the planning report in the document of a decision."""
    report = {key: value for key, value in document.items() if key not in ("actions", "reasons")}
    return PlanningReport(**{**report, "outcome": Outcome(document["outcome"])})


def simulated_team(brief: MissionBrief) -> SimulatedTeam | None:
    """Return the robots if the service simulates them, else None; each process of the mission gets the same."""
    if brief.simulation is None:
        return None
    truth = replace(brief.grid, cells=drawn(brief.simulation.truth, brief.grid.cells.shape))
    notes = Fields({"faults": list(brief.simulation.faults)}, "", [])
    faults = read_faults(notes, [robot.name for robot in brief.robots], truth.terrains, truth)
    notes.check(ScenarioError)
    kinds = {kind.name: kind for kind in brief.kinds}
    return SimulatedTeam(truth, kinds, brief.robots, faults, brief.limits.time_ms, brief.seed)


def mission_document(
    scenario: Scenario,
    team: Sequence[PlacedRobot],
    reachable: Mask,
    *,
    strategy: str,
    planner: str,
    budget: Budget,
    seed: int,
) -> dict[str, Any]:
    """Return the request body for a mission of this team in a scenario, whose map is unknown at first.

    `reachable` are the cells (height, width) to explore.
    """
    area: CellArray = reachable.astype("uint8")
    area[area == 0] = UNKNOWN
    return {
        "name": scenario.name,
        **task_document(scenario.grid, scenario.robot_types, scenario.goal, scenario.limits, scenario.planning_time),
        "team": [_member(robot) for robot in team],
        "strategy": strategy,
        "planner": planner,
        "budget": {"steps": budget.steps} if budget.seconds is None else {"seconds": budget.seconds},
        "area": list(known_runs(area)),
        "map_may_grow": False,  # the simulator's world ends where its map does
        "seed": seed,
        **({"zones": list(map(zone_fields, scenario.zones))} if scenario.zones else {}),
    }


def _member(robot: PlacedRobot) -> dict[str, Any]:
    where = {"carrier": robot.carrier} if robot.cell is None else {"cell": list(robot.cell)}
    return {"name": robot.name, "type": robot.type, **where}

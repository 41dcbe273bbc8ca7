"""`marsupial.Mission`: a mission that the caller leads, one plan at a time.

At each replanning the mission stops and shows an `Observation`; `step` takes a plan, or who goes to which target, and
lets time pass until the next replanning. Everything else is as in `marsupial.explore`.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from os import PathLike

import numpy as np

from marsupial.arrays import Flags, Floats, Ints
from marsupial.errors import UsageError
from marsupial.library.arguments import sensor_argument
from marsupial.library.exploring import Exploration
from marsupial.library.missions import set_up
from marsupial.library.recording import Recorder
from marsupial.library.scenarios import scenario as named_scenario
from marsupial.mission.observer import Observers
from marsupial.mission.state import MissionTracker, views
from marsupial.model import (
    UNREACHABLE,
    Briefing,
    Budget,
    CellArray,
    MissionEnded,
    Plan,
    Role,
    Scenario,
    Situation,
    Strategy,
    TargetInfo,
)
from marsupial.model.arguments import instance, whole
from marsupial.model.bounds import BOUNDS
from marsupial.model.mission import MissionEvent
from marsupial.model.planning import NO_PLANNER
from marsupial.model.strategy import Decision
from marsupial.planning.schedule.costs import NEVER, Costs, Detours
from marsupial.planning.schedule.insertions import Arrivals
from marsupial.planning.schedule.timeline import Timeline, follow
from marsupial.sim.sensors import Sensor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observation:
    """A moment of a mission as arrays.

    Robots are in the order of the team; targets are those of the planning problem, in its order, and none once the
    mission has ended. Positions are metres from the lower left corner of the map.
    """

    t_s: float
    """Seconds of the mission so far."""
    known: CellArray
    """Terrain codes, 255 where unknown, of shape (height, width); row 0 is the lowest."""
    robots_m: Floats
    """Positions of the robots, of shape (robots, 2)."""
    carriers: Ints
    """The number of the robot that each is aboard, -1 on the ground, of shape (robots,)."""
    lost: Flags
    """Whether each robot is lost, of shape (robots,)."""
    targets_m: Floats
    """Positions of the targets, of shape (targets, 2)."""
    reveal_m2: Floats
    """The area that each target may reveal, in square metres, of shape (targets,)."""
    travel_s: Floats
    """Driving times of each robot by itself to each target, of shape (robots, targets).

    They are `inf` where there is no path, and for rovers aboard.
    """


class Mission:
    """A mission of a scenario, led by the caller: ``reset``, then ``step`` until `result` is there.

    `scenario` is a scenario, or what `marsupial.scenario` takes; `sensor` is as for `marsupial.explore`.
    """

    def __init__(self, scenario: Scenario | str | PathLike[str], *, sensor: Sensor | None = None) -> None:
        self.scenario = scenario if isinstance(scenario, Scenario) else named_scenario(scenario)
        self._sensor = sensor_argument(sensor)
        self._recorder = Recorder()
        self.briefing: Briefing | None = None  #: what a strategy would get now; None before and after the mission
        self.result: Exploration | None = None  #: None until the mission has ended

    @property
    def events(self) -> tuple[MissionEvent, ...]:
        """All events so far, in order."""
        return tuple(self._recorder.events)

    def reset(self, seed: int = 1) -> Observation:
        """Begin the mission again, with the starts that `seed` draws; return what there is to see."""
        self._recorder, self._tracker, self.result = Recorder(), MissionTracker(), None
        simulation = set_up(
            self.scenario,
            strategy=_Stepped(),
            planner=NO_PLANNER,
            budget=Budget(steps=1),
            seed=whole("seed", seed, BOUNDS["seed"]),
            observer=Observers([self._recorder, self._tracker]),
            sensor=self._sensor,
        )
        self._summary = simulation.summary
        return self._continue(simulation.loop.turns(), None)

    def step(self, plan: Plan | Mapping[str, str]) -> Observation:
        """Follow a plan until something happens that could change it; return what there is to see then.

        Instead of a plan, robots' targets by robot may be given (see `plan_for`). A plan that can't be carried out ends
        the mission as `failed`, and one without actions as `stalled` unless a robot is docking.
        """
        self._situation()
        plan = self.plan_for(plan) if isinstance(plan, Mapping) else instance("plan", plan, Plan)
        return self._continue(self._turns, Decision(plan=plan))

    def plan_for(self, targets: Mapping[str, str]) -> Plan:
        """Return a plan that sends robots to targets, both by name; robots that can't get to theirs are left out.

        A rover that can't drive there is carried, perhaps by several carriers one after the other, before these go to
        targets of their own if the rover is named first.
        """
        situation = self._situation()
        for robot, target in targets.items():
            if robot not in situation.robot_by_name or target not in situation.target_by_name:
                raise UsageError(f"targets: there is no robot {robot!r} or no target {target!r}")
        return _sent(situation, targets)

    def _situation(self) -> Situation:
        """Return the planning problem of now."""
        if self.briefing is None:
            raise UsageError("the mission has ended, or not begun: reset() begins it")
        return self.briefing.situation

    def _continue(self, turns: Generator[Briefing, object, MissionEnded], decision: Decision | None) -> Observation:
        self.briefing = None  # also if the caller's sensor raises an exception
        try:
            self.briefing = turns.send(decision)
            self._turns = turns
        except StopIteration as end:
            self.result = Exploration.from_summary(self._summary(end.value), self._recorder.events)
        return self._observation()

    def _observation(self) -> Observation:
        tracker, resolution_m = self._tracker, self.scenario.grid.resolution_m
        robots = views(tracker.tracks, tracker.t_ms)
        numbers = {robot.name: i for i, robot in enumerate(robots)}
        targets: tuple[TargetInfo, ...] = ()
        at_m: Mapping[str, tuple[float, float]] = {}
        travel_s = np.zeros((len(robots), 0))
        if self.briefing is not None:
            situation, at_m = self.briefing.situation, self.briefing.unseen().at_m
            targets, travel_s = situation.targets, np.full((len(robots), len(situation.targets)), np.inf)
            columns = [situation.place_index[target.name] for target in targets]
            for robot in situation.robots:
                if robot.place is not None:
                    row = situation.travel_ms[robot.type][situation.place_index[robot.place], columns]
                    travel_s[numbers[robot.name]] = np.where(row == UNREACHABLE, np.inf, row / 1000)
        return Observation(
            t_s=tracker.t_ms / 1000,
            known=tracker.cells.copy(),
            robots_m=(np.array([(robot.x, robot.y) for robot in robots]) + 0.5) * resolution_m,
            carriers=np.array([-1 if robot.carrier is None else numbers[robot.carrier] for robot in robots]),
            lost=np.array([robot.lost for robot in robots]),
            targets_m=np.array([at_m[target.name] for target in targets]).reshape(len(targets), 2),
            reveal_m2=np.array([target.reveal_m2 for target in targets]),
            travel_s=travel_s,
        )


class _Stepped(Strategy):
    """Stands for the caller, whose decisions the mission gets by `Mission.step`."""

    name = "stepped"


def _sent(situation: Situation, targets: Mapping[str, str]) -> Plan:
    detours = Detours(situation)
    costs, timeline = Costs(detours.situation), Timeline.of(detours.situation)
    names = [target.name for target in situation.targets]
    for robot, target in targets.items():
        if target in timeline.explored:
            continue
        if timeline.can_drive(robot, target):
            timeline.explore(robot, target)
        elif situation.type_of(robot).role is Role.ROVER and situation.meetings:
            arrivals, carried = Arrivals(timeline, costs), timeline.copy()
            row = arrivals.row[robot]
            times, transports = arrivals.relay(row)
            done = times + costs.sortie[arrivals.kinds[row], :, names.index(target)]
            meeting = int(np.argmin(done))
            if done[meeting] < NEVER and follow(carried, robot, meeting, transports):
                carried.explore(robot, target)
                timeline = carried
    return detours.expanded(timeline.plan)

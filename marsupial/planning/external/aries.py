"""Aries (up-aries): constraint solving over plans with a growing number of actions, anytime, minimising the makespan.

Aries tries plans with 1, 2, ... instances of each action schema. So its problem has one schema per target to explore,
per meeting to drive to, and per rover and meeting to dock or undock: nearly every plan then has one instance of each
schema at most. Each robot has one state variable, its place. Times are integers; with about 500 units for the longest
drive, rounded up, search is much faster than in ms; the plan is timed exactly afterwards.

References: Bit-Monnot: Enhancing hybrid CP-SAT search for disjunctive scheduling. ECAI 2023.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from importlib.util import find_spec
from itertools import chain
from typing import TYPE_CHECKING, Any

import psutil

from marsupial.model import Action, ActionName, EngineInfo, Finished, Outcome, Plan, RobotState, Situation
from marsupial.planning.external.encodings import ALL, SearchRequest, Vocabulary
from marsupial.planning.external.process_engine import Finder, ProcessEngine, Requirement
from marsupial.planning.schedule.timeline import retime
from marsupial.processes.jobs import ToolDied

if TYPE_CHECKING:
    from unified_planning.model import Problem

LONGEST_UNITS = 500  # units of time in the longest drive

# latest time that Aries may use; its own default is below 10,000, and it silently finds nothing beyond
HORIZON_UNITS = 10_000_000
# the least gap that up-aries assumes; with any other value in the problem it drops its own proofs
EPSILON = Fraction(1, 10)
# up to here Aries is first asked for any plan: its anytime mode may not report plans that it finds at once
SMALL_SCHEMAS = 20

# Aries 0.5 panics in a few of a hundred searches ("inactive constraint", as it minimises the makespan), but not always
# in the same ones: the same request to a new server nearly always succeeds.
PANICS = 3

_POLL_S = 0.003  # polling interval for the socket of a starting server, which sends no notification

_SETTINGS = {
    "ARIES_PLANNING_HORIZON": str(HORIZON_UNITS),
    "ARIES_PLANNING_PREPRO_STATE_VARS": "false",  # panics on our tables otherwise; our facts are state variables anyway
    "no_grpc_proxy": "127.0.0.1,localhost",  # its server is on this machine
}

INFO = EngineInfo(
    name="aries",
    summary="constraint solving (up-aries); anytime, near-optimal on small teams",
    licence="MIT",
    anytime=True,
)


def aries(finder: Finder = find_spec) -> ProcessEngine:
    """Return the engine; `finder` looks up installed modules."""
    needs = (
        Requirement(module="unified_planning", distribution="unified-planning"),
        Requirement(module="up_aries", distribution="up-aries"),
        Requirement(module="grpc", distribution="grpcio"),
    )
    return ProcessEngine(INFO, search, needs, preload=(load_aries,), finder=finder)


def load_aries() -> None:
    import up_aries.solver  # noqa: F401


def search(request: SearchRequest) -> Iterator[Plan | Finished]:
    """Run Aries in a child process; yield each of its plans and its final status."""
    os.environ.update(_SETTINGS)
    encoding = Encoding(request.situation)
    found, status = False, ""
    for status, plan in _ask(encoding.problem, request.seconds):  # noqa: B007 - the last one counts
        if plan is not None:
            found = True
            yield retime(request.situation, encoding.actions(plan))
    yield _finished(status, found)


def _finished(status: str, found: bool) -> Finished:
    if status == "SOLVED_OPTIMALLY" and found:
        return Finished(outcome=Outcome.OPTIMAL, detail="aries has proven the plan optimal, to a unit of its time")
    if status == "UNSOLVABLE_PROVEN" and not found:
        return Finished(outcome=Outcome.UNSOLVABLE, detail="aries has proven that there is no plan")
    if status == "TIMEOUT":
        return Finished(outcome=Outcome.TIMEOUT, detail="aries has used up its time")
    return Finished(outcome=Outcome.SATISFICING if found else Outcome.NO_PLAN, detail=f"aries says {status}")


def _ask(problem: Problem, seconds: float) -> Iterator[tuple[str, Any]]:
    from unified_planning.environment import get_environment
    from unified_planning.grpc.proto_reader import ProtobufReader
    from unified_planning.grpc.proto_writer import ProtobufWriter

    get_environment().credits_stream = None
    until = time.monotonic() + seconds
    text = ProtobufWriter().convert(problem)
    answers = _answers(text, until, anytime=True)
    if len(problem.actions) <= SMALL_SCHEMAS:
        answers = chain(_answers(text, until, anytime=False), answers)
    for answer in answers:
        result = ProtobufReader().convert(answer, problem)
        yield result.status.name, result.plan


def _answers(text: Any, until: float, *, anytime: bool) -> Iterator[Any]:
    """Query Aries until a time limit, again after each of its first `PANICS`; raise `ToolDied` if a server dies."""
    for panics in range(PANICS + 1):
        try:
            yield from _answers_of_one(text, until, anytime=anytime)
            return
        except ToolDied as error:
            panicked = error.returncode > 0
            if panics == PANICS or not panicked or time.monotonic() >= until:
                raise


def _answers_of_one(text: Any, until: float, *, anytime: bool) -> Iterator[Any]:
    """Query a new server (each serves once) until a time limit; raise `ToolDied` if it dies."""
    import unified_planning.grpc.generated.unified_planning_pb2 as messages
    from grpc import RpcError  # type: ignore[import-untyped]

    server, planner = _serve()
    left = max(0.01, until - time.monotonic())
    request = messages.PlanRequest(problem=text, timeout=left, engine_options={"optimal": "false"})
    try:
        if anytime:
            yield from planner.planAnytime(request)
        else:
            yield planner.planOneShot(request)
    except RpcError as error:
        with contextlib.suppress(subprocess.TimeoutExpired):
            raise ToolDied("the Aries server", server.wait(0.5)) from error
        raise
    finally:
        server.kill()
        server.wait()


def _serve() -> tuple[subprocess.Popen[bytes], Any]:
    """Start an Aries server and connect to it."""
    # up-aries looks for a free port before it starts the server, and another process may take that port in between. So
    # the system gives the server a port as it starts, which is read from its socket.
    import grpc
    from unified_planning.grpc.generated.unified_planning_pb2_grpc import UnifiedPlanningStub
    from up_aries import solver

    server = subprocess.Popen([solver._find_executable(), "serve", "--address", "127.0.0.1:0"])
    process = psutil.Process(server.pid)
    while server.poll() is None:
        with contextlib.suppress(psutil.Error):  # the server may end while we look
            for connection in process.net_connections(kind="tcp4"):
                if connection.status == psutil.CONN_LISTEN:
                    return server, UnifiedPlanningStub(grpc.insecure_channel(f"127.0.0.1:{connection.laddr.port}"))
        time.sleep(_POLL_S)
    raise ToolDied("the Aries server", server.returncode)


class Encoding:
    """Aries' problem; objects get plain names, so that a situation may contain any name."""

    def __init__(self, situation: Situation) -> None:
        from unified_planning import shortcuts

        self.up = shortcuts
        self.words = Vocabulary(situation)
        self.situation = situation
        self.problem = self.up.Problem("situation")
        # The function per schema that makes an action of our names for its parameters.
        self.meaning: dict[str, Callable[[list[str]], Action]] = {}
        self.start, self.end = self.up.StartTiming(), self.up.EndTiming()
        self.before = self.words.predecessors()
        longest = max((a.duration_ms for robot in situation.robots for a in self.words.drives(robot)), default=1)
        self.unit_ms = max(1, longest // LONGEST_UNITS)
        self._names: dict[str, str] = {}  # of ours, by Aries'
        self._objects: dict[str, Any] = {}
        self._make_objects()
        self._make_fluents()
        for name in self.kinds:
            self._drives([robot for robot in self.situation.robots if robot.type == name], name)
        meets = {(a.name, a.robot, a.place, self._type_of(a.carrier)): a for a in self.words.meets()}
        for action in meets.values():  # one for all carriers of a type
            self._meet(action)
        self._start_and_goal()
        self.problem.add_quality_metric(self.up.MinimizeMakespan())
        self.problem.epsilon = EPSILON

    def actions(self, plan: Any) -> list[Action]:
        """Return the actions of an Aries plan in order of start."""
        timed = sorted(plan.timed_actions, key=lambda one: one[0])
        return [self.meaning[a.action.name]([self._names[str(p)] for p in a.actual_parameters]) for _, a, _ in timed]

    def _units(self, ms: int) -> int:
        return max(1, -(-ms // self.unit_ms))

    def _make_objects(self) -> None:
        self.place, self.level = self.up.UserType("place"), self.up.UserType("level")
        self.kinds = {kind.name: self.up.UserType(f"type{i}") for i, kind in enumerate(self.situation.types)}
        for i, place in enumerate(self.situation.places):
            self._object(place, f"p{i}", self.place)
        for i, robot in enumerate(self.situation.robots):
            self._object(robot.name, f"q{i}", self.kinds[robot.type])
        for carrier in self.words.carriers:
            self._object(f"on {carrier.name}", f"on_{self._objects[carrier.name].name}", self.place)
        self._object("on the way", "on_the_way", self.place)
        most = max((self.words.capacity(carrier) for carrier in self.words.carriers), default=0)
        self.levels = [self._object(f"load {n}", f"load{n}", self.level) for n in range(most + 1)]

    def _object(self, ours: str, name: str, kind: Any) -> Any:
        self._objects[ours] = made = self.up.Object(name, kind)
        self._names[name] = ours
        self.problem.add_object(made)
        return made

    def _make_fluents(self) -> None:
        def of_robots(name: str, value: Any) -> dict[str, Any]:
            return {kind: self.up.Fluent(f"{name}_{t.name}", value, robot=t) for kind, t in self.kinds.items()}

        self.at, self.deck = of_robots("at", self.place), of_robots("deck", self.place)
        # by what is counted and the type of carrier
        self.load = {(ALL, kind): fluent for kind, fluent in of_robots("load", self.level).items()}
        self.unexplored = self.up.Fluent("unexplored", self.up.BoolType(), target=self.place)
        carriers = {carrier.type for carrier in self.words.carriers}
        for kind in self.kinds:
            mine = (self.at[kind], self.deck[kind], self.load[ALL, kind])
            for fluent in mine if kind in carriers else mine[:1]:
                self.problem.add_fluent(fluent)
        for carrier in self.words.carriers:
            for group in self.words.all_scarce(carrier):
                if (group, carrier.type) not in self.load:
                    name, kind = f"seats{len(self.load)}", self.kinds[carrier.type]
                    self.load[group, carrier.type] = fluent = self.up.Fluent(name, self.level, robot=kind)
                    self.problem.add_fluent(fluent)
        self.problem.add_fluent(self.unexplored, default_initial_value=False)

    def _drives(self, robots: list[RobotState], kind: str) -> None:
        """Write one schema per place robots of a type drive to, with tables of where from and how long."""
        roads: dict[str, dict[str, Action]] = {}
        for robot in robots:
            for action in self.words.drives(robot):
                roads.setdefault(action.place, {})[action.origin or ""] = action
        for goal, origins in roads.items():
            name = f"to_{self._objects[goal].name}_{self.kinds[kind].name}"
            time_from = self.up.Fluent(f"time_{name}", self.up.IntType(0, HORIZON_UNITS), origin=self.place)
            open_from = self.up.Fluent(f"open_{name}", self.up.BoolType(), origin=self.place)
            self.problem.add_fluent(time_from, default_initial_value=0)
            self.problem.add_fluent(open_from, default_initial_value=False)
            for origin, action in origins.items():
                self.problem.set_initial_value(open_from(self._objects[origin]), True)
                self.problem.set_initial_value(time_from(self._objects[origin]), self._units(action.duration_ms))
            self._drive(name, kind, next(iter(origins.values())), time_from, open_from)

    def _drive(self, name: str, kind: str, sample: Action, time_from: Any, open_from: Any) -> None:
        schema = self.up.DurativeAction(name, robot=self.kinds[kind], origin=self.place)
        robot, origin = schema.parameters
        goal, at = self._objects[sample.place], self.at[kind](robot)
        schema.set_fixed_duration(time_from(origin))
        schema.add_condition(self.start, open_from(origin))
        schema.add_condition(self.start, self.up.Equals(at, origin))
        schema.add_effect(self.start, at, self._objects["on the way"])
        schema.add_effect(self.end, at, goal)
        if sample.name is ActionName.EXPLORE:
            schema.add_condition(self.start, self.unexplored(goal))
            schema.add_effect(self.start, self.unexplored(goal), False)
        self._add(schema, lambda names: replace(sample, robot=names[0], origin=names[1]))

    def _type_of(self, robot: str | None) -> str:
        return self.situation.robot_by_name[robot or ""].type

    def _meet(self, action: Action) -> None:
        """Write docking or undocking of one rover at one meeting, with any carrier of the action's carrier type."""
        up, objects, docks = self.up, self._objects, action.name is ActionName.DOCK
        sample = self.situation.robot_by_name[action.carrier or ""]
        kind, rover, here = sample.type, objects[action.robot], objects[action.place]
        scarce = self.words.scarce(sample, self.situation.robot_by_name[action.robot])
        levels = {"load" if group == ALL else "seated": self.level for group in scarce}
        title = f"{action.name}_{rover.name}_{here.name}_{self.kinds[kind].name}"
        schema = up.DurativeAction(title, carrier=self.kinds[kind], **levels)
        carrier, *loads = schema.parameters
        aboard = self.deck[kind](carrier)
        rover_at, carrier_at = self.at[self._type_of(action.robot)](rover), self.at[kind](carrier)
        schema.set_fixed_duration(self._units(action.duration_ms))
        schema.add_condition(self.start, up.Equals(carrier_at, here))
        schema.add_condition(self.start, up.Equals(rover_at, here if docks else aboard))
        schema.add_effect(self.start, carrier_at, objects["on the way"])
        schema.add_effect(self.start, rover_at, objects["on the way"])
        schema.add_effect(self.end, carrier_at, here)
        schema.add_effect(self.end, rover_at, aboard if docks else here)
        if not docks:
            self._keep_order(schema, action.robot)
        for (group, most), level in zip(scarce.items(), loads, strict=True):
            self._count(schema, self.load[group, kind](carrier), level, most, docks)
        self._add(schema, lambda names: replace(action, carrier=names[0]))

    def _count(self, schema: Any, load: Any, level: Any, most: int, docks: bool) -> None:
        """Change the load by one level; no other action can meanwhile, as a carrier is in one action at a time."""
        name = schema.name if level.name == "load" else f"{level.name}_{schema.name}"
        step = self.up.Fluent(f"step_{name}", self.up.BoolType(), level=self.level)
        after = self.up.Fluent(f"after_{name}", self.level, level=self.level)
        self.problem.add_fluent(step, default_initial_value=False)
        self.problem.add_fluent(after, default_initial_value=self.levels[0])
        for n in range(most):
            low, high = self.levels[n], self.levels[n + 1]
            self.problem.set_initial_value(step(low if docks else high), True)
            self.problem.set_initial_value(after(low if docks else high), high if docks else low)
        schema.add_condition(self.start, self.up.Equals(load, level))
        schema.add_condition(self.start, step(level))
        schema.add_effect(self.end, load, after(level))

    def _keep_order(self, schema: Any, rover: str) -> None:
        if rover in self.before:
            schema.add_condition(self.start, self._released(self.before[rover]))
        if rover in self.before.values():
            schema.add_effect(self.start, self._released(rover), True)

    def _released(self, rover: str) -> Any:
        name = f"released_{self._objects[rover].name}"
        if not self.problem.has_fluent(name):
            self.problem.add_fluent(self.up.Fluent(name, self.up.BoolType()), default_initial_value=False)
        return self.problem.fluent(name)()

    def _start_and_goal(self) -> None:
        problem, objects = self.problem, self._objects
        for robot in self.situation.robots:
            where = f"on {robot.carrier}" if robot.place is None else robot.place
            problem.set_initial_value(self.at[robot.type](objects[robot.name]), objects[where])
        for carrier in self.words.carriers:
            mine = objects[carrier.name]
            problem.set_initial_value(self.deck[carrier.type](mine), objects[f"on {carrier.name}"])
            for group in {ALL: 0} | self.words.all_scarce(carrier):
                load = self.levels[self.words.load(carrier, group)]
                problem.set_initial_value(self.load[group, carrier.type](mine), load)
            home = self.words.home(carrier)
            if home is not None:
                problem.add_goal(self.up.Equals(self.at[carrier.type](mine), objects[home]))
        for target in self.situation.targets:
            problem.set_initial_value(self.unexplored(objects[target.name]), True)
            problem.add_goal(self.up.Not(self.unexplored(objects[target.name])))
        decks = [objects[f"on {carrier.name}"] for carrier in self.words.carriers]
        for rover in self.words.rovers if self.situation.goal.aboard else ():
            at = self.at[rover.type](objects[rover.name])
            problem.add_goal(self.up.Or([self.up.Equals(at, deck) for deck in decks]))

    def _add(self, schema: Any, meaning: Callable[[list[str]], Action]) -> None:
        self.problem.add_action(schema)
        self.meaning[schema.name] = meaning

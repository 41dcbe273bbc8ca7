"""The definition of a comparison: every contender on every case with every seed; and its head, ``comparison.json``.

All contenders get the same maps, teams, starts and seeds, so that missions can be compared pair by pair.

The head of a comparison's folder has everything that the rows depend on. A folder is continued only by the same
comparison, or by one that includes all its missions.
"""

import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from typing import Any

from marsupial.bench.compare.statistics import Origin
from marsupial.errors import InputError, Problem, UsageError
from marsupial.formats.jsonvalues import JsonFault, parse_json
from marsupial.formats.loglines import LEFT_OUT
from marsupial.library.choices import AnyStrategy
from marsupial.maps.discs import least_cells
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.model.robots import RobotType
from marsupial.model.scenario import PlanningTime, Scenario
from marsupial.model.strategy import Decider
from marsupial.strategies.files import StrategyFile
from marsupial.versions import LIBRARIES

OwnStrategy = StrategyFile | Decider


@dataclass(frozen=True, slots=True, order=True)
class Contender:
    """A strategy with its planner."""

    strategy: str
    planner: str = NO_PLANNER

    def __str__(self) -> str:
        return self.strategy if self.planner == NO_PLANNER else f"{self.strategy} ({self.planner})"


@dataclass(frozen=True, slots=True, order=True)
class Case:
    """A scenario with a team: `rovers` for each of the `carriers`."""

    scenario: str
    carriers: int
    rovers: int

    @property
    def team(self) -> str:
        """The team in short: carriers x rovers of each."""
        return f"{self.carriers}x{self.rovers}"

    def __str__(self) -> str:
        return f"{self.scenario} {self.team}"


@dataclass(frozen=True, slots=True, order=True)
class Trial:
    """One mission of a comparison; `seed` draws the starts."""

    case: Case
    contender: Contender
    seed: int

    @property
    def origin(self) -> Origin:
        return Origin(self.case.scenario, self.seed)

    def __str__(self) -> str:
        return f"{self.case}, {self.contender}, seed {self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The missions of a comparison."""

    scenarios: Mapping[Case, Scenario]  # in the order of the tables
    contenders: tuple[Contender, ...]  # the last one is the base to compare the others with
    runs: int  # missions per case and contender; their seeds are `first_seed` and those that follow
    budget: Budget  # of each planning
    paper: str | None = None  # the paper of this experiment, as in `marsupial reproduce`
    suite: str | None = None  # a name in `marsupial.bench.suite.maps`; results are then grouped by kind of map
    first_seed: int = 1
    own: Mapping[str, OwnStrategy] = field(default_factory=dict)  # strategies without a registered name, by contender's

    @property
    def files(self) -> dict[str, StrategyFile]:
        """The strategies in files, which any process can run."""
        return {name: found for name, found in self.own.items() if isinstance(found, StrategyFile)}

    def strategy(self, contender: Contender) -> AnyStrategy:
        """Return the strategy that a contender stands for."""
        return self.own.get(contender.strategy, contender.strategy)

    def trials(self) -> Iterator[Trial]:
        """Yield every mission, seed by seed, so that an interrupted comparison has about as many runs of every case."""
        for seed in range(self.first_seed, self.first_seed + self.runs):
            for case in self.scenarios:
                for contender in self.contenders:
                    yield Trial(case, contender, seed)


def prepared(scenario: Scenario) -> Scenario:
    """Return the scenario as comparisons use it: starts drawn by each mission's seed, instant planning."""
    # Charged planning time would make missions depend on the machine.
    return replace(scenario, start_seed=None, planning_time=PlanningTime.INSTANT)


def digest(scenario: Scenario) -> str:
    """Return a hash of everything in a scenario that a mission depends on."""
    grid = scenario.grid
    rest: dict[str, Any] = {
        "shape": grid.cells.shape,
        "resolution_m": grid.resolution_m,
        "terrains": [asdict(terrain) for terrain in grid.terrains],
        "types": [_type_fields(kind) for kind in scenario.robot_types],
        "team": [asdict(member) for member in scenario.team],
        "goal": asdict(scenario.goal),
        "limits": {"time_ms": scenario.limits.time_ms},
        "planning_time": str(scenario.planning_time),
        "start_seed": scenario.start_seed,
    }
    # what has no effect in most scenarios is left out of them, so that these keep their hash
    if not any(least_cells(scenario.robot_types, grid.resolution_m, scenario.goal.least_ground).values()):
        del rest["goal"]["least_ground"]
    if scenario.interference:
        rest["interference"] = True
    if scenario.limits.coverage < 1:
        rest["coverage"] = scenario.limits.coverage
    if scenario.faults:
        rest["faults"] = [asdict(fault) for fault in scenario.faults]
    if scenario.zones:
        rest["zones"] = [asdict(zone) for zone in scenario.zones]
    if grid.chargers:
        rest["chargers"] = grid.chargers
    text = json.dumps(rest, default=sorted, sort_keys=True)  # sets of terrain codes become lists
    return hashlib.sha256(grid.cells.tobytes() + text.encode()).hexdigest()[:16]


def _type_fields(kind: RobotType) -> dict[str, Any]:
    return {key: value for key, value in asdict(kind).items() if value or key not in LEFT_OUT}  # as in logs


FORMAT, VERSION = "marsupial-comparison", 1


def header_of(comparison: Comparison) -> dict[str, Any]:
    """Return the head as JSON values; `made_with` is information only, and may differ if a folder is continued."""
    budget = comparison.budget
    files = {name: found.digest for name, found in comparison.files.items()}
    return {
        "format": FORMAT,
        "version": VERSION,
        "marsupial": version("marsupial"),
        "paper": comparison.paper,
        **({"suite": comparison.suite, "first_seed": comparison.first_seed} if comparison.suite else {}),
        "contenders": [[contender.strategy, contender.planner] for contender in comparison.contenders],
        **({"files": files} if files else {}),
        "cases": [
            {
                "scenario": case.scenario,
                "carriers": case.carriers,
                "rovers": case.rovers,
                **({"interference": True} if scenario.interference else {}),
                "digest": digest(scenario),
            }
            for case, scenario in comparison.scenarios.items()
        ],
        "runs": comparison.runs,
        "budget": {"steps": budget.steps} if budget.seconds is None else {"seconds": budget.seconds},
        "made_with": {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}},
    }


def parse_header(text: str, source: str) -> dict[str, Any]:
    """Parse the text of a head; raise an `InputError` if it is not one."""
    try:
        header = parse_json(text)
    except JsonFault as error:
        raise InputError("is not the head of a comparison: no JSON", source=source) from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise InputError("is not the head of a comparison", source=source)
    if header.get("version") != VERSION:
        raise InputError(f"is of version {header.get('version')}, this marsupial knows {VERSION}", source=source)
    try:
        cases_of(header), contenders_of(header), int(header["runs"]), dict(header["budget"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("is damaged", source=source) from error
    return header


def cases_of(header: Mapping[str, Any]) -> tuple[Case, ...]:
    return tuple(Case(str(c["scenario"]), int(c["carriers"]), int(c["rovers"])) for c in header["cases"])


def contenders_of(header: Mapping[str, Any]) -> tuple[Contender, ...]:
    return tuple(Contender(str(strategy), str(planner)) for strategy, planner in header["contenders"])


def budget_text(header: Mapping[str, Any]) -> str:
    ((unit, amount),) = header["budget"].items()
    return f"{amount:g} {unit if amount != 1 else unit.removesuffix('s')}"


def demand_part(there: Mapping[str, Any], asked: Mapping[str, Any], source: str) -> None:
    """Raise a `UsageError` with the differences if a folder's comparison is not part of the requested one.

    The request may have more cases, contenders and runs, and another base or paper, since no mission depends on these.
    """
    texts = there.get("files", {}), asked.get("files", {})
    grown = {
        "files": all(texts[1].get(name, digest) == digest for name, digest in texts[0].items()),
        "cases": all(case in asked["cases"] for case in there["cases"]),
        "contenders": all(contender in asked["contenders"] for contender in there["contenders"]),
        "runs": there["runs"] <= asked["runs"],
    }
    same = (name for name in ("marsupial", "suite", "first_seed", "budget") if there.get(name) != asked.get(name))
    if names := [*same, *(name for name, fits in grown.items() if not fits)]:
        problems = [Problem(name, _difference(name, there.get(name), asked.get(name))) for name in names]
        lines = [f"{source}: {problem}" for problem in problems]
        raise UsageError("\n".join([*lines, f"{source}: it holds another comparison: choose another --out"]))


def _difference(name: str, there: Any, asked: Any) -> str:
    if name == "cases":
        before, now = (
            {f"{case['scenario']} {case['carriers']}x{case['rovers']}": case["digest"] for case in cases}
            for cases in (there, asked)
        )
        if changed := [name for name in now if name in before and before[name] != now[name]]:
            return f"another map, team or goal under the same name: {', '.join(changed)}"
        there, asked = ", ".join(before), ", ".join(now)
    if name == "files":
        changed = [name for name, digest in there.items() if asked.get(name, digest) != digest]
        return f"changed since the folder was begun: {', '.join(changed)}"
    if name == "contenders":
        there, asked = ([str(Contender(*pair)) for pair in pairs] for pairs in (there, asked))
    return f"the folder has {there}, asked for is {asked}"

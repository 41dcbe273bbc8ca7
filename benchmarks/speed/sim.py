"""The simulator against the time it simulates, sensing against plain C, and where a mission's time goes.

Views from random cells on maps of growing size are computed by the sensor of simulated robots and by `sight.c`, and
must be equal. Missions run as in `marsupial run`, with a log: first without the profiler to measure times, then once
more with it to attribute them (`attribution`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.attribution import CALLERS, profiled
from benchmarks.speed.drawn import generated
from benchmarks.speed.reference import NotCompiled, PlainSight, compiled
from benchmarks.speed.timing import Options, at_least, show, timed
from marsupial.arrays import Ints
from marsupial.cli.display.messages import say
from marsupial.generators.builtin import SCENARIOS
from marsupial.library.choices import planner_for
from marsupial.library.first_use import prepare_mission
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.library.recording import LogFile
from marsupial.library.scenarios import load_scenario
from marsupial.mission.observer import Observer, Observers
from marsupial.model.bounds import COMPARE_STEPS
from marsupial.model.grid import FLOOR, Cell, Grid
from marsupial.model.mission import MissionEvent, Revealed
from marsupial.model.planning import Budget
from marsupial.model.robots import default_types
from marsupial.model.scenario import Scenario
from marsupial.sim.sensors import FieldOfView
from marsupial.strategies.registry import strategy as named_strategy

SIZES = (256, 512, 1024, 2048)
STRATEGIES = ("heuristic", "temporal")

SIGHT_MAP, RESOLUTION_M, VIEWS = "rooms", 0.05, 200
"""The generator of the maps on which views are computed, the edge of their cells, and the number of views."""

PARTS = {
    "sim": "sensing and driving",
    "maps": "analysis",
    "paths": "analysis",
    "paths.routes": CALLERS,
    "maps.sight": CALLERS,
    "strategies": "planning",
    "planning": "planning",
    "planning.checker": "checking",
    "mission": "following plans",
    "formats": "log",
    "library.recording": "log",
}
"""The part of each module; the time of other modules counts for their callers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SightRow:
    """The views computed on one map.

    Parameters
    ----------
    cells
        Cells seen in all views.
    ours_s, reference_s
        CPU seconds, None where there is no C.
    same
        Whether both saw the same cells.
    """

    map: str
    size: int
    views: int
    cells: int
    ours_s: float
    reference_s: float | None
    same: bool

    @property
    def ratio(self) -> float | None:
        """How many times faster ours is."""
        return None if self.reference_s is None else self.reference_s / self.ours_s


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedMission:
    """The times of one mission.

    Parameters
    ----------
    simulated_s
        Simulated time of the mission.
    cpu_s
        CPU time of this process, without the profiler.
    revealed
        Number of cells, and of reveals.
    parts
        CPU seconds by part.
    """

    scenario: str
    width: int
    height: int
    strategy: str
    planner: str
    status: str
    simulated_s: float
    cpu_s: float
    replans: int
    revealed: int
    reveals: int
    parts: Mapping[str, float]

    @property
    def ratio(self) -> float:
        """How many times faster than real time the simulator is."""
        return self.simulated_s / self.cpu_s

    @property
    def revealed_per_s(self) -> float:
        """Cells revealed per CPU second of sensing and driving."""
        return self.revealed / max(self.parts[PARTS["sim"]], 1e-9)


class _Reveals(Observer):
    def __init__(self) -> None:
        self.cells = self.count = 0

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, Revealed):
            self.cells += sum(event.runs[1::3])
            self.count += 1


def bench_sight(
    sizes: Iterable[int] = SIZES, seed: int = 1, repeats: int = 3, views: int = VIEWS
) -> Iterator[SightRow]:
    """Yield a row for each map of these sizes, in cells a side."""
    for size in sizes:
        yield _sight_row(size, seed, repeats, views)


def _sight_row(size: int, seed: int, repeats: int, views: int) -> SightRow:
    library, kind = compiled("sight"), default_types(1)[0]
    truth = generated(SIGHT_MAP, size, RESOLUTION_M, seed)
    cells, sensor = _floor(truth, views, seed), FieldOfView()
    ours = timed(lambda: [sensor.visible(truth, kind, cell).copy() for cell in cells], repeats, warm=True)
    theirs = None
    if not isinstance(library, NotCompiled):
        plain, reach = PlainSight(library, truth), kind.sensor_range_m / truth.resolution_m
        theirs = timed(lambda: [plain.visible(cell, reach).copy() for cell in cells], repeats, warm=True)
    return SightRow(
        map=SIGHT_MAP,
        size=size,
        views=len(cells),
        cells=sum(map(len, ours.result)),
        ours_s=ours.cpu_s,
        reference_s=None if theirs is None else theirs.cpu_s,
        same=theirs is None or all(map(_same_cells, ours.result, theirs.result)),
    )


def bench_mission(
    scenario: Scenario, strategy: str, planner: str, budget: Budget, seed: int = 1, repeats: int = 1
) -> TimedMission:
    """Run a mission `repeats` times to measure times, and once to profile them."""
    asked = str(planner_for(strategy, planner))
    prepare_mission(scenario, strategy, asked)()
    fly = partial(_fly, scenario, strategy, asked, budget, seed)
    plain = timed(fly, repeats)
    (summary, reveals), parts = profiled(fly, PARTS, plain.cpu_s)
    return TimedMission(
        scenario=scenario.name,
        width=scenario.grid.width,
        height=scenario.grid.height,
        strategy=strategy,
        planner=asked,
        status=str(summary.status),
        simulated_s=summary.mission_time_s,
        cpu_s=plain.cpu_s,
        replans=summary.replans,
        revealed=reveals.cells,
        reveals=reveals.count,
        parts=parts,
    )


def table(sights: Sequence[SightRow], missions: Sequence[TimedMission]) -> str:
    """Write rows as text."""
    lines = [
        f"views of a carrier by chance on {SIGHT_MAP}, {RESOLUTION_M:g} m a cell, median CPU times of a view;",
        "a ratio says how many times faster ours is",
        f"{'cells':>6}{'seen':>8}{'ours us':>9}{'cells a us':>12}{'C us':>9}{'ratio':>8}  both",
        *map(_sight_line, sights),
    ]
    library = compiled("sight")
    if isinstance(library, NotCompiled):
        lines.append(f"C is left out: {library.reason}")
    lines += [
        "",
        "missions, and where their CPU time goes; a ratio says how many times faster than what they simulate",
        f"{'scenario':<15}{'cells':>12}  {'strategy':<15}{'planner':<9}{'simulated s':>12}{'CPU s':>8}{'ratio':>8}"
        f"{'replans':>8}{'revealed':>10}",
    ]
    for row in missions:
        shares = (f"{part} {seconds / row.cpu_s:.0%}" for part, seconds in row.parts.items())
        sensing = f"{row.status}, {1e-3 * row.revealed_per_s:.0f} cells a ms of sensing"
        lines += [_mission_line(row), f"  {', '.join(shares)}", f"  {sensing}"]
    return "\n".join(lines)


def values(sights: Iterable[SightRow], missions: Iterable[TimedMission]) -> list[dict[str, Any]]:
    """Return a mapping for each row, of the `kind` sight or mission; times in seconds."""
    return [
        *({"kind": "sight", **asdict(row), "ratio": row.ratio} for row in sights),
        *(
            {"kind": "mission", **asdict(row), "ratio": row.ratio, "revealed_per_s": row.revealed_per_s}
            for row in missions
        ),
    ]


def _fly(scenario: Scenario, strategy: str, planner: str, budget: Budget, seed: int) -> tuple[Summary, _Reveals]:
    reveals = _Reveals()
    with tempfile.TemporaryDirectory() as folder, LogFile(Path(folder, "log.jsonl")) as log:
        summary = simulate(
            scenario,
            strategy=strategy,
            planner=planner,
            budget=budget,
            seed=seed,
            observer=Observers([reveals, log]),
        )
    return summary, reveals


def _floor(truth: Grid, count: int, seed: int) -> list[Cell]:
    """Return random cells of the floor."""
    y, x = np.nonzero(truth.cells == FLOOR)
    drawn = np.random.default_rng(seed).choice(x.size, min(count, x.size), replace=False)
    return [Cell(int(x[i]), int(y[i])) for i in drawn]


def _same_cells(ours: Ints, theirs: Ints) -> bool:
    return np.array_equal(np.sort(ours), np.sort(theirs))


def _sight_line(row: SightRow) -> str:
    ours = f"{row.size:>6}{row.cells / row.views:>8.0f}{1e6 * row.ours_s / row.views:>9.1f}"
    ours += f"{1e-6 * row.cells / row.ours_s:>12.1f}"
    if row.reference_s is None or row.ratio is None:
        return f"{ours}{'-':>9}{'-':>8}  -"
    theirs = f"{1e6 * row.reference_s / row.views:>9.1f}{row.ratio:>7.2f}x"
    return f"{ours}{theirs}  {'see the same' if row.same else 'see DIFFERENT cells'}"


def _mission_line(row: TimedMission) -> str:
    return (
        f"{row.scenario:<15}{f'{row.width} x {row.height}':>12}  {row.strategy:<15}{row.planner:<9}"
        f"{row.simulated_s:>12.1f}{row.cpu_s:>8.2f}{row.ratio:>7.0f}x{row.replans:>8}{row.revealed:>10}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    what = "The simulator beside the time it simulates and sensing beside plain C; where the time of missions goes."
    options = Options("sim", what, repeats=3)
    options.add_maps(64, SIZES)
    options.add_argument("scenarios", nargs="*", metavar="SCENARIO", help="as for `marsupial run` (the built-in ones)")
    options.add_argument("--strategy", "-s", action="append", help=f"may be repeated ({', '.join(STRATEGIES)})")
    options.add_argument("--planner", "-p", default="anytime", help="of strategies that ask one (%(default)s)")
    options.add_argument("--steps", type=at_least(1), default=COMPARE_STEPS, help="for each planning (%(default)s)")
    chosen = options.chosen(arguments)
    strategies, budget = chosen.strategy or STRATEGIES, Budget(steps=chosen.steps)
    for name in strategies:
        named_strategy(name, planner=chosen.planner, budget=budget)  # raises before anything runs
    scenarios = [load_scenario(source).scenario for source in chosen.scenarios or SCENARIOS]
    sizes = chosen.size or SIZES
    say(f"views on maps of {', '.join(map(str, sizes))} cells a side")
    sights, missions = list(bench_sight(sizes, chosen.seed, chosen.repeats)), []
    for scenario, name in product(scenarios, strategies):
        say(f"{scenario.name} by {name}")
        missions.append(bench_mission(scenario, name, chosen.planner, budget, chosen.seed, chosen.repeats))
    show(table(sights, missions), values(sights, missions), chosen.json)
    return 0

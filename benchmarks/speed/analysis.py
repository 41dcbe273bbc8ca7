"""Map analysis after a little more of a map was revealed: incremental against from scratch.

Half of the visible part of a map is known, and a team is spread over it. Each round reveals unknown cells near a
target, 1 % of the map, and moves robots to that and other targets. Then everything that planning needs is computed
twice: by a surveyor that has seen all earlier rounds, and by a new one that knows only the map. Both must reach the
same situation. Times are medians over these rounds; as many further rounds are profiled to show where the time goes
(`attribution`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from statistics import fmean, median
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from benchmarks.speed.attribution import CALLERS, profiled
from benchmarks.speed.drawn import generated
from benchmarks.speed.timing import LONG_S, Options, show, timed
from marsupial.arrays import Bytes, Floats, Ints
from marsupial.bench.suite.best import digest_of
from marsupial.cli.display.messages import say
from marsupial.generators.builtin import bare_map_scenario
from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.mission.goals import homes_of
from marsupial.mission.placement import place_team
from marsupial.model.grid import OBSTACLE, UNKNOWN, Cell, Grid
from marsupial.model.strategy import Unseen
from marsupial.model.world import RobotReport
from marsupial.paths.fields import PathSearch

SIZES = (256, 512, 1024, 2048)

MAPS = ("rooms", "cave")
"""Generators of the maps."""

RESOLUTION_M = 0.05

KNOWN_SHARE, REVEALED_SHARE = 0.5, 0.01
"""The share of the visible cells known at first, and the share of the map revealed each time."""

LEAST_S = 2e-5
"""A shorter time is too short for a ratio."""

PARTS = {
    "maps.footprint": "footprints",
    "maps.territory": "footprints",
    "maps.growth": "reach",
    "maps.targets": "frontiers, clusters",
    "maps.views": "viewpoints",
    "maps.meetings": "meeting points",
    "maps.unseen": "unseen squares",
    "maps.survey": "travel tables",
    "paths": "travel tables",
    "paths.nearest": CALLERS,
}
"""The part of each module; the time of other modules counts for their callers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisRow:
    """Map work on one map.

    Parameters
    ----------
    revealed
        Mean number of cells revealed each time.
    targets, places
        Their numbers in the last situation; places are rows of a travel table.
    kept_s, scratch_s
        CPU seconds of the incremental surveyor and of a new one.
    kept_parts, scratch_parts
        The same by part, by profile.
    same
        Whether both had the same result each time.
    """

    map: str
    size: int
    revealed: int
    targets: int
    places: int
    kept_s: float
    scratch_s: float
    kept_parts: Mapping[str, float]
    scratch_parts: Mapping[str, float]
    same: bool

    @property
    def ratio(self) -> float:
        """How many times faster the incremental surveyor is."""
        return self.scratch_s / self.kept_s


class _Moment(NamedTuple):
    """The results of map analysis: everything a planner may ask for."""

    survey: Survey
    direct_ms: Mapping[str, Mapping[str, int]]
    unseen: Unseen

    @classmethod
    def of(cls, surveyor: Surveyor, robots: Sequence[RobotReport]) -> _Moment:
        """Compute them."""
        survey = surveyor.survey(robots, 0)
        return cls(survey, survey.direct_ms(), survey.unseen())

    def says_what(self, other: _Moment) -> bool:
        """Return whether both are the same."""
        mine, its = (digest_of(each.survey.situation) for each in (self, other))
        return mine == its and self.direct_ms == other.direct_ms and self.unseen == other.unseen


class _Growing:
    """A map that is revealed bit by bit, with a team on it and an incremental surveyor."""

    def __init__(self, truth: Grid, seed: int) -> None:
        self._truth: Bytes = truth.cells.ravel()
        self._random = np.random.default_rng(seed)
        self._ground = PathSearch(truth.cells != OBSTACLE)
        self._known = np.full_like(truth.cells, UNKNOWN)
        self._grid = replace(truth, cells=self._known)
        self._scenario = bare_map_scenario("bench", truth)
        placed = place_team(self._scenario, seed)
        self._robots = tuple(
            RobotReport(name=robot.name, type=robot.type, cell=robot.cell, carrier=robot.carrier, free_at_ms=0)
            for robot in placed
        )
        firsts = {robot.carrier: robot.name for robot in reversed(placed) if robot.carrier is not None}
        self._walking = {robot.name for robot in placed if robot.cell is not None} | set(firsts.values())
        self._homes = homes_of(self._robots, {kind.name: kind for kind in self._scenario.robot_types})
        order = self._unknown_near(next(robot.cell for robot in placed if robot.cell is not None))
        self._known.ravel()[order] = self._truth[order]
        self._known.ravel()[order[round(KNOWN_SHARE * order.size) :]] = UNKNOWN
        self._territory, self._surveyor = self._new()
        self._targets = _Moment.of(self._surveyor, self._robots).survey.targets

    def reveal(self) -> Ints:
        """Move robots to targets and reveal cells near the first target; return the new cells, ascending."""
        places: dict[str, Cell] = {}
        for robot in self._robots:
            views = [target.viewpoints[robot.type] for target in self._targets if robot.type in target.viewpoints]
            if views and robot.name in self._walking:
                places[robot.name] = views[int(self._random.integers(len(views)))]
        self._robots = tuple(
            replace(robot, cell=places[robot.name], carrier=None) if robot.name in places else robot
            for robot in self._robots
        )
        cells = np.empty(0, dtype=np.int64)
        for near in list(places.values())[:1]:
            cells = np.sort(self._unknown_near(near)[: round(REVEALED_SHARE * self._truth.size)])
        self._known.ravel()[cells] = self._truth[cells]
        return cells

    def kept(self, cells: Ints) -> _Moment:
        """Return the incremental surveyor's result after these cells were revealed to it."""
        self._territory.reveal(cells)
        moment = _Moment.of(self._surveyor, self._robots)
        self._targets = moment.survey.targets
        return moment

    def scratch(self) -> _Moment:
        """Return a new surveyor's result."""
        return _Moment.of(self._new()[1], self._robots)

    def _new(self) -> tuple[Territory, Surveyor]:
        territory = Territory(self._grid, self._scenario.robot_types)
        return territory, Surveyor(territory, self._homes, self._scenario.goal)

    def _unknown_near(self, cell: Cell) -> Ints:
        """Return the unknown cells reachable on the true map, and those beside them, by increasing path length."""
        field: Floats = ndimage.minimum_filter(self._ground.field(cell), size=3, mode="nearest")
        unknown = np.flatnonzero(np.isfinite(field) & (self._known == UNKNOWN))
        return unknown[np.argsort(field.ravel()[unknown], kind="stable")]


def bench_analysis(
    sizes: Sequence[int] = SIZES,
    seed: int = 1,
    repeats: int = 5,
    tell: Callable[[str], None] = lambda text: None,
) -> Iterator[AnalysisRow]:
    """Yield a row for each map of these sizes, in cells a side; `tell` gets the name of the next map."""
    tell("loading or compiling")
    analysis_row(MAPS[0], min(SIZES), seed, 1)
    for size in sizes:
        for name in MAPS:
            tell(f"{name}, {size} x {size} cells")
            yield analysis_row(name, size, seed, repeats)


def analysis_row(name: str, size: int, seed: int, repeats: int) -> AnalysisRow:
    """Reveal one map `repeats` times to measure times, and as often to profile."""
    growing = _Growing(generated(name, size, RESOLUTION_M, seed), seed)
    kept_s: list[float] = []
    scratch_s: list[float] = []
    revealed, same = [], True
    for _ in range(repeats):
        cells = growing.reveal()
        revealed.append(cells.size)
        kept = timed(partial(growing.kept, cells), 1)
        kept_s.append(kept.cpu_s)
        if sum(scratch_s) < LONG_S:
            scratch = timed(growing.scratch, 1)
            scratch_s.append(scratch.cpu_s)
            same &= kept.result.says_what(scratch.result)
    profiles = []
    for _ in range(repeats):
        moment, parts = profiled(partial(growing.kept, growing.reveal()), PARTS, median(kept_s))
        profiles.append(parts)
    again, scratch_parts = profiled(growing.scratch, PARTS, median(scratch_s))
    situation = moment.survey.situation
    return AnalysisRow(
        map=name,
        size=size,
        revealed=round(fmean(revealed)),
        targets=len(situation.targets),
        places=len(situation.places),
        kept_s=median(kept_s),
        scratch_s=median(scratch_s),
        kept_parts={part: fmean(each[part] for each in profiles) for part in scratch_parts},
        scratch_parts=scratch_parts,
        same=same and moment.says_what(again),
    )


def table(rows: Sequence[AnalysisRow]) -> str:
    """Write rows as text."""
    lines = [
        f"map work after {REVEALED_SHARE:.0%} of a map was revealed, {RESOLUTION_M:g} m a cell, in CPU ms:",
        "kept up to date, and from scratch; a ratio says how many times cheaper it is to keep",
        f"{'map':<7}{'cells':>6}  {'part':<21}{'kept ms':>10}{'scratch ms':>12}{'ratio':>9}",
    ]
    for row in rows:
        head = f"{row.map:<7}{row.size:>6}  "
        for part, scratch_s in row.scratch_parts.items():
            lines.append(head + _line(part, row.kept_parts[part], scratch_s))
        lines.append(head + _line("in all", row.kept_s, row.scratch_s))
        lines.append(
            f"{head}{row.targets} targets, {row.places} places, {row.revealed} cells revealed: both come to "
            f"{'the same' if row.same else 'DIFFERENT situations'}"
        )
    return "\n".join(lines)


def values(rows: Iterable[AnalysisRow]) -> list[dict[str, Any]]:
    """Return a mapping for each row; times in CPU seconds."""
    return [{**asdict(row), "ratio": row.ratio} for row in rows]


def _line(part: str, kept_s: float, scratch_s: float) -> str:
    ratio = f"{scratch_s / kept_s:>8.1f}x" if min(kept_s, scratch_s) > LEAST_S else f"{'-':>9}"
    return f"{part:<21}{1e3 * kept_s:>10.2f}{1e3 * scratch_s:>12.1f}{ratio}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = Options("analysis", "Map work after 1 % of a map was revealed, beside the same from scratch.", repeats=5)
    options.add_maps(256, SIZES)
    chosen = options.chosen(arguments)
    rows = list(bench_analysis(sizes=chosen.size or SIZES, seed=chosen.seed, repeats=chosen.repeats, tell=say))
    show(table(rows), values(rows), chosen.json)
    return 0

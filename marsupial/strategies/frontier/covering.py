"""Tours on which the team sees everything, assuming that all unknown cells are free.

The search of the clairvoyant plans the tours, on the known map with unknown cells assumed free. Robots follow the tours
while the assumption holds. If the map differs, and a tour is blocked or a robot has driven some distance since, the
tours are repaired: useful stops remain, new stops cover the missed cells, and a few rounds of the search follow. Unlike
a plan that visits frontiers, tours count cells seen in passing, so few remaining cells cost a detour later.

References
----------
S. Koenig, Y. Smirnov, C. Tovey, Performance bounds for planning in unknown terrain, Artificial Intelligence 147, 2003:
planning with unknown cells assumed free.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from time import perf_counter
from typing import ClassVar

import numpy as np

from marsupial.model import UNKNOWN, Cell, CellArray, PlacedRobot
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.search import best_outline, fitted
from marsupial.strategies.frontier.rule import FrontierRule, FrontierView

FIRST_SHARE = 4.0  # effort of the first search, before anything is explored, as a multiple of that of later ones
LATER_SHARE = 0.2  # share of its sensor range that a robot drives before unblocked tours are replanned


@dataclass(slots=True, kw_only=True)
class _Tours:
    """The tours that robots follow."""

    guess: CellArray  # the map (height, width) that the tours were planned for
    outline: Outline
    routes: dict[str, list[Cell]]  # the remaining cells of each robot, its present one first
    begun: dict[str, Cell]  # the robots' cells when the tours were planned


@dataclass(slots=True, kw_only=True)
class Covering(FrontierRule):
    """Follows tours that see everything."""

    name: ClassVar[str] = "covering"

    # rounds, seconds: limits of each search after the first; the search ends when it reaches either limit
    rounds: float = 4.0
    seconds: float = math.inf
    _tours: _Tours | None = field(default=None, init=False)
    _searches: int = field(default=0, init=False)

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        # the next cell of each robot's tour, or the nearest frontier cells if no robot has any left
        guess = view.grid.cells.copy()
        # any terrain that a robot can drive on will do; the lowest code, to be reproducible
        guess[guess == UNKNOWN] = min(frozenset[int]().union(*(robot.kind.terrains for robot in view.robots)))
        ways = self._tours
        if ways is not None and ways.guess.shape != guess.shape:  # the frame grew: cells have other indices now
            ways = self._tours = None
        if ways is None or not _follow(ways, view) or self._is_overtaken(ways, view, guess):
            ways = self._tours = self._plan(view, guess)
        chosen = {}
        for robot in view.robots:
            route = ways.routes[robot.name]
            if len(route) > 1 and view.standable[robot.kind.name][route[1].y, route[1].x]:
                chosen[robot.name] = route[1].y * view.grid.width + route[1].x
        if chosen:
            return chosen
        closest = {robot.name: view.closest(robot, view.ways(robot)) for robot in view.robots}
        return {name: goal for name, goal in closest.items() if goal is not None}

    def _is_overtaken(self, ways: _Tours, view: FrontierView, guess: CellArray) -> bool:
        """Return whether the map differs from the guess, and a robot is blocked or has driven far since."""
        if np.array_equal(guess, ways.guess):
            return False
        for robot in view.robots:
            route, begun = ways.routes[robot.name], ways.begun[robot.name]
            moved = max(abs(robot.cell.x - begun.x), abs(robot.cell.y - begun.y))
            if moved >= max(1.0, LATER_SHARE * robot.kind.sensor_range_m / view.grid.resolution_m):
                return True
            if len(route) < 2 or not view.standable[robot.kind.name][route[1].y, route[1].x]:
                return True
        return False

    def _effort(self, share: float) -> Callable[[int], float]:
        """Return a function from rounds done to the share of the effort used; `share` scales the usual rounds."""
        if not self.rounds or not self.seconds:
            return lambda _: 1.0
        began = perf_counter()
        return lambda done: max(done / (share * self.rounds), (perf_counter() - began) / self.seconds)

    def _plan(self, view: FrontierView, guess: CellArray) -> _Tours:
        placed = tuple(PlacedRobot(name=robot.name, type=robot.kind.name, cell=robot.cell) for robot in view.robots)
        kinds = {robot.kind.name: robot.kind for robot in view.robots}
        zoning = view.grid.zoning
        outside = False if zoning is None or zoning.inside is None else ~zoning.inside
        seen = np.flatnonzero((view.grid.cells != UNKNOWN) | outside)
        ground = Ground(replace(view.grid, cells=guess), tuple(kinds.values()), placed, seen)
        # tours start at the robots' cells, which need distances too
        for robot in view.robots:
            ground.add_sites(robot.kind.name, [robot.cell])
        # the number of searches seeds each one
        if self._tours is None:
            outline = best_outline(ground, self._effort(FIRST_SHARE), self._searches)
        else:
            outline = fitted(_feasible_part(self._tours.outline, ground), self._effort(1.0), self._searches)
        self._searches += 1
        routes = {robot.name: [robot.cell] for robot in view.robots}
        for tour in outline.tours():
            for a, b in pairwise(tour.cells):
                routes[tour.robot] += ground.route(tour.kind, a, b)[1:]
        begun = {robot.name: robot.cell for robot in view.robots}
        return _Tours(guess=guess, outline=outline, routes=routes, begun=begun)


def _follow(ways: _Tours, view: FrontierView) -> bool:
    """Remove passed cells from the routes; return whether every robot is on its route."""
    for robot in view.robots:
        route = ways.routes.get(robot.name, [])
        if robot.cell not in route:
            return False
        del route[: route.index(robot.cell)]
    return len(ways.routes) == len(view.robots)


def _feasible_part(outline: Outline, ground: Ground) -> Outline:
    """Return the part of an outline that is feasible on new ground."""
    reach, robots = ground.reach.by_type, {robot.name: robot for robot in ground.robots}
    viewpoints = {
        stop.name: stop.viewpoints
        for stop in outline.stops
        if all(kind in ground.kinds and reach[kind][cell.y, cell.x] for kind, cell in stop.viewpoints.items())
    }
    errands = [errand for errand in outline.errands if errand.place in viewpoints and errand.robot in robots]
    for errand in errands:
        for kind, cell in viewpoints[errand.place].items():
            ground.add_sites(kind, [cell])
    # Reach is per type. A wall where free ground was assumed may cut off a single robot from it.

    def reaches(robot: PlacedRobot, cell: Cell) -> bool:
        return robot.cell is not None and math.isfinite(ground.apart(robot.type, robot.cell, [cell])[0])

    kept = tuple(e for e in errands if reaches(robots[e.robot], viewpoints[e.place][robots[e.robot].type]))
    visited = {errand.place for errand in kept}
    stops = tuple(stop for stop in outline.stops if stop.name in visited)
    return Outline(ground=ground, stops=stops, meetings=(), errands=kept)

"""Ways on which the whole team sees everything, as if all that is unknown were free ground.

Such ways are searched for as the clairvoyant searches them, on the known map with its unknown cells taken for ground.
Robots follow them as long as they can. Whenever the map turns out to be another one, and a way is blocked or a robot
has come some way since, the ways are made to fit it: what of them is left is kept, stops are put in for what they miss,
and a few rounds of the search follow. Unlike a plan that visits frontiers, they count what is seen in passing, so
little is left behind that costs a way back.

References
----------
S. Koenig, Y. Smirnov, C. Tovey, Performance bounds for planning in unknown terrain, Artificial Intelligence 147, 2003:
planning with the unknown taken for free.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from time import perf_counter
from typing import ClassVar

import numpy as np

from marsupial.model.grid import UNKNOWN, Cell, CellArray
from marsupial.model.mission import PlacedRobot
from marsupial.strategies.clairvoyant.ground import Ground
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.search import best_outline, fitted
from marsupial.strategies.frontier.view import FrontierView

FIRST_SHARE = 4.0
"""How many times the rounds of a later search the first one has, before anything is explored."""

LATER_SHARE = 0.2
"""By which share of its sensor range a robot has to move before ways are searched for again that are not blocked."""


@dataclass(slots=True, kw_only=True)
class _Ways:
    """What robots follow.

    Parameters
    ----------
    guess
        The cells (height, width) of the map that the ways were made for.
    routes
        The cells that each robot is still to pass, its own first.
    begun
        Where the robots were when the ways were made.
    """

    guess: CellArray
    outline: Outline
    routes: dict[str, list[Cell]]
    begun: dict[str, Cell]


@dataclass(slots=True, kw_only=True)
class Covering:
    """Follows ways that see everything.

    Parameters
    ----------
    rounds, seconds
        Of the search whenever ways are made to fit the map: it ends with whatever comes first.
    """

    name: ClassVar[str] = "covering"
    each_step: ClassVar[bool] = True
    gives_up: ClassVar[bool] = True
    most_robots: ClassVar[int | None] = None

    rounds: float = 4.0
    seconds: float = math.inf
    _ways: _Ways | None = field(default=None, init=False)
    _searches: int = field(default=0, init=False)

    def choose(self, view: FrontierView) -> Mapping[str, int]:
        """Return the next cell of each robot's way, or the nearest frontier cell where no robot has any."""
        guess = view.grid.cells.copy()
        guess[guess == UNKNOWN] = min(frozenset[int]().union(*(robot.kind.terrains for robot in view.robots)))
        ways = self._ways = self._fitting(guess)
        if ways is None or not _follow(ways, view) or self._is_overtaken(ways, view, guess):
            ways = self._ways = self._searched(view, guess)
        chosen = {}
        for robot in view.robots:
            route = ways.routes[robot.name]
            if len(route) > 1 and view.standable[robot.kind.name][route[1].y, route[1].x]:
                chosen[robot.name] = route[1].y * view.grid.width + route[1].x
        if chosen:
            return chosen
        closest = {robot.name: view.closest(robot, view.ways(robot)) for robot in view.robots}
        return {name: goal for name, goal in closest.items() if goal is not None}

    def _fitting(self, guess: CellArray) -> _Ways | None:
        """Return the ways that were made before, unless the frame of the map has grown: their cells are others now."""
        return None if self._ways is None or self._ways.guess.shape != guess.shape else self._ways

    def _is_overtaken(self, ways: _Ways, view: FrontierView, guess: CellArray) -> bool:
        """Say whether the map has turned out another one, and some robot is blocked or has come far since."""
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

    def _used(self, share: float) -> Callable[[int], float]:
        """Return what says which share of the effort is used after so many rounds, of `share` times the usual ones."""
        if not self.rounds or not self.seconds:
            return lambda _: 1.0
        began = perf_counter()
        return lambda done: max(done / (share * self.rounds), (perf_counter() - began) / self.seconds)

    def _searched(self, view: FrontierView, guess: CellArray) -> _Ways:
        """Return ways for the map as it is now."""
        placed = tuple(PlacedRobot(name=robot.name, type=robot.kind.name, cell=robot.cell) for robot in view.robots)
        kinds = {robot.kind.name: robot.kind for robot in view.robots}
        seen = np.flatnonzero(view.grid.cells != UNKNOWN)
        ground = Ground(replace(view.grid, cells=guess), tuple(kinds.values()), placed, seen)
        for robot in view.robots:
            ground.add_sites(robot.kind.name, [robot.cell])
        if self._ways is None:
            outline = best_outline(ground, self._used(FIRST_SHARE), self._searches)
        else:
            outline = fitted(_left_of(self._ways.outline, ground), self._used(1.0), self._searches)
        self._searches += 1
        routes = {robot.name: [robot.cell] for robot in view.robots}
        for tour in outline.tours():
            for a, b in pairwise(tour.cells):
                routes[tour.robot] += ground.route(tour.kind, a, b)[1:]
        begun = {robot.name: robot.cell for robot in view.robots}
        return _Ways(guess=guess, outline=outline, routes=routes, begun=begun)


def _follow(ways: _Ways, view: FrontierView) -> bool:
    """Take what was passed off the routes; say whether every robot is on its own."""
    for robot in view.robots:
        route = ways.routes.get(robot.name, [])
        if robot.cell not in route:
            return False
        del route[: route.index(robot.cell)]
    return len(ways.routes) == len(view.robots)


def _left_of(outline: Outline, ground: Ground) -> Outline:
    """Return what of an outline can still be done on other ground."""
    reach = ground.reach.by_type
    stops = tuple(
        stop
        for stop in outline.stops
        if all(kind in ground.kinds and reach[kind][cell.y, cell.x] for kind, cell in stop.viewpoints.items())
    )
    robots, names = {robot.name: robot for robot in ground.robots}, {stop.name for stop in stops}
    errands = tuple(errand for errand in outline.errands if errand.place in names and errand.robot in robots)
    visited = {errand.place for errand in errands}
    stops = tuple(stop for stop in stops if stop.name in visited)
    for stop in stops:
        for kind, cell in stop.viewpoints.items():
            ground.add_sites(kind, [cell])
    # Reach says where a type can come, but this robot may be cut off from there: a wall where free ground was assumed.
    viewpoints = {stop.name: stop.viewpoints for stop in stops}
    errands = tuple(
        errand
        for errand in errands
        if _reaches(ground, robots[errand.robot], viewpoints[errand.place][robots[errand.robot].type])
    )
    visited = {errand.place for errand in errands}
    return Outline(
        ground=ground, stops=tuple(stop for stop in stops if stop.name in visited), meetings=(), errands=errands
    )


def _reaches(ground: Ground, robot: PlacedRobot, cell: Cell) -> bool:
    """Return whether a robot has a way from where it stands to a site of its type."""
    return robot.cell is not None and math.isfinite(ground.apart(robot.type, robot.cell, [cell])[0])

"""The routes of two strategies through the same area, side by side.

References: Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, Figs. 8 to 10.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from marsupial.bench.compare.figures import COLOURS, INK, Figure, as_figure
from marsupial.bench.compare.plan import Contender
from marsupial.library.missions import simulate
from marsupial.mission.observer import Observer
from marsupial.model import OBSTACLE, Budget, Cell, DriveEnded, DriveStarted, MissionEvent, Scenario
from marsupial.paths.routes import route_of


class _Trail(Observer):
    """Collects the cells that a robot drives to, without the unfinished part of a drive."""

    def __init__(self) -> None:
        self.cells: list[Cell] = []
        self._drive: tuple[Cell, ...] = ()

    def event(self, event: MissionEvent) -> None:
        """Add the cells of a drive, or cut it at its end."""
        if isinstance(event, DriveStarted):
            self._drive = route_of(event.cell, event.steps)
        elif isinstance(event, DriveEnded) and event.cell in self._drive:
            self.cells += self._drive[: self._drive.index(event.cell) + 1]


SEED = 1
"""Seed of the start."""


def routes_figure(scenario: Scenario, contenders: Sequence[Contender], *, name: str, about: str) -> Figure:
    """Return the routes of contenders without a planner, from a random start."""
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(3.4 * len(contenders), 3.7), layout="constrained")
    walls = np.where(scenario.grid.cells == OBSTACLE, 1.0, np.nan)
    for panel, contender in zip(drawing.subplots(1, len(contenders), squeeze=False)[0], contenders, strict=True):
        trail = _Trail()
        summary = simulate(
            scenario,
            strategy=contender.strategy,
            planner=contender.planner,
            budget=Budget(steps=1),
            seed=SEED,
            observer=trail,
        )
        panel.imshow(walls, origin="lower", cmap="gray", vmin=0, vmax=2.5, interpolation="nearest")
        panel.plot(*np.array(trail.cells).T, color=COLOURS[0], linewidth=0.9)
        panel.plot(*trail.cells[0], "o", color=COLOURS[1], markersize=5)
        panel.set_title(f"{contender}: {summary.distance_m:.0f} m, {summary.energy_j:.0f} J", fontsize=9, color=INK)
        panel.set_axis_off()
    title = f"Routes: {about}"
    of_paper = f"{name.replace('-', ' ').capitalize()} of the paper with our map. "
    caption = f"{of_paper}{title}, of the mission with seed {SEED}; the dot is the start."
    return as_figure(drawing, name, title, caption, about)

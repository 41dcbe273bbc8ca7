"""The Voronoi graph, the critical points and the segments of a partly known map as a figure.

References: Wurm, Stachniss, Burgard, IROS 2008, Figs. 2 and 3.
"""

from __future__ import annotations

import colorsys
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.bench.compare.figures import COLOURS, INK, Figure, as_figure
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.maps.growth import reach_of
from marsupial.maps.targets import TargetFinder
from marsupial.maps.territory import Territory
from marsupial.maps.window import Window
from marsupial.mission.playback import Playback
from marsupial.model import UNKNOWN, Budget, Cell, Grid, PlacedRobot, Scenario
from marsupial.papers.wurm2008.segmentation import Segmentation, segment

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HUE_STEP = 0.618034  # step of hue from a segment to the next, the golden ratio: neighbours in the sequence differ well
PALE = 0.35  # saturation of the segments
MARGIN_M = 0.5  # margin around the known map

WIDTH_IN = 7.0


def segments_figure(scenario: Scenario, *, share: float = 0.4, seed: int = 1) -> Figure:
    """Return the figure of a map's segmentation after a share of a mission's time."""
    grid, frontier = _moment(scenario, share, seed)
    terrains = frozenset[int]().union(*(kind.terrains for kind in scenario.robot_types))
    found = segment(grid, terrains, frontier)
    title = f"Voronoi graph, critical points and segments: {scenario.name}"
    caption = (
        f"Figs. 2 and 3 of the paper with our data. {title}, {100 * share:.0f} % of the time into a mission of "
        f"{len(scenario.team)} robots. Above: distance to the closest obstacle, the darker the larger. Middle: the "
        "pruned Voronoi graph and its junctions. Below: the segments; dots are critical points, rings narrow points "
        "that lead to nothing unknown. Grey is unknown."
    )
    return _drawn(grid, found, f"segments-{scenario.name}", title, caption)


def _moment(scenario: Scenario, share: float, seed: int) -> tuple[Grid, Ints]:
    """Return the known map after a share of a mission's time, and its remaining frontier cells."""
    events = Recorder()
    simulate(scenario, strategy="segmentation", planner="none", budget=Budget(steps=1), seed=seed, observer=events)
    played = Playback(events.events)
    t_ms = round(share * played.end_ms)
    grid = replace(scenario.grid, cells=played.cells_at(t_ms))
    robots = tuple(
        PlacedRobot(name=robot.name, type=robot.type, cell=Cell(round(robot.x), round(robot.y)))
        for robot in played.robots_at(t_ms)
    )
    territory = Territory(grid, scenario.robot_types)
    frontiers = TargetFinder(territory).frontiers(reach_of(territory, robots))
    return grid, np.unique(np.concatenate([frontier.cells for frontier in frontiers.values()]))


def _drawn(grid: Grid, found: Segmentation, name: str, title: str, caption: str) -> Figure:
    from matplotlib.figure import Figure as Drawing

    y, x = np.nonzero(grid.cells != UNKNOWN)
    margin = round(MARGIN_M / grid.resolution_m)
    low, high = Cell(int(x.min()), int(y.min())), Cell(int(x.max()), int(y.max()))
    shown = Window.around(low, high, margin, grid.cells.shape)
    ratio = (shown.top - shown.bottom) / (shown.right - shown.left)
    drawing = Drawing(figsize=(WIDTH_IN, 3 * WIDTH_IN * ratio + 0.3), layout="constrained")
    panels = drawing.subplots(3, 1)
    for axes in panels:
        axes.set_axis_off()
        axes.set_xlim(shown.left, shown.right)
        axes.set_ylim(shown.bottom, shown.top)
        axes.set_aspect("equal")
    blank = _painted(grid, found, np.ones((found.count + 1, 3)))
    _paint(panels[0], shown, _shaded(grid, found, blank))
    _paint(panels[1], shown, blank)
    _graph(panels[1], found, width=1.0)
    pale = [colorsys.hsv_to_rgb(HUE_STEP * k % 1.0, PALE, 1.0) for k in range(found.count + 1)]
    _paint(panels[2], shown, _painted(grid, found, np.array(pale)))
    _graph(panels[2], found, width=0.6)
    # Critical points are dots, dismissed ones rings.
    panels[2].plot(*found.blocks.xy(found.dismissed), "o", markersize=3.5, markerfacecolor="none", markeredgecolor=INK)
    panels[2].plot(*found.blocks.xy(found.critical), "o", markersize=5, color=COLOURS[0], markeredgecolor="white")
    return as_figure(drawing, name, title, caption)


def _painted(grid: Grid, found: Segmentation, colours: Floats) -> Floats:
    """Return the map (height, width, 3): segments in their colours, unknown cells grey, obstacles dark."""
    picture = np.where((grid.cells == UNKNOWN)[:, :, None], 0.78, 0.15) * np.ones(3)
    inside = found.labels > 0
    picture[inside] = colours[found.labels[inside]]
    return picture


def _shaded(grid: Grid, found: Segmentation, blank: Floats) -> Floats:
    """Return the map with ground darker with the distance from obstacles."""
    space = found.blocks
    clearance = np.where(space.known, space.clearance, 0.0)
    rows, columns = (np.arange(n) // space.scale for n in grid.cells.shape)
    row = np.clip(rows - space.row, 0, clearance.shape[0] - 1)
    column = np.clip(columns - space.column, 0, clearance.shape[1] - 1)
    shade = 1.0 - 0.75 * clearance / max(1.0, float(clearance.max()))
    picture = blank.copy()
    inside = found.labels > 0
    picture[inside] = shade[np.ix_(row, column)][inside][:, None]
    return picture


def _paint(axes: Axes, shown: Window, picture: Floats) -> None:
    extent = (shown.left, shown.right, shown.bottom, shown.top)
    axes.imshow(picture[shown.cut], origin="lower", extent=extent, interpolation="nearest")


def _graph(axes: Axes, found: Segmentation, *, width: float) -> None:
    graph = found.graph
    for edge, (start, end) in enumerate(graph.ends.tolist()):
        inner = graph.inner[graph.bounds[edge] : graph.bounds[edge + 1]]
        along = np.concatenate([graph.nodes[[start]], inner, graph.nodes[[end]]])
        axes.plot(*found.blocks.xy(along), color=COLOURS[4], linewidth=width)
    axes.plot(*found.blocks.xy(graph.nodes[graph.degrees >= 3]), ".", color=COLOURS[4], markersize=2.5 * width)

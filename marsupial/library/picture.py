"""The drawing of a mission for notebooks: the explored map, robots' trails, where rovers were set down and picked up.

Each carrier has a colour; the rovers that start aboard it have shades of that colour.
"""

import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from marsupial.exports.figures import MapAxes
from marsupial.exports.ground import frontier, ground_image
from marsupial.exports.trails import Handover, drives, handovers, trail
from marsupial.library.metrics import METRICS, Summary
from marsupial.mission.playback import Playback
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, ActionName, CellArray, MissionEvent, MissionStarted
from marsupial.replay.palette import LIGHT, robot_styles

TITLE = (("exploration_time_s", "mission_time_s"), ("coverage", "distance_m", "quality"))
"""The metrics in the title, line by line."""

WIDTH_IN, DPI = 9.0, 110

MOST_LEGEND_ROWS = 26


class MissionFigure(Figure):
    """A figure that notebooks show without pyplot."""

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.savefig(data, format="png")
        return data.getvalue()


def mission_figure(events: Sequence[MissionEvent], summary: Summary) -> MissionFigure:
    """Return the drawing of a mission."""
    playback = Playback(events)
    mission = playback.mission
    shape = mission.height / mission.width
    figure = MissionFigure(figsize=(WIDTH_IN, max(3.0, 0.8 * WIDTH_IN * shape + 0.9)), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    frame = MapAxes(mission.width, mission.height, mission.resolution_m, mission.origin_m)
    cells = playback.cells_at(playback.end_ms)
    axes.imshow(ground_image(cells, LIGHT), origin="lower", extent=frame.extent, interpolation="nearest")
    colours = {name: LIGHT.robot(style) for name, style in robot_styles(mission).items()}
    _draw_trails(axes, frame, playback, colours)
    _draw_meetings(axes, frame, handovers(playback), colours)
    _draw_starts(axes, frame, mission, colours)
    frame.label(axes)
    lines = (", ".join(f"{METRICS[key].title} {METRICS[key].shown(summary)}" for key in row) for row in TITLE)
    head = f"{summary.scenario}: {summary.strategy} ({summary.planner}), seed {summary.seed}: {summary.status}"
    axes.set_title("\n".join([head, *lines]), fontsize=10, loc="left")
    figure.legend(
        handles=[*_legend(mission, colours), *_grounds(mission, cells)],
        loc="outside right upper",
        fontsize=8,
        frameon=False,
        ncols=1 + (len(colours) + 5) // MOST_LEGEND_ROWS,
    )
    return figure


def _draw_trails(axes: Axes, frame: MapAxes, playback: Playback, colours: Mapping[str, str]) -> None:
    for robot, found in drives(playback).items():
        points = trail(found, playback.end_ms)
        if len(points):
            x, y = frame.points(points).T
            axes.plot(x, y, color=colours[robot], **_line(playback.mission, robot))


def _line(mission: MissionStarted, robot: str) -> dict[str, Any]:
    """Return the style of a robot's trail: a rover's is thin, to be seen above a carrier's broad one."""
    is_rover = any(one.name == robot and one.carrier is not None for one in mission.robots)
    return {"linewidth": 1.0 if is_rover else 2.2, "alpha": 0.95 if is_rover else 0.55, "solid_capstyle": "round"}


def _draw_meetings(axes: Axes, frame: MapAxes, places: Sequence[Handover], colours: Mapping[str, str]) -> None:
    for place in places:
        rover = place.rover
        x, y = frame.centre(place.cell)
        filled = place.name is ActionName.UNDOCK
        axes.plot(x, y, "v" if filled else "^", markersize=5.5, markeredgewidth=1.1, markeredgecolor=colours[rover],
                  color=colours[rover] if filled else "white", zorder=4)  # fmt: skip


def _draw_starts(axes: Axes, frame: MapAxes, mission: MissionStarted, colours: Mapping[str, str]) -> None:
    for robot in mission.robots:
        if robot.cell is not None:
            x, y = frame.centre(robot.cell)
            axes.plot(x, y, "o", markersize=8, color=colours[robot.name], markeredgecolor="black", zorder=5)


def _legend(mission: MissionStarted, colours: Mapping[str, str]) -> list[Line2D]:
    robots = [Line2D([], [], color=colour, label=name, **_line(mission, name)) for name, colour in colours.items()]
    signs = (("o", "start", "#777777"), ("v", "undocked", "#777777"), ("^", "docked", "white"))
    return robots + [
        Line2D([], [], linestyle="", marker=mark, color=face, markeredgecolor="#555555", label=name)
        for mark, name, face in signs
    ]


def _grounds(mission: MissionStarted, cells: CellArray) -> Iterator[Patch]:
    """Yield legend entries for the ground that occurs, but for floor and obstacles."""
    names = [terrain.name for terrain in mission.terrains if terrain.code not in (UNKNOWN, OBSTACLE, FLOOR)]
    codes = [terrain.code for terrain in mission.terrains if terrain.name in names]
    if np.isin(cells, codes).any():
        yield Patch(facecolor=LIGHT.other, edgecolor="#999999", label=", ".join(names))
    if (cells == UNKNOWN).any():
        yield Patch(facecolor=LIGHT.unknown, edgecolor="#999999", label="unknown")
    if frontier(cells).any():
        yield Patch(facecolor=LIGHT.frontier, edgecolor="#999999", label="frontier")
